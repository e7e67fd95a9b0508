"""How far a computed gap may be from the exact one.

The gap of contact j is y_j = g_j − a_jᵀx*. It is computed as ŷ = fl(g − Aᵀx) from an x with max|x − x*| ≤ e.
If a_j has k entries, a term of a_jᵀx takes part in at most k + 1 roundings: its product, k − 1 additions and
the subtraction from g_j, u = 2⁻⁵³ each; a product that underflows is off by less than η = 2⁻¹⁰⁷⁴. So (Higham,
Accuracy and Stability of Numerical Algorithms, 2002, section 3.1), with γ_k = ku/(1 − ku),

    |ŷ_j − y_j| ≤ ‖a_j‖₁ e + γ_{k+1} (|g_j| + |a_j|ᵀ|x|) + kη.

The error E_j returned is above that: with γ_{k+2}, whose further rounding is that of ŷ_j ± E_j in a
comparison with a limit, |fl(ŷ ± E) − (ŷ ± E)| ≤ u(|ŷ| + E), and a factor for the rounding of E itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, Vector
from problems.stiffness.rounding import SAFE, gamma

from .enclosure import ETA


@dataclass(frozen=True)
class GapError:
    """Of an assembly. norms : (m,) ‖a_j‖₁. size : |A|ᵀ. rounding : (m,) γ_{k+2}. underflow : (m,)."""

    norms: Vector
    size: sp.csr_array
    rounding: Vector
    underflow: Vector

    @classmethod
    def of(cls, assembly: Assembly) -> GapError:
        k = np.diff(assembly.A.indptr)
        norms = np.asarray(abs(assembly.asked_contacts).sum(axis=0)).ravel()
        return cls(norms, abs(assembly.A).T, gamma(k + 2), (k + 2) * ETA)

    def __call__(self, g: Vector, x: Vector, error_mm: float) -> Vector:
        """E (m,) mm, of fl(g − Aᵀx); error_mm : bound on the error of what is asked for of x (n,)."""
        if not np.isfinite(error_mm):
            return np.full(len(g), np.inf)
        rounding = self.rounding * (abs(g) + self.size @ abs(x))
        found: Vector = SAFE * (self.norms * error_mm + rounding + self.underflow)
        return found
