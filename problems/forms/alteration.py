"""How far the numbers that were read may be from the numbers that were given.

Reading a user's matrices may round (integers beyond 2⁵³, extended precision) or symmetrise K. The given
problem is one with K + ΔK, A + ΔA, f + Δf, g + Δg within these bounds; the residuals of its conditions are

    r + Δf − ΔK x − ΔA λ   (n,) N,        s + Δg − ΔAᵀx   (m,) mm,

with r and s those of what was read.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALTERED = "Reading has rounded some of the numbers, or symmetrised K: every bound counts it"


@dataclass(frozen=True)
class Alteration:
    """Entrywise bounds, all ≥ 0.

    K (n,) : Σ_j |ΔK_ij| and no less than Σ_j |ΔK_ji|, N/mm. f (n,) : |Δf|, N. g (m,) : |Δg|, mm.
    A_rows (n,), A_columns (m,) : Σ_j |ΔA_ij| and Σ_i |ΔA_ij|.
    """

    K: Array
    A_rows: Array
    A_columns: Array
    f: Array
    g: Array

    def __bool__(self) -> bool:
        return any(getattr(self, field.name).any() for field in fields(self))

    @property
    def norm_K(self) -> float:
        """Upper bound on ‖ΔK‖₂ ≤ √(‖ΔK‖₁‖ΔK‖_∞), N/mm."""
        return float(self.K.max(initial=0.0))

    @property
    def norm_A(self) -> float:
        """Upper bound on ‖ΔA‖₂ ≤ √(‖ΔA‖₁‖ΔA‖_∞)."""
        return float(max(self.A_rows.max(initial=0.0), self.A_columns.max(initial=0.0)))

    def of_forces(self, x: Array, lam: Array) -> Array:
        """Upper bound on |Δf − ΔK x − ΔA λ| for |x| and |λ|, (n,) and (m,), or a column per load case."""
        x_size, lam_size = x.max(axis=0, initial=0.0), lam.max(axis=0, initial=0.0)
        outer = np.multiply.outer
        return outer(self.f, np.ones_like(x_size)) + outer(self.K, x_size) + outer(self.A_rows, lam_size)

    def of_gaps(self, x: Array) -> Array:
        """Upper bound on |Δg − ΔAᵀx| for |x|, (n,) or a column per load case."""
        x_size = x.max(axis=0, initial=0.0)
        return np.multiply.outer(self.g, np.ones_like(x_size)) + np.multiply.outer(self.A_columns, x_size)
