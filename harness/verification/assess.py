"""Assesses the answers to a block of load cases: displacements, gaps, residuals and proven error bounds.

Each answer is refined to a proven one (proof.py). The bound of the answer is its distance to the proven one
plus the bound of that. All cases of the block share their passes over K.

The gap of contact j is y_j = g_j − a_jᵀx*. It is computed as ŷ = fl(g − Aᵀx) from an x with max|x − x*| ≤ e.
If a_j has k entries, a term of a_jᵀx takes part in at most k + 1 roundings: its product, k − 1 additions and
the subtraction from g_j, u = 2⁻⁵³ each; a product that underflows is off by less than η = 2⁻¹⁰⁷⁴. So (Higham,
Accuracy and Stability of Numerical Algorithms, 2002, section 3.1), with γ_k = ku/(1 − ku),

    |ŷ_j − y_j| ≤ ‖a_j‖₁ e + γ_{k+1} (|g_j| + |a_j|ᵀ|x|) + kη.

The error E_j returned is above that: with γ_{k+2}, whose further rounding is that of ŷ_j ± E_j in a
comparison with a limit, |fl(ŷ ± E) − (ŷ ± E)| ≤ u(|ŷ| + E), and a factor for the rounding of E itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Vector, stacked
from problems.stiffness import SAFE, U, gamma

from .enclosure import ETA
from .proof import Proof


@dataclass(frozen=True)
class Assessment:
    """An answer with its figures: x (n,) mm, gap = g − Aᵀx (m,) mm, the proven bound max|x − x*| ≤ bound_mm.

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
    """An assessment of the answer to each load case.

    lams : finite λ (m,) N. xs : the solver's own x (n,) mm; None in the dual form, where x = K⁻¹(f − Aλ).
    enough_mm : the bound at which a proven answer is refined no further.
    """
    assembly, load = proof.balanced.assembly, stacked(loads)
    lam, own_x = np.column_stack(lams), [x for x in xs if x is not None]
    x = np.column_stack(own_x) if own_x else assembly.K.solve(load.f - assembly.A @ lam)
    proven = proof.proven(loads, lams, x.T, enough_mm)
    proven_x = np.column_stack([answer.x.hi for answer in proven])
    gap, r = load.g - assembly.A.T @ x, load.f - assembly.K.multiply(x) - assembly.A @ lam
    near = np.array([answer.bound_mm for answer in proven])
    away = abs(assembly.at_junction(x - proven_x)).max(axis=0, initial=0.0)
    bounds = error_bound(away, near)
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


def error_bound(away: Any, near: Any) -> Any:
    """max|x − x*| or more, mm, of an x that is `away`, as computed, from an answer known to within `near`."""
    return SAFE * near + (1 + 4 * U) * away


@dataclass(frozen=True)
class GapError:
    """Bounds the error of gaps computed on one assembly.

    norms : (m,) ‖a_j‖₁. size : |A|ᵀ. rounding : (m,) γ_{k+2}. underflow : (m,) mm.
    """

    norms: Vector
    size: sp.csr_array
    rounding: Vector
    underflow: Vector

    @classmethod
    def of(cls, assembly: Assembly) -> "GapError":
        k = np.diff(assembly.A.indptr)
        norms = np.asarray(abs(assembly.at_junction(assembly.A)).sum(axis=0)).ravel()
        return cls(norms, abs(assembly.A).T, gamma(k + 2), (k + 2) * ETA)

    def __call__(self, g: Vector, x: Vector, error_mm: float) -> Vector:
        """E (m,) mm, the error bound of fl(g − Aᵀx), if that of the displacements asked for is error_mm."""
        if not np.isfinite(error_mm):
            return np.full(len(g), np.inf)
        rounding = self.rounding * (abs(g) + self.size @ abs(x))
        total: Vector = SAFE * (self.norms * error_mm + rounding + self.underflow)
        return total
