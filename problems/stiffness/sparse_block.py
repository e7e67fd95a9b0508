"""A sparse block: a band if some numbering gives a narrow one, else a factor with little fill, by CHOLMOD
where the extra `cholmod` is installed, or by SuperLU.

Three numberings are tried: the given one, the one along the longer side of the model, and Cuthill and
McKee's, until a band is as narrow as on a square grid; else the narrowest is taken, if it is worth it.
"""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from . import Indices, Matrix, U, Vector
from .band_factor import half_bandwidth
from .banded_block import BandedBlock
from .block import NotPositiveDefinite, SparseBlock, scaled
from .superlu import SuperLU, moving_unknown

if TYPE_CHECKING:
    from .cholmod import Cholmod

BAND_TO_ROW = 50  # a band at most this many times longer than K's mean row is worth it
OF_GRID = 4.0  # times √N: a square grid of four unknowns a node, line by line, has a half-bandwidth of 2√N
WITH_INDICES = 1.5  # numbers of eight bytes per entry of a sparse matrix


def sparse_block(K: sp.csc_array, nodes: Matrix | None = None) -> SparseBlock:
    """K (N, N) with its kind of factor, not made yet. nodes : (N, 2) of the unknowns, if known."""
    size = max(K.shape[0], 1)
    widest, best = BAND_TO_ROW * K.nnz / size, None
    least, narrow = half_bandwidth(K), min(widest, OF_GRID * size**0.5)
    for order in _orders(K, nodes):
        if least < narrow:
            break
        width = half_bandwidth(sp.csc_array(K[order][:, order]))
        if width < least:
            least, best = width, order
    return BandedBlock(K, least, best) if least < widest else GeneralBlock(K, least)


def _orders(K: sp.csc_array, nodes: Matrix | None) -> Iterator[Indices]:
    if nodes is not None:
        longer, shorter = np.argsort(-np.ptp(nodes, axis=0))
        body = connected_components(K, directed=False)[1]
        yield np.lexsort((nodes[:, shorter], nodes[:, longer], body))
    yield reverse_cuthill_mckee(sp.csr_matrix(K), symmetric_mode=True)


def general_factor(K: sp.csc_array, lost: float) -> "SuperLU | Cholmod":
    """Factor K by the best library installed. A pivot ≤ lost · k_ii counts as zero: K is singular."""
    try:
        from .cholmod import Cholmod  # of an extra
    except ImportError:
        return SuperLU(K, lost)
    return Cholmod(K, lost)


class GeneralBlock(SparseBlock):
    """A block without a narrow band. width : the least half-bandwidth of the numberings tried."""

    make_factor = staticmethod(general_factor)

    def __init__(self, matrix: sp.csc_array, width: int) -> None:
        super().__init__(matrix)
        self.width = width
        self.general_factor: SuperLU | Cholmod | None = None

    def solver(self, entries: Vector) -> Callable[[Matrix], Matrix]:
        K = self.matrix
        matrix = sp.csc_array((entries, K.indices.copy(), K.indptr.copy()), shape=K.shape)
        matrix.eliminate_zeros()
        other = type(self)(matrix, self.width)
        other.factor()
        return other.solve

    def factor(self) -> list[NDArray[Any]]:
        self._ensured_factor()
        return []  # libraries keep their own

    def _ensured_factor(self) -> "SuperLU | Cholmod":
        if self.general_factor is None:
            try:
                self.general_factor = self.make_factor(self.matrix, self.lost)
            except np.linalg.LinAlgError as error:
                raise NotPositiveDefinite(moving_unknown(self.matrix, self.lost)) from error
        return self.general_factor

    @property
    def factor_nonzeros(self) -> int:
        """As many as the library says, else an estimate of L and U with their indices: nested dissection of a
        square grid with half-bandwidth b leaves about b² log₂ N entries for each body (George, SIAM J. Numer.
        Anal. 10:345–363, 1973).
        """
        if self.general_factor is not None and self.general_factor.nonzeros is not None:
            return self.general_factor.nonzeros
        bodies = connected_components(self.matrix, directed=False)[0]
        dissected = bodies * self.width**2 * np.log2(self.size / bodies)
        return int(WITH_INDICES * 2 * min(self.size * self.width, dissected))

    def solve(self, b: Matrix) -> Matrix:
        return self._ensured_factor().solve(b)

    def shifted(self, D: Vector, s: float) -> float | None:
        shifted = sp.csc_array(scaled(self.matrix, D, D) - s * sp.eye_array(self.size))
        largest = float(abs(shifted.diagonal()).max())
        try:
            error = self.make_factor(shifted, self.lost).backward_error()
        except np.linalg.LinAlgError:
            return None
        return None if error is None else error + U * (largest + abs(s))
