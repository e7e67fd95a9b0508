"""Unusual loads and gaps on two ordinary parts, cond(K) = 1e6."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from problems.forms.assembly import LoadCase
from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.exact import exact_assembly, spectrum, two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices

N = 64  # contacts
CONDITION = 1e6
PERTURBATION = 2.0**-40  # about 1e-12

_parts = partial(two_parts, N, CONDITION)


def _random(title: str, gap: float, more: float = 0.0, force: float = 1000.0) -> Scene:
    """Random forces up to `force`, N, and gaps from `gap` to `more` beyond, mm; the solution is unknown."""
    random, d = np.random.default_rng(7), spectrum(N, CONDITION)
    assembly = exact_assembly(d, d)
    f = random.uniform(-force, force, assembly.n)
    load = LoadCase(f, gap + more * random.random(assembly.m))
    return matrices(title, ManufacturedProblem(assembly, load))


def _perturbed(title: str, lam: float, gap: float) -> Scene:
    """A third of the contacts are weakly active; a tiny force `lam`, N, or `gap`, mm, is added to each."""
    made = _parts(seed=9, closed=0.3, weak=0.3)
    assert made.x is not None
    assert made.lam is not None
    A, y = made.assembly.A, made.load.g - made.assembly.A.T @ made.x
    weak = (made.lam == 0) & (y == 0)
    load = LoadCase(made.load.f + A @ np.where(weak, lam, 0.0), made.load.g + np.where(weak, gap, 0.0))
    return matrices(title, replace(made, load=load, lam=made.lam + np.where(weak, lam, 0.0)))


RUNGS: dict[str, Ladder] = {
    "loads": {
        "random-gap": partial(_random, "Gaps of 0 to 0.5 mm", 0.0, 0.5),
        "no-contact": partial(_random, "Gaps of 1000 mm: no contact closes", 1000.0),
        "everywhere": lambda: matrices("Every contact closed", _parts(seed=8, closed=1.0)),
        "zero-gap": partial(_random, "No gap", 0.0),
        "gap-1e-09": partial(_random, "Gaps of 1e-9 mm", 1e-9),
        "overclosure": partial(_random, "Overlaps of 0 to 0.5 mm", 0.0, -0.5),
        "huge-force": partial(_random, "Forces of 1e9 N", 0.1, force=1e9),
        "tiny-force": partial(_random, "Forces of 1e-9 N, no gap", 0.0, force=1e-9),
        "no-load": partial(_random, "Gaps of 0.1 mm, no load", 0.1, force=0.0),
        "nothing": partial(_random, "No gap, no load", 0.0, force=0.0),
        "flip-open": partial(_perturbed, "A third of the contacts open by 1e-12 mm", 0.0, PERTURBATION),
        "flip-closed": partial(_perturbed, "A third of the contacts closed by 1e-12 N", PERTURBATION, 0.0),
    }
}
