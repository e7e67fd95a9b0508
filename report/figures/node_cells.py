"""The cell of each contact on a map, in which its value is shown.

On a grid the cells are rectangles, which meet half-way between the nodes. Else a cell runs through the
middles of the edges and triangles around its node, on a surface that leaves bays and holes open. Nodes on one
line have squares of their mean distance.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from problems.model.surface import surface_of

Array = NDArray[np.float64]
TensorGrid = tuple[Array, Array, NDArray[np.intp]]
SQUARE = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
LAST = 7.0  # an angle beyond 2π


def grid_of(nodes: Array) -> TensorGrid | None:
    """x, y and the place of each node if the nodes are a full tensor grid, else None."""
    x, column = np.unique(np.round(nodes[:, 0], 6), return_inverse=True)
    y, row = np.unique(np.round(nodes[:, 1], 6), return_inverse=True)
    place = row * len(x) + column
    full = len(place) == len(x) * len(y) == len(np.unique(place)) and len(x) > 1 and len(y) > 1
    return (x, y, place) if full else None


def largest_at_places(nodes: Array, values: NDArray[Any]) -> tuple[Array, NDArray[Any]]:
    """The places of nodes, and the largest value at each: contacts of two pairs may lie above one another."""
    places, first, at = np.unique(nodes.round(6), axis=0, return_index=True, return_inverse=True)
    largest = values[first]
    np.fmax.at(largest, at.ravel(), values)
    return places, largest


def cell_edges(nodes: Array) -> Array:
    """The borders of the nodes' cells: half-way between the nodes, and the ends of the grid."""
    return np.concatenate([nodes[:1], (nodes[1:] + nodes[:-1]) / 2, nodes[-1:]])


def cells_of(nodes: Array) -> list[Array]:
    """The corners (k, 2) of each node's cell, in their order. nodes : (m, 2) mm, perhaps equal."""
    distinct, place = np.unique(nodes, axis=0, return_inverse=True)
    if (grid := grid_of(distinct)) is not None:
        x, y = cell_edges(grid[0]), cell_edges(grid[1])
        row, column = np.divmod(grid[2], len(grid[0]))
        across, up = np.array([[0, 1, 1, 0]]), np.array([[0, 0, 1, 1]])
        cells = list(np.stack([x[column[:, None] + across], y[row[:, None] + up]], axis=2))
    elif (triangles := triangles_of(distinct)) is not None:
        cells = _around(distinct, triangles)
    else:
        side = max(float(np.ptp(nodes, axis=0).max()) / len(nodes), 1.0)
        cells = list(distinct[:, None] + side * SQUARE)
    return [cells[k] for k in place.ravel()]


def triangles_of(nodes: Array) -> NDArray[np.intp] | None:
    """The triangles of the surface through nodes, without its bays and holes; None if all are on one line."""
    try:
        return surface_of(nodes).triangles
    except ValueError:
        return None


def _around(nodes: Array, triangles: NDArray[np.intp]) -> list[Array]:
    """The cells of the nodes of triangles, which turn anticlockwise."""
    of, after = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    edges, reverse = of * len(nodes) + after, after * len(nodes) + of
    rim = ~np.isin(edges, reverse)
    middle = (nodes[of] + nodes[after]) / 2
    centre = np.repeat(nodes[triangles].mean(axis=1), 3, axis=0)
    owner = np.concatenate([of, of, after[rim], of[rim]])
    corners = np.concatenate([middle, centre, middle[rim], nodes[of[rim]]])
    x, y = (corners - nodes[owner]).T
    angle, start = np.arctan2(y, x), np.zeros(len(nodes))
    start[of[rim]] = angle[: len(of)][rim]  # a cell on the rim begins there, and ends with its node
    turn = (angle - start[owner]) % (2 * np.pi)
    turn[len(turn) - rim.sum() :] = LAST
    order = np.lexsort((turn, owner))
    return np.split(corners[order], np.cumsum(np.bincount(owner, minlength=len(nodes)))[:-1])


def border(cells: list[Array], inside: NDArray[np.bool_]) -> Array:
    """The sides (k, 2, 2) between the cells inside and the rest: those that only one cell inside has."""
    chosen = [cells[k] for k in np.flatnonzero(inside)]
    sides = np.concatenate([np.stack([cell, np.roll(cell, -1, axis=0)], axis=1) for cell in chosen])
    ends = np.sort(sides @ np.array([1.0, 1j]), axis=1)
    _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
    return np.asarray(sides[first[count == 1]])
