"""From the forces of a block of load cases to displacements, gaps, residuals and proven error bounds.

All cases of the block are treated at once, by matrix–matrix products.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import LoadCase, Vector, stacked

from .bound import Bound, gaps
from .residual import SAFE, refined, residual, split


@dataclass(frozen=True)
class Assessment:
    """One answer: x (n,) mm, gap = g − Aᵀx (m,) mm, and the proven bound max|x − x*| ≤ bound_mm.

    active : the number of closed contacts, those with q_ii λ_i > (Qλ − p)_i.
    primal_residual, dual_residual, duality_gap : as in `judge`, mm, N, N·mm.
    """

    x: Vector
    gap: Vector
    active: int
    bound_mm: float
    primal_residual: float
    dual_residual: float
    duality_gap: float


@np.errstate(over="ignore", invalid="ignore")
def assess(
    bound: Bound,
    loads: Sequence[LoadCase],
    lams: Sequence[Vector],
    xs: Sequence[Vector | None],
) -> list[Assessment]:
    """An assessment per load of its finite λ (m,) and, in the primal form, the solver's own x (n,).

    In the dual form the answer is x = K⁻¹(f − Aλ). The bound is that of a nearby point, whose λ is zero
    where q_ii λ_i ≤ (Qλ − p)_i, plus the distance to it.
    """
    prepared, assembly = bound.prepared, bound.prepared.assembly
    A = assembly.A
    f, g = (np.column_stack([getattr(load, name) for load in loads]) for name in "fg")
    has_p = all(load.p.size for load in loads)
    p = np.column_stack([load.p for load in loads]) if has_p else prepared.dual_load(stacked(loads))
    lam = np.column_stack(lams)
    compliance = np.diag(prepared.Q)[:, None]
    clean = np.where(compliance * lam > prepared.Q @ lam - p, np.maximum(lam, 0.0), 0.0)

    x = split(assembly, prepared.assembly.K.solve(f - A @ clean))
    r, r_error = residual(assembly, f, x, clean)
    x, r, r_error = refined(assembly, x, r, r_error, prepared.assembly.K.solve(r), bound.stiffest)
    bounds = bound.bound(r, r_error, *gaps(assembly, g, x), clean)

    given = x.rounded
    removed = A @ (lam - clean)
    if xs[0] is not None:
        answer = np.column_stack([each for each in xs if each is not None])
    else:
        answer = given - prepared.assembly.K.solve(removed) if removed.any() else given
    moved = answer - given
    rounding = np.finfo(float).eps * abs(given).max(axis=0)
    bounds = SAFE * (bounds + abs(moved).max(axis=0) + rounding)  # `moved` itself is rounded
    bounds = np.where(np.isfinite(bounds), bounds, np.inf)
    if moved.any():
        r = r - assembly.K.multiply(moved) - removed
    gap = g - A.T @ answer
    return [
        Assessment(
            x=answer[:, k],
            gap=gap[:, k],
            active=int((clean[:, k] > 0).sum()),
            bound_mm=float(bounds[k]),
            primal_residual=float(max(-gap[:, k].min(initial=0.0), 0.0)),
            dual_residual=float(max(abs(r[:, k]).max(initial=0.0), -lam[:, k].min(initial=0.0))),
            duality_gap=float(abs(lam[:, k] @ gap[:, k] - answer[:, k] @ r[:, k])),
        )
        for k in range(len(loads))
    ]
