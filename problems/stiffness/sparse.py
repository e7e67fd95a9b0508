"""Which factor a sparse K has: a band if some numbering gives a narrow one, else a general one.

Tried are the numbering as it is, the one along the longer side of the model, and Cuthill and McKee's; the
first that is narrow enough is taken.
"""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from .arrays import Indices, Matrix
from .banded import BandedBlock, half_bandwidth
from .block import SparseBlock
from .general import GeneralBlock

BAND_TO_ROW = 50  # a band at most this many times longer than K's mean row is worth it


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
