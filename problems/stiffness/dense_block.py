"""A dense block: K = UᵀU by LAPACK; and the dense blocks of a sparse K."""

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import blas, lapack
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, eigsh

from . import SAFE, Matrix, Vector, gamma
from . import U as ROUNDING
from .block import ENTRIES_AT_A_TIME, Block, NotPositiveDefinite

DENSE_BLOCK = 512  # unknowns: smaller bodies are put together into one dense block
SMALL = 50  # unknowns below which eigenvalues are computed densely
LEAST_ROWS = 64  # of a panel: fewer make slow products
NORM_STEPS = 5  # of the power method, for v
PANEL = 256  # columns
#: Above this fraction of nonzero entries, a product with the whole matrix beats one with copied columns.
SPARSE_LIMIT = 1 / 8


class DenseBlock(Block):
    """matrix : (size, size) by columns, perhaps memory-mapped."""

    dense = True

    def __init__(self, matrix: Matrix) -> None:
        self.matrix = matrix

    @cached_property
    def U(self) -> Matrix:
        """Upper triangular with K = UᵀU; may be set, from a cache. Raises NotPositiveDefinite."""
        return cholesky(self.matrix)

    @property
    def arrays(self) -> list[NDArray[Any]]:
        return [self.matrix]

    def factor(self) -> list[NDArray[Any]]:
        return [self.U]

    @property
    def factor_nonzeros(self) -> int:
        return self.size**2

    def multiply(self, x: Matrix) -> Matrix:
        return product(self.matrix, x)

    def solve(self, b: Matrix) -> Matrix:
        """K⁻¹b; a single column without LAPACK's blocked solution, which takes twice the time."""
        if b.size > self.size:
            return sla.cho_solve((self.U, False), b, check_finite=False)
        return blas.dtrsv(self.U, blas.dtrsv(self.U, b.ravel(), trans=1)).reshape(b.shape)

    def panels(self) -> Iterator[tuple[slice, Any]]:
        height = max(ENTRIES_AT_A_TIME // self.size, LEAST_ROWS)
        for start in range(0, self.size, height):
            rows = slice(start, min(start + height, self.size))
            yield rows, self.matrix.T[rows]  # K is symmetric and stored by columns: these are contiguous

    def shifted(self, D: Vector, s: float) -> float | None:
        """The computed factor R of B = fl(DKD − sI) satisfies |RᵀR − B| ≤ γ_{n+1} |R|ᵀ|R|, entry by entry and
        whatever the order of its sums (Higham, Accuracy and Stability of Numerical Algorithms, 2002, theorem
        10.3), and B is off by u max(B_ii); computing the difference s − e loses up to us more. A blocked
        factorisation may multiply by the reciprocal of a pivot where the theorem divides, one more rounding:
        γ_{2(n+1)} is used instead. ‖|R|ᵀ|R|‖₂ is at most max (|R|ᵀ|R|v)_i/v_i for any v > 0 (Collatz and
        Wielandt): about 3 λmax for plates, a thousandth of the trace at n = 24080.
        """
        B = np.array(self.matrix, order="F")
        if (D != 1).any():
            B *= D
            B *= D[:, None]
        diagonal = B.diagonal() - s
        B[np.diag_indices_from(B)] = diagonal
        R, info = lapack.dpotrf(B, overwrite_a=True, clean=False)
        if info:
            return None
        largest = float(abs(diagonal).max())
        return gamma(2 * (self.size + 1)) * _norm(R) + ROUNDING * (largest + abs(s))

    def largest_compliance(self, D: Vector, kappa: float) -> float:
        """The factor has UᵀU = K + E with |E| ≤ γ|U|ᵀ|U| (see `shifted`), so that ‖DED‖₂ ≤ e with
        e = γ/(1 − γ) tr(DKD), and

            K⁻¹ ⪯ (1 + e/κ) (UᵀU)⁻¹,    ((UᵀU)⁻¹)_ii = ‖row i of U⁻¹‖².

        The computed inverse X has |XU − I| ≤ γ|X||U| or |UX − I| ≤ γ|U||X| (Higham, Accuracy and Stability of
        Numerical Algorithms, 2002, 14.2), so that ‖X − U⁻¹‖_F ≤ ε ‖U⁻¹‖_F with ε = γ ‖X‖_F ‖U‖_F.
        """
        X, info = lapack.dtrtri(self.U)
        error = gamma(2 * (self.size + 1))
        relative = SAFE * error / (1 - error) * float(D**2 @ self.diagonal()) / kappa if kappa > 0 else np.inf
        length, size = (float(np.linalg.norm(np.triu(each))) for each in (X, self.U))
        epsilon = SAFE * gamma(3 * self.size) * length * size
        if info or not np.isfinite(relative) or not epsilon < 0.5:
            return np.inf
        row = float(np.sqrt((np.triu(X) ** 2).sum(axis=1).max())) + epsilon / (1 - epsilon) * length
        return SAFE * (1 + relative) * row**2

    def compliance(self, A: sp.csc_array) -> Matrix:
        inverse, info = lapack.dpotri(self.U)
        if info != 0:
            raise np.linalg.LinAlgError(f"dpotri returned {info}")
        inverse = mirrored(inverse.T)
        Q = np.empty((A.shape[1],) * 2, order="F")
        for columns in panels(len(Q)):
            Q[:, columns] = A.T @ (A[:, columns].T @ inverse).T
        return Q

    def extreme_eigenvalues(self) -> tuple[float, float]:
        """λmin and λmax to six digits, by Lanczos on K⁻¹ and K (densely if K is small)."""
        K, n = self.matrix, self.size
        if n < SMALL:
            values = np.linalg.eigvalsh(K)
            return float(values[0]), float(values[-1])

        v0 = np.random.default_rng(0).standard_normal(n)
        operators = (LinearOperator((n, n), each, dtype=float) for each in (self.multiply, self.solve))
        largest, smallest_inverse = (
            eigsh(op, 1, which="LA", v0=v0, tol=1e-4, return_eigenvectors=False)[0] for op in operators
        )
        return float(1 / smallest_inverse), float(largest)


def product(G: Matrix, v: Matrix) -> Matrix:
    """G v for G symmetric, column-major, v (m,) or (m, k). A single column reads one triangle of G, or only
    the columns of G where v is nonzero.

    Only SciPy's BLAS is called: NumPy's has its own thread pool, and each pool spins while the other works.
    """
    if v.ndim == 2 and v.shape[1] != 1:
        return blas.dgemm(1.0, G, v)
    one = v.ravel()
    support = np.flatnonzero(one)
    if support.size > SPARSE_LIMIT * len(one):
        result = blas.dsymv(1.0, G, one, lower=1)  # faster than the upper triangle
    else:
        result = blas.dgemv(1.0, G.T[support].T, one[support]) if support.size else np.zeros(len(one))
    return result.reshape(v.shape)


def dense_blocks(K: sp.csr_array) -> list[Matrix]:
    """The diagonal blocks of a sparse K, by columns."""
    return [K[rows, rows].toarray(order="F") for rows in dense_slices(K)]


def dense_slices(K: sp.csr_array) -> list[slice]:
    """The unknowns of each dense block of a sparse K: its unconnected bodies; neighbours share a block that
    has no more unknowns than the largest body, or `DENSE_BLOCK`. One block where bodies are interleaved.
    """
    count, label = connected_components(K, directed=False)
    starts = np.flatnonzero(np.diff(label, prepend=-1))
    if len(starts) != count:
        starts = starts[:1]
    ends = np.append(starts[1:], K.shape[0])
    most = max(int((ends - starts).max()), DENSE_BLOCK)
    slices, begin = [], 0
    for end, following in pairwise([*ends.tolist(), K.shape[0] + most + 1]):
        if following - begin > most:
            slices.append(slice(begin, end))
            begin = end
    return slices


def panels(count: int) -> Iterator[slice]:
    """Groups of consecutive columns, so few that no copy of them is as large as the matrix."""
    return (slice(first, min(first + PANEL, count)) for first in range(0, count, PANEL))


def mirrored(M: Matrix) -> Matrix:
    """M (n, n) itself, its lower triangle copied to the upper one."""
    for columns in panels(len(M)):
        after = slice(columns.stop, None)
        square = np.tril(M[columns, columns])
        M[columns, columns] = square + np.tril(square, -1).T
        M[columns, after] = M[after, columns].T
    return M


def cholesky(K: Matrix) -> Matrix:
    """U, upper triangular, with K = UᵀU. Raises NotPositiveDefinite."""
    U, info = lapack.dpotrf(K)
    if info:
        raise NotPositiveDefinite(int(info) - 1)
    return U


def _norm(R: Matrix) -> float:
    """Upper bound on ‖|R|ᵀ|R|‖₂, up to a relative rounding of 2nu; overwrites R, in the upper triangle."""
    np.abs(R, out=R)
    v, least = np.ones(len(R)), np.inf
    for _ in range(NORM_STEPS):
        w = blas.dtrmv(R, blas.dtrmv(R, v), trans=1)
        least = min(least, float((w / v).max()))
        v = w / w.max()
    return least
