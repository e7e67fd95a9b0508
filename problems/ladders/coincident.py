"""Two nodes of a part that nearly coincide: a spring between them, ever stiffer than the part."""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.forms.assembly import Assembly, LoadCase
from problems.manufactured.exact import exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung
from problems.stiffness.operator import Stiffness

N = 64  # unknowns per part
CONDITION = 1e4


def _rung(bits: int) -> Rung:
    d = spectrum(N, CONDITION)
    made = manufacture(exact_model(d, d), seed=4)
    spring = 2.0**bits  # N/mm; the part's largest eigenvalue is 64e4
    return Rung(f"Two parts, two nodes tied by {spring:.0e} N/mm", made=_tied(made, spring))


def _tied(made: ManufacturedProblem, spring: float) -> ManufacturedProblem:
    """K += k bbᵀ and f += k b(bᵀx) with b = e₀ − e₁: the same solution, still without rounding."""
    assert made.x is not None
    b = np.zeros(N)
    b[:2] = 1.0, -1.0
    first, *others = (block.matrix for block in made.assembly.K.blocks)
    blocks = (np.asfortranarray(first + spring * np.outer(b, b)), *others)
    f = made.load.f.copy()
    f[:N] += spring * b * (b @ made.x[:N])
    assembly = Assembly(Stiffness.of(*blocks), made.assembly.A, None, made.assembly.parts)
    return ManufacturedProblem(assembly, LoadCase(f, made.load.g), made.x, made.lam)


RUNGS: Ladder = {f"{2.0**bits:.0e}": partial(_rung, bits) for bits in (22, 27, 32, 37, 42, 45)}
