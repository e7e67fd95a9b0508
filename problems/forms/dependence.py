"""Whether contacts depend on one another: whether a column of A is a combination of others.

The unknowns are in the units D of K, in which all weigh alike, so A stands for DA here. The pivots of
AᵀA = LLᵀ tell: l_jj² = min_z ‖a_j − Σ_{i<j} z_i a_i‖₂². AᵀA is block diagonal, a block per
group of contacts that share unknowns, and is factored as a band or a sparse matrix. The rounding of l_jj² is
some k + (entries of a_j) ulps of ‖a_j‖₂² in a group of k contacts, times ‖z‖².
"""

from bisect import bisect_left
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from problems.errors import InputError
from problems.stiffness import Vector
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.sparse_block import sparse_block

LOST = 2.0**-44  # of ‖a_j‖₂², per contact and entry: 256 ulps, for ‖z‖²
SHOWN = 5  # columns named in a message
SLIGHT = 1e-6  # of the largest: a coefficient that is rounding


def refuse_dependent(
    A: sp.csc_array, D: Vector, where: object, name: Callable[[int], str] = "A[:, {}]".format
) -> None:
    """Raise InputError naming the first column of A (n, m), none zero, that depends on earlier columns.

    D (n,) : the units of the unknowns in which K is balanced.
    """
    if not is_dependent(A, D):
        return
    first = bisect_left(range(A.shape[1]), True, key=lambda j: is_dependent(A[:, : j + 1], D))
    scaled = _scaled(A, D)
    before = scaled[:, :first]
    z = abs(spsolve(sp.csc_array(before.T @ before), (before.T @ scaled[:, [first]]).toarray().ravel()))
    others = np.flatnonzero(z > z.max() * SLIGHT).tolist()
    names = ", ".join(map(name, others[:SHOWN]))
    more = f" and {len(others) - SHOWN} more" if len(others) > SHOWN else ""
    allowed = "must not depend on the columns before it, as Q is then singular: the sparse form takes it"
    raise InputError.one(where, name(first), f"dependent on {names}{more}", allowed)


def is_dependent(A: sp.csc_array, D: Vector) -> bool:
    """Whether a column of DA, A (n, m), none zero, D (n,), is a combination of others, but for rounding."""
    if A.shape[1] == 0:
        return False
    scaled = _scaled(A, D)
    G = sp.csc_array(scaled.T @ scaled)
    terms = np.bincount(connected_components(G, directed=False)[1]).max() + np.diff(A.indptr).max()
    block = sparse_block(G)
    block.lost = float(terms * LOST)
    try:
        block.factor()
    except NotPositiveDefinite:
        return True
    return False


def _scaled(A: sp.csc_array, D: Vector) -> sp.csc_array:
    """DA with columns of similar sizes, for powers of two D without rounding, so that no square overflows."""
    return _unit_columns(sp.csc_array(sp.diags_array(D) @ _unit_columns(A)))


def _unit_columns(A: sp.csc_array) -> sp.csc_array:
    exponents = np.frexp(abs(A).max(axis=0).toarray().ravel())[1]
    return sp.csc_array(A @ sp.diags_array(np.exp2(-exponents.astype(float))))
