"""Two nodes of a part that nearly coincide: a spring between them, ever stiffer than the part."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from problems.forms.assembly import LoadCase
from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.exact import two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices
from problems.stiffness.operator import Stiffness


def _rung(bits: int) -> Scene:
    spring = 2.0**bits  # N/mm; the part's largest eigenvalue is 64e4
    problem = _tied(two_parts(64, 1e4, seed=4), spring)
    return matrices(f"Two parts, two nodes tied by {spring:.0e} N/mm", problem)


def _tied(made: ManufacturedProblem, spring: float) -> ManufacturedProblem:
    """K += k bbᵀ and f += k b(bᵀx) with b = e₀ − e₁: the same solution, still without rounding."""
    assert made.x is not None
    first, *others = made.assembly.K.matrices
    b = np.zeros(len(first))
    b[:2] = 1.0, -1.0
    K = Stiffness.of(np.asfortranarray(first + spring * np.outer(b, b)), *others)
    f = made.load.f.copy()
    f[: b.size] += spring * b * (b @ made.x[: b.size])
    return replace(made, assembly=replace(made.assembly, K=K), load=LoadCase(f, made.load.g))


RUNGS: Ladder = {f"{2.0**bits:.0e}": partial(_rung, bits) for bits in (22, 27, 32, 37, 42, 45)}
