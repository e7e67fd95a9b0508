"""A banded M ≈ Q⁻¹ (problems/forms/banded_inverse.py) where it is worth having."""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Matrix
from problems.forms.banded_inverse import WINDOW_LINES, BandedInverse, Windows, banded_inverse

from .product import product

WIDEST_WINDOW = 1 / 4  # of the contacts: M with wider ones costs as much as Q⁻¹
STEPS, CONTRACTION = 3, 0.5  # of e ← e − MQe from a random e, and what the last one must achieve


def approximate_inverse(Q: Matrix, nodes: Matrix | None) -> BandedInverse | None:
    """M if e ← e − MQe converges fast; None if Q does not decay along the joint, or is small.

    Q (m, m). nodes : (m, 2) of the contacts, mm, or None. Raises LinAlgError if Q is not positive definite.
    """
    m = len(Q)
    if (WINDOW_LINES + 1) * Windows.of(nodes, m).across > WIDEST_WINDOW * m:
        return None
    M = banded_inverse(Q, nodes)
    e, sizes = np.random.default_rng(0).standard_normal(m), []
    for _ in range(STEPS):
        e[M.order] -= M.product(product(Q, e)[M.order])
        sizes.append(float(np.linalg.norm(e)))
    return M if sizes[-1] <= CONTRACTION * sizes[-2] else None
