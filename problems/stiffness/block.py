"""One diagonal block of K, symmetric positive definite, whatever its storage and its factor."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from . import Indices, Matrix, Vector
from .selected_inverse import BlockPart

ENTRIES_AT_A_TIME = 2**15  # of a sparse block: a panel stays in the processor's cache


class NotPositiveDefinite(np.linalg.LinAlgError):
    """K has a motion that costs no energy; `unknown` is one that moves, by its number."""

    def __init__(self, unknown: int) -> None:
        super().__init__(f"the pivot of unknown {unknown} is not positive")
        self.unknown = unknown


class Block(ABC):
    """A block K_i of K, (size, size), N/mm. matrix : by columns (Fortran order), or a csc_array."""

    matrix: Any
    #: Whether it is stored as a dense matrix.
    dense = False

    @property
    def size(self) -> int:
        return int(self.matrix.shape[0])

    def multiply(self, x: Matrix) -> Matrix:
        """K x, x (size,) or (size, k)."""
        product: Matrix = self.matrix @ x
        return product

    def diagonal(self) -> Vector:
        """(size,) N/mm."""
        return np.asarray(self.matrix.diagonal())

    @property
    @abstractmethod
    def arrays(self) -> list[NDArray[Any]]:
        """The arrays that hold the block."""

    @abstractmethod
    def factor(self) -> list[NDArray[Any]]:
        """The arrays of its factor, made when first needed. Raises NotPositiveDefinite."""

    @property
    @abstractmethod
    def factor_nonzeros(self) -> int:
        """The float64 that its factor holds; an estimate before a general factor is made."""

    @abstractmethod
    def solve(self, b: Matrix) -> Matrix:
        """K⁻¹b, b (size,) or (size, k). Raises NotPositiveDefinite."""

    @abstractmethod
    def panels(self) -> Iterator[tuple[slice, Any]]:
        """Consecutive rows, as dense arrays or csr_arrays, small enough to stay in the processor's cache."""

    @abstractmethod
    def shifted(self, D: Vector, s: float) -> float | None:
        """A bound e, up to its own rounding, on the backward error of a Cholesky factorisation that runs to
        completion: LLᵀ = DKD − sI + E with ‖E‖₂ ≤ e, so that λmin(DKD) ≥ s − e. None where it breaks down.

        D (size,) : powers of two.
        """

    def largest_compliance(self, D: Vector, kappa: float) -> float:
        """A proven bound on max (K⁻¹)_ii, mm/N, for κ ≤ λmin(DKD); infinite where none is cheap."""
        return np.inf

    def local_compliance(self, A: sp.csc_array, windows: Sequence[Indices], single: bool) -> BlockPart | None:
        """AᵀK⁻¹A for contacts that share a window; None where the factor does not give them cheaply."""
        return None


class SparseBlock(Block):
    """A block stored as a csc_array; it is copied only to sort its entries and to add up repeated ones.

    A pivot ≤ lost · k_ii counts as zero: K is singular.
    """

    lost = 2.0**-50

    def __init__(self, matrix: sp.csc_array) -> None:
        if not matrix.has_canonical_format:
            matrix = matrix.copy()
            matrix.sum_duplicates()
        self.matrix = matrix

    @abstractmethod
    def solver(self, entries: Vector) -> Callable[[Matrix], Matrix]:
        """b → M⁻¹b, M with other entries (nnz,) at the same places. Raises NotPositiveDefinite."""

    @property
    def arrays(self) -> list[NDArray[Any]]:
        return [self.matrix.data, self.matrix.indices, self.matrix.indptr]

    def panels(self) -> Iterator[tuple[slice, Any]]:
        """Panels of K's columns, which are its rows."""
        K, start = self.matrix, 0
        while start < self.size:
            far = int(np.searchsorted(K.indptr, K.indptr[start] + ENTRIES_AT_A_TIME, side="right")) - 1
            stop = min(max(far, start + 1), self.size)
            entries = slice(K.indptr[start], K.indptr[stop])
            parts = K.data[entries], K.indices[entries], K.indptr[start : stop + 1] - K.indptr[start]
            yield slice(start, stop), sp.csr_array(parts, shape=(stop - start, self.size))
            start = stop


def scaled(M: sp.csc_array, rows: Vector, columns: Vector) -> sp.csc_array:
    """diag(rows) M diag(columns), without rounding for powers of two."""
    entries = M.data * rows[M.indices] * np.repeat(columns, np.diff(M.indptr))
    return sp.csc_array((entries, M.indices, M.indptr), shape=M.shape)
