"""How independent the contacts are: a proven lower bound on λmin(AᵀA)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems.forms.assembly import Assembly
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.operator import Stiffness

from .definite import SMALLEST, smallest_eigenvalue
from .exact_residual import gamma

SHARE, STEPS = 0.9, 20  # of an estimate of λmin that is no smaller, by so many steps of the power method
SAFE = 1.01  # for the rounding of the bound itself


def independence(assembly: Assembly) -> float:
    """A proven σ² ≤ λmin(AᵀA); 0 if none was found. AᵀA is block diagonal, a block per node."""
    G = sp.csr_array(assembly.A.T @ assembly.A)
    count, label = connected_components(G, directed=False)
    sizes = np.bincount(label, minlength=count)
    least = float(G.diagonal()[sizes[label] == 1].min(initial=np.inf))
    shared = np.flatnonzero(sizes[label] > 1)
    if shared.size:
        least = min(least, _least(Stiffness.of(sp.csc_array(G[shared][:, shared]))))
    # The entries of AᵀA are rounded themselves, and so is the difference.
    uncertainty = (
        SAFE * gamma(assembly.n + 1) * float(G.diagonal().max(initial=0.0)) * int(sizes.max(initial=1))
    )
    sigma2 = least - uncertainty
    return float(sigma2) if sigma2 >= SMALLEST else 0.0


def _least(G: Stiffness) -> float:
    one = np.ones(G.size)
    try:
        guesses = [SHARE * about for about in G.least_eigenvalues(one, STEPS)]
    except NotPositiveDefinite:
        return 0.0
    return smallest_eigenvalue(G, one, guesses)
