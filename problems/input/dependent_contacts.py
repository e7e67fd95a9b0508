"""Whether contacts depend on one another, by the pivots of AᵀA = LLᵀ:

    l_jj² = min_z ‖a_j − Σ_{i<j} z_i a_i‖₂².

AᵀA is block diagonal, a block per group of contacts that share unknowns, and is factored as a band or a
sparse matrix. The rounding of l_jj² is some k + (entries of a_j) ulps of ‖a_j‖₂² in a group of k contacts,
times ‖z‖².
"""

from bisect import bisect_left

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems.errors import InputError
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.sparse import sparse_block

LOST = 2.0**-44  # of ‖a_j‖₂², per contact and entry: 256 ulps, for ‖z‖²


def refuse_dependent(A: sp.csc_array, where: object) -> None:
    """Raise InputError naming the first column of A (n, m), none zero, that depends on those before it."""
    if _dependent(A):
        first = bisect_left(range(A.shape[1]), True, key=lambda j: _dependent(A[:, : j + 1]))
        allowed = "must not depend on the columns before it"
        raise InputError.one(where, f"A[:, {first}]", "dependent", allowed)


def _dependent(A: sp.csc_array) -> bool:
    if A.shape[1] == 0:
        return False
    exponents = np.frexp(abs(A).max(axis=0).toarray().ravel())[1]
    scaled = A @ sp.diags_array(np.exp2(-exponents.astype(float)))  # without rounding; no square overflows
    G = sp.csc_array(scaled.T @ scaled)
    terms = np.bincount(connected_components(G, directed=False)[1]).max() + np.diff(A.indptr).max()
    block = sparse_block(G)
    block.lost = float(terms * LOST)
    try:
        block.factor()
    except NotPositiveDefinite:
        return True
    return False
