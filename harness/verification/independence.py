"""How independent the contacts are: a proven lower bound on λmin(AᵀA)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems.forms.assembly import Assembly

from .definite import SMALLEST, smallest_eigenvalue
from .exact_residual import gamma

SAFE = 1.01  # for the rounding of the bound itself


def independence(assembly: Assembly) -> float:
    """A proven σ² ≤ λmin(AᵀA); 0 if none was found. AᵀA is block diagonal, a block per node."""
    G = sp.csr_array(assembly.A.T @ assembly.A)
    count, label = connected_components(G, directed=False)
    sizes = np.bincount(label, minlength=count)
    groups = np.split(np.argsort(label, kind="stable"), np.cumsum(sizes)[:-1])
    least = float(G.diagonal()[sizes[label] == 1].min(initial=np.inf))
    for group in groups:
        if len(group) > 1:
            block = np.asfortranarray(G[group][:, group].toarray())
            least = min(least, smallest_eigenvalue(block, float(np.linalg.eigvalsh(block)[0])))
    # The entries of AᵀA are rounded themselves, and so is the difference.
    uncertainty = (
        SAFE * gamma(assembly.n + 1) * float(G.diagonal().max(initial=0.0)) * int(sizes.max(initial=1))
    )
    sigma2 = least - uncertainty
    return float(sigma2) if sigma2 >= SMALLEST else 0.0
