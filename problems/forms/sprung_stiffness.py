"""K with springs along contacts, K + A diag(ρ) Aᵀ, ρ ≥ 0: one numbering serves any ρ."""

import numpy as np
import scipy.sparse as sp

from problems.stiffness.block import SparseBlock
from problems.stiffness.sparse_block import sparse_block

from .assembly import Matrix, Vector


class SprungStiffness:
    """K (n, n), one sparse matrix, and A (n, m). nodes : (n, 2) of the unknowns, if known."""

    def __init__(self, K: sp.csc_array, A: sp.csc_array, nodes: Matrix | None) -> None:
        self.K, self.A = K, A
        pattern = abs(K) + abs(A) @ abs(A).T  # K + AAᵀ may have zeros where other springs leave none
        self.numbering = sparse_block(sp.csc_array(pattern), nodes)

    def block(self, rho: Vector) -> SparseBlock:
        """K + A diag(ρ) Aᵀ, ρ (m,)."""
        sprung = np.flatnonzero(rho)
        A = self.A[:, sprung]
        return self.numbering.replaced(sp.csc_array(self.K + (A * rho[sprung]) @ A.T))
