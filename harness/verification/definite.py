"""A proven lower bound on the smallest eigenvalue of DKD: a share s of an estimate, less the backward error of a
factorisation of DKD − sI that runs to completion (Rump, BIT 46:433–452, 2006; see `Block.shifted`).

An eigenvalue below 2⁻¹⁰⁰⁰ counts as none: above, what underflows in the factorisation, some n²η with
η = 2⁻¹⁰⁷⁴, is within the margin's last 1 %.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.stiffness.block import Block, NotPositiveDefinite
from problems.stiffness.operator import Stiffness

from .enclosure import SAFE, gamma

SHARES = (0.5, 0.1, 0.01)  # of the estimate, tried in turn
SMALLEST = 2.0**-1000


def smallest_eigenvalue(K: Stiffness, D: Vector) -> float:
    """κ ≤ λmin(DKD), proven; 0 if no positive κ was found. D (n,) : powers of two."""
    blocks = zip(K.blocks, K.slices, K.least_eigenvalues(D), strict=True)
    return min((_of_block(block, D[rows], estimate) for block, rows, estimate in blocks), default=np.inf)


def independence(A: sp.csc_array) -> float:
    """A proven σ² ≤ λmin(AᵀA), how independent the contacts are; 0 if none was found.

    The entries of AᵀA are rounded by γ_c (|A|ᵀ|A|), c the longest column.
    """
    if A.shape[1] == 0:
        return np.inf
    size, ones = abs(A), np.ones(A.shape[1])
    try:
        found = smallest_eigenvalue(Stiffness.of(sp.csc_array(A.T @ A)), ones)
    except NotPositiveDefinite:
        return 0.0
    longest = int(np.diff(sp.csc_array(A).indptr).max())
    sigma2 = found - SAFE * gamma(longest + 1) * float((size.T @ (size @ ones)).max())
    return sigma2 if sigma2 >= SMALLEST else 0.0


def _of_block(block: Block, D: Vector, estimate: float) -> float:
    for share in SHARES:
        away = block.shifted(D, share * estimate)
        if away is not None and (bound := share * estimate - SAFE * away) >= SMALLEST:
            return float(bound)
    return 0.0
