"""From the answers to a block of load cases to displacements, gaps, residuals and proven error bounds.

Each answer is refined to a proven one (see `proof`); its own bound is the distance to that, and the other's
bound. All cases of the block share their passes over K.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import LoadCase, Vector, stacked
from problems.stiffness.rounding import U

from .enclosure import SAFE
from .proof import Proof


@dataclass(frozen=True)
class Assessment:
    """One answer: x (n,) mm, gap = g − Aᵀx (m,) mm, and the proven bound max|x − x*| ≤ bound_mm.

    active : the number of closed contacts of the proven answer.
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
    proof: Proof,
    loads: Sequence[LoadCase],
    lams: Sequence[Vector],
    xs: Sequence[Vector | None],
    enough_mm: float = 0.0,
) -> list[Assessment]:
    """An assessment per load of its finite λ (m,) and, in a form that gives it, the solver's own x (n,).

    In the dual form the answer is x = K⁻¹(f − Aλ). enough_mm : a proven answer that is near enough.
    """
    assembly, load = proof.balanced.assembly, stacked(loads)
    lam, given = np.column_stack(lams), [x for x in xs if x is not None]
    x = np.column_stack(given) if given else assembly.K.solve(load.f - assembly.A @ lam)
    proven = proof.proven(loads, lams, x.T, enough_mm)
    known = np.column_stack([each.x.hi for each in proven])
    gap, r = load.g - assembly.A.T @ x, load.f - assembly.K.multiply(x) - assembly.A @ lam
    near = np.array([each.bound_mm for each in proven])
    away = abs(assembly.at_junction(x - known)).max(axis=0, initial=0.0)
    bounds = SAFE * near + (1 + 4 * U) * away
    bounds = np.where(np.isfinite(bounds), bounds, np.inf)
    return [
        Assessment(
            x=x[:, k],
            gap=gap[:, k],
            active=int(proven[k].active.sum()),
            bound_mm=float(bounds[k]),
            primal_residual=float(max(-gap[:, k].min(initial=0.0), 0.0)),
            dual_residual=float(max(abs(r[:, k]).max(initial=0.0), -lam[:, k].min(initial=0.0))),
            duality_gap=float(abs(lam[:, k] @ gap[:, k] - x[:, k] @ r[:, k])),
        )
        for k in range(len(loads))
    ]
