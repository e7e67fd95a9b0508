"""K with springs along contacts, K + A diag(ρ) Aᵀ, ρ ≥ 0: one numbering serves any ρ.

Its entries are linear in ρ. With e the entries of K at the places of K + AAᵀ, those of the sum are e + Gρ,
where column j of G holds the entries of a_j a_jᵀ.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.stiffness.banded_block import BandedBlock
from problems.stiffness.block import SparseBlock
from problems.stiffness.sparse_block import sparse_block

from .assembly import Indices, Matrix, Vector


@dataclass(frozen=True)
class Numbered:
    """A block of the unknowns in an order."""

    block: SparseBlock
    order: Indices

    def solve(self, b: Matrix) -> Matrix:
        """Its inverse times b, (n,) or (n, k)."""
        x = np.empty_like(b)
        x[self.order] = self.block.solve(b[self.order])
        return x


class SprungStiffness:
    """K (n, n), one sparse matrix, and A (n, m). nodes : (n, 2) of the unknowns, if known."""

    def __init__(self, K: sp.csc_array, A: sp.csc_array, nodes: Matrix | None) -> None:
        self.A = A
        pattern = abs(K) + abs(A) @ abs(A).T  # K + AAᵀ may have zeros where other springs leave none
        block, n = sparse_block(sp.csc_array(pattern), nodes), K.shape[0]
        self.order = np.arange(n)
        if isinstance(block, BandedBlock) and block.order is not None:
            self.order = block.order
            pattern, K, A = (M[self.order] for M in (pattern, K, A))
            pattern, K = pattern[:, self.order], K[:, self.order]
            block = BandedBlock(sp.csc_array(pattern), block.width)
        self.pattern = sp.csc_array(pattern)
        self.pattern.sort_indices()
        self.numbering = block.replaced(self.pattern)
        columns = np.repeat(np.arange(n), np.diff(self.pattern.indptr))
        places = columns * n + self.pattern.indices
        K = sp.coo_array(K)
        self.entries = np.zeros(self.pattern.nnz)
        self.entries[np.searchsorted(places, K.col.astype(np.int64) * n + K.row)] = K.data
        A = sp.csc_array(A)
        counts = np.diff(A.indptr)
        own = np.repeat(np.arange(A.nnz), np.repeat(counts, counts))  # each entry with all of its column
        contact = np.repeat(np.arange(A.shape[1]), counts**2)
        other = np.arange(len(own)) - np.repeat(np.cumsum(counts**2) - counts**2, counts**2)
        other = A.indptr[contact] + other % counts[contact]
        place = np.searchsorted(places, A.indices[own].astype(np.int64) * n + A.indices[other])
        products = A.data[own] * A.data[other]
        self.G = sp.csr_array((products, (place, contact)), shape=(self.pattern.nnz, A.shape[1]))

    def block(self, rho: Vector) -> Numbered:
        """K + A diag(ρ) Aᵀ, ρ (m,)."""
        pattern = self.pattern
        entries = self.entries + self.G @ rho, pattern.indices.copy(), pattern.indptr.copy()
        sprung = sp.csc_array(entries, shape=pattern.shape)
        sprung.eliminate_zeros()
        return Numbered(self.numbering.replaced(sprung), self.order)
