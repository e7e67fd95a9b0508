"""K = LDLᵀ by SuperLU, without pivoting; and which unknown moves where there is no such factor."""

from contextlib import suppress
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from . import Matrix, gamma
from . import U as ROUNDING

SOFT = 2.0**-30  # of an unknown's stiffness: springs that hold a mechanism


class SuperLU:
    """K (N, N). A pivot ≤ lost · k_ii counts as zero: K is singular.

    Raises LinAlgError if K is not positive definite.
    """

    def __init__(self, K: sp.csc_array, lost: float) -> None:
        try:
            self.lu = _factored(K)
        except RuntimeError as error:  # exactly singular
            raise np.linalg.LinAlgError(str(error)) from error
        if _wrong(self.lu, K, lost).any():
            raise np.linalg.LinAlgError("a pivot is not positive")

    def solve(self, b: Matrix) -> Matrix:
        """K⁻¹b, b (N,) or (N, k)."""
        x: Matrix = self.lu.solve(np.asarray(b, dtype=float))
        return x

    @property
    def nonzeros(self) -> int:
        """The float64 that L and U hold."""
        return int(self.lu.nnz)  # its L and U would be copies, which it then keeps

    def backward_error(self) -> float | None:
        """A bound on ‖E‖₂, up to its rounding, of an E with K + E positive definite; None if there is none.

        After a symmetric permutation the computed factors satisfy |K − LU| ≤ γ_{c+1} |L||U|, entry by entry
        and whatever the order of the sums; none has more terms than c, the number of entries in the longest
        column of U (Higham 2002, theorem 9.3; γ_{2(c+2)} is used, for multiplications by the reciprocal of a
        pivot). With P = diag(U) > 0 and F = U − PLᵀ, zero but for rounding,

            K = LPLᵀ + (K − LU) + LF,        λmin(K) ≥ −γ ‖|L||U|‖₂ − ‖|L||F|‖₂,

        as LPLᵀ is positive definite. Both norms are at most √(‖·‖₁‖·‖_∞), by products with a vector of ones.
        """
        L, U = self.lu.L, self.lu.U
        pivots = U.diagonal()
        if not ((pivots > 0).all() and np.isfinite(U.data).all() and np.isfinite(L.data).all()):
            return None
        longest = int(np.diff(U.indptr).max())
        product = sp.csc_array((L @ sp.diags_array(pivots)).T)
        F = abs(U - product) + ROUNDING * abs(product)
        for M in (L, U):
            np.abs(M.data, out=M.data)
        return gamma(2 * (longest + 2)) * _norm(L, U) + _norm(L, F)


def moving_unknown(K: sp.csc_array, lost: float) -> int:
    """The unknown to name when K has no factor: the first with a pivot ≤ 0, else the one that moves most on
    weak springs, each unknown in its own unit.
    """
    with suppress(RuntimeError):  # exactly singular
        lu = _factored(K)
        wrong = np.flatnonzero(_wrong(lu, K, lost))
        if wrong.size:
            return int(np.argsort(lu.perm_c)[wrong[0]])
    size = abs(K).max(axis=1).toarray().ravel()
    size = np.where(size > 0, size, size.max(initial=0.0) or 1.0)
    held = sp.csc_array(K + SOFT * sp.diags_array(size))
    force = np.sqrt(size) * np.random.default_rng(0).standard_normal(len(size))
    return int(np.argmax(abs(splu(held).solve(force)) * np.sqrt(size)))


def _factored(K: sp.csc_array) -> Any:
    options = {"SymmetricMode": True}
    return splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def _wrong(lu: Any, K: sp.csc_array, lost: float) -> Any:
    """Marks the pivots that count as zero or are negative. Where a diagonal entry is zero, SuperLU takes
    another row, whose entry may be positive.
    """
    order = np.argsort(lu.perm_c)
    exchanged = np.argsort(lu.perm_r) != order
    return ~(lu.U.diagonal() > lost * abs(K.diagonal()[order])) | exchanged


def _norm(P: Any, R: Any) -> float:
    """An upper bound on ‖PR‖₂ for P, R ≥ 0, up to a relative rounding."""
    ones = np.ones(P.shape[0])
    return float(np.sqrt((P @ (R @ ones)).max() * (R.T @ (P.T @ ones)).max()))
