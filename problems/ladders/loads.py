"""Unusual loads and gaps on two ordinary parts, cond(K) = 1e6."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from problems.forms.assembly import LoadCase, Vector
from problems.manufactured.exact import ExactModel, Random, Shares, exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung

N = 64  # contacts
FORCE = 1000.0  # N
PERTURBATION = 2.0**-40  # about 1e-12


def _model() -> ExactModel:
    d = spectrum(N, 1e6)
    return exact_model(d, d)


def _random(title: str, gap: Callable[[Random], Vector], force: float = FORCE) -> Rung:
    """Random forces up to `force` on every node, without a prescribed solution."""
    random = np.random.default_rng(7)
    f = random.uniform(-force, force, 2 * N)
    return Rung(title, made=ManufacturedProblem(_model().assembly(), LoadCase(f, gap(random))))


def _constant(value: float) -> Callable[[Random], Vector]:
    return lambda random: np.full(N, value)


def _everywhere() -> Rung:
    return Rung("Every contact closed", made=manufacture(_model(), seed=8, shares=Shares(1.0)))


def _perturbed(title: str, lam: float, gap: float) -> Rung:
    """A third of the contacts are weakly active; a tiny force `lam`, N, or `gap`, mm, is added to each."""
    made = manufacture(_model(), seed=9, shares=Shares(0.3, 0.3))
    assert made.x is not None
    assert made.lam is not None
    A, y = made.assembly.A, made.load.g - made.assembly.A.T @ made.x
    weak = (made.lam == 0) & (y == 0)
    load = LoadCase(made.load.f + A @ np.where(weak, lam, 0.0), made.load.g + np.where(weak, gap, 0.0))
    return Rung(
        title, made=ManufacturedProblem(made.assembly, load, made.x, made.lam + np.where(weak, lam, 0.0))
    )


RUNGS: Ladder = {
    "random-gap": partial(_random, "Gaps of 0 to 0.5 mm", lambda random: random.uniform(0, 0.5, N)),
    "no-contact": partial(_random, "Gaps of 1000 mm: no contact closes", _constant(1000.0)),
    "everywhere": _everywhere,
    "zero-gap": partial(_random, "No gap", _constant(0.0)),
    "gap-1e-09": partial(_random, "Gaps of 1e-9 mm", _constant(1e-9)),
    "overclosure": partial(_random, "Overlaps of 0 to 0.5 mm", lambda random: -random.uniform(0, 0.5, N)),
    "huge-force": partial(_random, "Forces of 1e9 N", _constant(0.1), force=1e9),
    "tiny-force": partial(_random, "Forces of 1e-9 N, no gap", _constant(0.0), force=1e-9),
    "no-load": partial(_random, "Gaps of 0.1 mm, no load", _constant(0.1), force=0.0),
    "nothing": partial(_random, "No gap, no load", _constant(0.0), force=0.0),
    "flip-open": partial(_perturbed, "A third of the contacts open by 1e-12 mm", 0.0, PERTURBATION),
    "flip-closed": partial(_perturbed, "A third of the contacts closed by 1e-12 N", PERTURBATION, 0.0),
}
