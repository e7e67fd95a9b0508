"""A proven lower bound on the smallest eigenvalue of DKD, whatever the factor of K.

It is s, less the backward error of a Cholesky factorisation of DKD − sI that runs to completion (Rump, BIT
46:433–452, 2006; see `Block.shifted`).

An eigenvalue below 2⁻¹⁰⁰⁰ counts as none: above, what underflows in the factorisation, some n²η with
η = 2⁻¹⁰⁷⁴, is within the margin's last 1 %.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.stiffness.block import Block, NotPositiveDefinite
from problems.stiffness.operator import Stiffness
from problems.stiffness.rounding import gamma

from .enclosure import SAFE

SHARES = (1.0, 0.2, 0.02)  # of the guess, tried in turn
SHARE, STEPS = 0.9, 20  # for AᵀA: of an estimate that is no smaller, by so many steps of the power method
SMALLEST = 2.0**-1000


def smallest_eigenvalue(K: Stiffness, D: Vector, guesses: Sequence[float]) -> float:
    """κ ≤ λmin(DKD), proven; 0 if no positive one was found.

    D (n,) : powers of two. guesses : of a κ for each block; the closer from below, the sharper the bound.
    """
    blocks = zip(K.blocks, K.slices, guesses, strict=True)
    return min((_of_block(block, D[rows], guess) for block, rows, guess in blocks), default=np.inf)


def independence(A: sp.csc_array) -> float:
    """A proven σ² ≤ λmin(AᵀA), how independent the contacts are; 0 if none was found.

    The entries of AᵀA are rounded by γ_c (|A|ᵀ|A|), c the longest column.
    """
    if A.shape[1] == 0:
        return np.inf
    G, size, ones = Stiffness.of(sp.csc_array(A.T @ A)), abs(A), np.ones(A.shape[1])
    try:
        found = smallest_eigenvalue(G, ones, [SHARE * about for about in G.least_eigenvalues(ones, STEPS)])
    except NotPositiveDefinite:
        return 0.0
    longest = int(np.diff(sp.csc_array(A).indptr).max())
    sigma2 = found - SAFE * gamma(longest + 1) * float((size.T @ (size @ ones)).max())
    return sigma2 if sigma2 >= SMALLEST else 0.0


def _of_block(block: Block, D: Vector, guess: float) -> float:
    for s in (share * guess for share in SHARES):
        away = block.shifted(D, s)
        if away is not None and s - SAFE * away >= SMALLEST:
            return float(s - SAFE * away)
    return 0.0
