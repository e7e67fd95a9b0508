"""Maps of the junction: a field on the contact nodes, and the outline of some of them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import NDArray

Array = NDArray[np.float64]
Grid = tuple[Array, Array, NDArray[np.intp]]


def grid_of(nodes: Array) -> Grid | None:
    """x, y and the place of each node if the nodes are a full tensor grid, else None."""
    x, column = np.unique(np.round(nodes[:, 0], 6), return_inverse=True)
    y, row = np.unique(np.round(nodes[:, 1], 6), return_inverse=True)
    place = row * len(x) + column
    full = len(place) == len(x) * len(y) == len(np.unique(place)) and len(x) > 1 and len(y) > 1
    return (x, y, place) if full else None


def draw(axes: Axes, nodes: Array, values: Array, norm: Normalize, colours: str) -> ScalarMappable:
    """A field on the nodes in true proportions: cells if they are a grid, otherwise dots."""
    axes.set(aspect="equal", ylabel="y, mm")
    axes.grid(visible=False)
    grid = grid_of(nodes)
    if grid is None:
        return axes.scatter(nodes[:, 0], nodes[:, 1], c=values, s=4, norm=norm, cmap=colours)
    x, y, place = grid
    field = np.empty(len(x) * len(y))
    field[place] = values
    cells = field.reshape(len(y), len(x))
    return axes.pcolormesh(_edges(x), _edges(y), cells, norm=norm, cmap=colours)


def outline(grid: Grid, inside: NDArray[np.bool_]) -> list[Array]:
    """The edges between the cells of closed contacts and the rest, as line segments."""
    x, y, place = grid
    field = np.zeros(len(x) * len(y), dtype=bool)
    field[place] = inside
    padded = np.pad(field.reshape(len(y), len(x)), 1)
    xe, ye = _edges(x), _edges(y)
    rows, columns = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])
    upright = [np.array([[xe[c], ye[r]], [xe[c], ye[r + 1]]]) for r, c in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    level = [np.array([[xe[c], ye[r]], [xe[c + 1], ye[r]]]) for r, c in zip(rows, columns, strict=True)]
    return upright + level


def _edges(nodes: Array) -> Array:
    """The borders of the nodes' cells: half-way between the nodes, and the ends of the grid."""
    return np.concatenate([nodes[:1], (nodes[1:] + nodes[:-1]) / 2, nodes[-1:]])
