"""Nested subsets of the contacts, for a first guess from a smaller problem.

The contacts are grouped into square cells, each represented by the contact with the largest overlap p, so
that the contact of a fastener is in the subset. If coordinates are unknown, a cell is a run of numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from problems.forms.assembly import Matrix, Vector

Cells = NDArray[np.intp]


def cells_of(nodes: Matrix | None, m: int, width: int) -> Cells:
    """(m,) the cell of each contact, with width² contacts per cell on average. nodes : (m, 2) mm, or None."""
    if nodes is None:
        return np.arange(m) // width**2
    low, extent = nodes.min(axis=0), np.ptp(nodes, axis=0)
    spacing = np.sqrt(np.prod(extent) / m) if extent.all() else extent.max() / m
    place = np.floor((nodes - low) / (width * spacing or 1.0)).astype(int)
    numbers = place[:, 0] * (place[:, 1].max() + 1) + place[:, 1]
    return np.unique(numbers, return_inverse=True)[1]


def representatives(cells: Cells, p: Vector) -> NDArray[np.intp]:
    """The contact with the largest p in each cell, in ascending order."""
    order = np.lexsort((-p, cells))
    first = np.r_[True, np.diff(cells[order]) > 0]
    return np.sort(order[first])
