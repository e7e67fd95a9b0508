"""M ≈ Q⁻¹ of a dense Q: banded (problems/forms/banded_inverse.py) where Q decays along the joint, else Q⁻¹."""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Matrix
from problems.forms.banded_inverse import WINDOW_LINES, BandedInverse, Windows, of_windows

from .product import product

WIDEST_WINDOW = 1 / 4  # of the contacts: M with wider ones costs as much as Q⁻¹
STEPS, CONTRACTION = 3, 0.5  # of e ← e − MQe from a random e, and what the last one must achieve


def approximate_inverse(Q: Matrix, nodes: Matrix | None) -> BandedInverse:
    """M with the narrow band if e ← e − MQe converges fast, else from one window of all contacts: Q⁻¹.

    Q (m, m). nodes : (m, 2) of the contacts, mm, or None. Raises LinAlgError if Q is not positive definite.
    """
    rows = np.asarray(Q).T  # no memory map, whose views cost more than their copies
    windows = Windows.of(nodes, len(Q))
    if (WINDOW_LINES + 1) * windows.across <= WIDEST_WINDOW * len(Q):
        M = of_windows(windows, lambda window: rows[np.ix_(window, window)].T)
        e, sizes = np.random.default_rng(0).standard_normal(len(Q)), []
        for _ in range(STEPS):
            e[M.order] -= M.product(product(Q, e)[M.order])
            sizes.append(float(np.linalg.norm(e)))
        if sizes[-1] <= CONTRACTION * sizes[-2]:
            return M
    windows = Windows(np.arange(len(Q)), len(Q))
    return of_windows(windows, lambda window: np.array(rows, order="C").T)
