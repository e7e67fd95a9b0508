"""K with springs along contacts, K + A diag(ρ) Aᵀ, ρ ≥ 0: one numbering serves any ρ.

Its entries are linear in ρ. With e the entries of K at the places of K + AAᵀ, those of the sum are e + Gρ,
where column j of G holds the entries of a_j a_jᵀ.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from problems.stiffness.sparse_block import sparse_block

from .assembly import Matrix, Vector


class SprungStiffness:
    """K (n, n), one sparse matrix, and A (n, m). nodes : (n, 2) of the unknowns, if known."""

    def __init__(self, K: sp.csc_array, A: sp.csc_array, nodes: Matrix | None) -> None:
        self.A, n = A, K.shape[0]
        pattern = sp.csc_array(
            abs(K) + abs(A) @ abs(A).T
        )  # K + AAᵀ may have zeros where other springs leave none
        pattern.sort_indices()
        self.numbering = sparse_block(pattern, nodes)
        columns = np.repeat(np.arange(n), np.diff(pattern.indptr))
        places = columns * n + pattern.indices
        K = sp.coo_array(K)
        self.entries = np.zeros(pattern.nnz)
        self.entries[np.searchsorted(places, K.col.astype(np.int64) * n + K.row)] = K.data
        A = sp.csc_array(A)
        counts = np.diff(A.indptr)
        entry = np.repeat(np.arange(A.nnz), np.repeat(counts, counts))  # each entry with all of its column
        contact = np.repeat(np.arange(A.shape[1]), counts**2)
        other = np.arange(len(entry)) - np.repeat(np.cumsum(counts**2) - counts**2, counts**2)
        other = A.indptr[contact] + other % counts[contact]
        place = np.searchsorted(places, A.indices[entry].astype(np.int64) * n + A.indices[other])
        products = A.data[entry] * A.data[other]
        self.G = sp.csr_array((products, (place, contact)), shape=(pattern.nnz, A.shape[1]))

    def factor(self, rho: Vector) -> Callable[[Matrix], Matrix]:
        """b → (K + A diag(ρ) Aᵀ)⁻¹b, b (n,) or (n, k), for ρ (m,)."""
        return self.numbering.solver(self.entries + self.G @ rho)
