"""A sparse block: a band if some numbering gives a narrow one, else K = LDLᵀ by SuperLU, without pivoting.

Tried are the numbering as it is, the one along the longer side of the model, and Cuthill and McKee's; the
first that is narrow enough is taken.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from . import Indices, Matrix, Vector, gamma
from . import U as ROUNDING
from .band import half_bandwidth
from .banded import BandedBlock
from .block import NotPositiveDefinite, SparseBlock, scaled

BAND_TO_ROW = 50  # a band at most this many times longer than K's mean row is worth it
WITH_INDICES = 1.5  # numbers of eight bytes per entry of a sparse matrix
SOFT = 2.0**-30  # of an unknown's stiffness: springs that hold a mechanism
AT_A_TIME = 64  # columns of K⁻¹A


def sparse_block(K: sp.csc_array, nodes: Matrix | None = None) -> SparseBlock:
    """K (N, N) with its kind of factor, not made yet. nodes : (N, 2) of the unknowns, if known."""
    widest = BAND_TO_ROW * K.nnz / max(K.shape[0], 1)
    least = half_bandwidth(K)
    if least < widest:
        return BandedBlock(K, least)
    for order in _orders(K, nodes):
        width = half_bandwidth(sp.csc_array(K[order][:, order]))
        if width < widest:
            return BandedBlock(K, width, order)
        least = min(least, width)
    return GeneralBlock(K, least)


def _orders(K: sp.csc_array, nodes: Matrix | None) -> Iterator[Indices]:
    if nodes is not None:
        longer, shorter = np.argsort(-np.ptp(nodes, axis=0))
        body = connected_components(K, directed=False)[1]
        yield np.lexsort((nodes[:, shorter], nodes[:, longer], body))
    yield reverse_cuthill_mckee(sp.csr_matrix(K), symmetric_mode=True)


class GeneralBlock(SparseBlock):
    """width : the least half-bandwidth that was found."""

    def __init__(self, matrix: sp.csc_array, width: int) -> None:
        super().__init__(matrix)
        self.width = width

    def replaced(self, matrix: sp.csc_array) -> Self:
        return type(self)(matrix, self.width)

    @cached_property
    def lu(self) -> Any:
        return _factored(self.matrix, self.lost)

    def factor(self) -> list[NDArray[Any]]:
        _ = self.lu
        return []  # SuperLU keeps its own

    @property
    def numbers(self) -> int:
        """Without a narrow band L has about b² log₂ N entries, as in nested dissection of a square grid with
        that half-bandwidth, for each body (George, SIAM J. Numer. Anal. 10:345–363, 1973). L and U are kept,
        and their indices.
        """
        if "lu" in vars(self):
            return int(self.lu.L.nnz + self.lu.U.nnz)
        bodies = connected_components(self.matrix, directed=False)[0]
        dissected = bodies * self.width**2 * np.log2(self.size / bodies)
        return int(WITH_INDICES * 2 * min(self.size * self.width, dissected))

    def solve(self, b: Matrix) -> Matrix:
        x: Matrix = self.lu.solve(np.asarray(b, dtype=float))
        return x

    def shifted(self, D: Vector, s: float) -> float | None:
        """With B = fl(DKD − sI) after a symmetric permutation, the computed factors satisfy |B − LU| ≤
        γ_{c+1} |L||U|, entry by entry and whatever the order of the sums; none has more terms than c, the
        number of entries in the longest column of U (Higham 2002, theorem 9.3; γ_{2(c+2)} is used, for
        multiplications by the reciprocal of a pivot). With P = diag(U) > 0 and F = U − PLᵀ, zero but for
        rounding,

            B = LPLᵀ + (B − LU) + LF,        λmin(B) ≥ −γ ‖|L||U|‖₂ − ‖|L||F|‖₂,

        as LPLᵀ is positive definite. Both norms are at most √(‖·‖₁‖·‖_∞), by products with a vector of ones.
        """
        shifted = sp.csc_array(scaled(self.matrix, D, D) - s * sp.eye_array(self.size))
        largest = float(abs(shifted.diagonal()).max())
        try:
            lu = _factored(shifted, self.lost)
        except NotPositiveDefinite:
            return None
        L, U = lu.L, lu.U
        pivots = U.diagonal()
        if not ((pivots > 0).all() and np.isfinite(U.data).all() and np.isfinite(L.data).all()):
            return None
        longest = int(np.diff(U.indptr).max())
        product = sp.csc_array((L @ sp.diags_array(pivots)).T)
        F = abs(U - product) + ROUNDING * abs(product)
        for M in (L, U):
            np.abs(M.data, out=M.data)
        return gamma(2 * (longest + 2)) * _norm(L, U) + _norm(L, F) + ROUNDING * (largest + abs(s))

    def compliance(self, A: sp.csc_array) -> Matrix:
        Q = np.empty(A.shape[1:] * 2)
        for start in range(0, A.shape[1], AT_A_TIME):
            some = slice(start, start + AT_A_TIME)
            Q[:, some] = A.T @ self.solve(A[:, some].toarray())
        return (Q + Q.T) / 2


def _factored(K: sp.csc_array, lost: float) -> Any:
    options = {"SymmetricMode": True}
    try:
        lu = splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:  # exactly singular
        raise NotPositiveDefinite(_moving_unknown(K)) from error
    order = np.argsort(lu.perm_c)
    # Where a pivot on the diagonal is zero, SuperLU takes another row, whose entry may be positive.
    exchanged = np.argsort(lu.perm_r) != order
    wrong = np.flatnonzero(~(lu.U.diagonal() > lost * abs(K.diagonal()[order])) | exchanged)
    if wrong.size:
        raise NotPositiveDefinite(int(order[wrong[0]]))
    return lu


def _moving_unknown(K: sp.csc_array) -> int:
    """Where K is singular, the unknown that moves most, each in its own unit, if nothing else holds it."""
    size = abs(K).max(axis=1).toarray().ravel()
    size = np.where(size > 0, size, size.max(initial=0.0) or 1.0)
    held = sp.csc_array(K + SOFT * sp.diags_array(size))
    force = np.sqrt(size) * np.random.default_rng(0).standard_normal(len(size))
    return int(np.argmax(abs(splu(held).solve(force)) * np.sqrt(size)))


def _norm(P: Any, R: Any) -> float:
    """‖PR‖₂ or more, for P, R ≥ 0, but for a relative rounding."""
    ones = np.ones(P.shape[0])
    return float(np.sqrt((P @ (R @ ones)).max() * (R.T @ (P.T @ ones)).max()))
