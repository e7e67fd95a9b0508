"""A surface through scattered nodes: the weights of its nodes at points, and their tributary areas.

Points and nodes are in a plane, mm. With the weights W of points, Wv are the values there of a field with the
values v at the nodes, and Wᵀp are nodal forces with the resultant and the moments of forces p at the points.

    a grid      bilinear on its rectangles; areas by the trapezoidal rule
    triangles   barycentric on Delaunay's triangles; each gives a third of its area to its corners

Delaunay's triangles fill the convex hull. One whose longest edge is more than 2.5 times the usual edge at any
of its corners bridges a hole or a bay of the part, and is dropped.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Indices, Mask, Matrix, Vector

SAME = 1e-6  # mm: closer points are one
THIN = 1e-6  # of its length: a narrower strip of nodes is a line
BRIDGE = 2.5  # times the usual edge at a corner
ROUNDING = 1e-9  # of a triangle's size, by which a point on its border may be outside
FLAT = 1e-9  # of its longest edge squared: a triangle without area


class Surface(ABC):
    """triangles : (t, 3) nodes, all of one orientation."""

    triangles: Indices

    @abstractmethod
    def weights(self, points: Matrix) -> sp.csr_array:
        """(k, nodes) for points (k, 2); a row of zeros for a point off the surface of triangles."""

    @abstractmethod
    def covers(self, points: Matrix) -> Mask:
        """(k,) which points are on the surface, its border included."""

    @property
    @abstractmethod
    def areas(self) -> Vector:
        """(nodes,) tributary areas, mm²: their sum is that of the surface."""


@dataclass(frozen=True, eq=False)
class Grid(Surface):
    """The rectangles between the lines x and y, after a turn of the plane.

    place : the number of the node at each crossing, x running fastest; by default 0, 1, 2, …
    same : mm, by which a point may miss a line, or the surface. turn (2, 2) : of points, (k, 2) @ turn.
    """

    x: Vector
    y: Vector
    place: Indices | None = None
    same: float = 0.0
    turn: Matrix | None = None

    def weights(self, points: Matrix) -> sp.csr_array:
        grids = zip((self.x, self.y), self._turned(points).T, strict=True)
        (ix, s), (iy, t) = (_within(grid, at, self.same) for grid, at in grids)
        nx, k, nodes = len(self.x), len(points), len(self.x) * len(self.y)
        corners = iy * nx + ix + np.array([[0], [1], [nx], [nx + 1]])
        shares = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t])
        columns = corners.ravel() if self.place is None else self.place[corners.ravel()]
        W = sp.csr_array(
            sp.coo_array((shares.ravel(), (np.tile(np.arange(k), 4), columns)), shape=(k, nodes))
        )
        W.eliminate_zeros()
        return W

    def covers(self, points: Matrix) -> Mask:
        points = self._turned(points)
        low, high = (np.array([self.x[k], self.y[k]]) for k in (0, -1))
        inside = (points >= low - self.same) & (points <= high + self.same)
        return np.asarray(inside.all(axis=1))

    def _turned(self, points: Matrix) -> Matrix:
        return points if self.turn is None else points @ self.turn

    @property
    def areas(self) -> Vector:
        shares = np.outer(_tributary_lengths(self.y), _tributary_lengths(self.x)).ravel()
        if self.place is None:
            return shares
        areas = np.empty(len(shares))
        areas[self.place] = shares
        return areas

    @property
    def triangles(self) -> Indices:  # type: ignore[override]
        nx, ny = len(self.x), len(self.y)
        at = (np.arange(nx * ny) if self.place is None else self.place).reshape(ny, nx)
        a, b, c, d = (each.ravel() for each in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
        return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


@dataclass(frozen=True, eq=False)
class Triangles(Surface):
    """Delaunay's triangles of the nodes (c, 2) but those that bridge a bay. kept : which of the mesh's."""

    nodes: Matrix
    mesh: Any
    kept: Mask
    tree: Any = field(repr=False)

    @classmethod
    def of(cls, nodes: Matrix) -> Triangles:
        from scipy.spatial import Delaunay, cKDTree

        mesh = Delaunay(nodes - nodes.mean(axis=0))
        return cls(nodes, mesh, _no_bridges(nodes, mesh.simplices), cKDTree(nodes))

    @property
    def triangles(self) -> Indices:  # type: ignore[override]
        found = self.mesh.simplices[self.kept].astype(np.intp)
        turned = _areas(self.nodes, found) < 0
        found[turned] = found[turned, ::-1]
        return found

    def weights(self, points: Matrix) -> sp.csr_array:
        k, count = len(points), len(self.nodes)
        near, node = self.tree.query(points)
        owner = np.where(near <= SAME, -1, self._owners(points))
        inside = np.flatnonzero(owner >= 0)
        shares = np.clip(self._barycentric(points[inside], owner[inside]), 0.0, 1.0)
        shares = np.round(shares / shares.sum(axis=1, keepdims=True), 12)
        at = np.flatnonzero(near <= SAME)
        values = np.concatenate([np.ones(len(at)), shares.ravel()])
        rows = np.concatenate([at, np.repeat(inside, 3)])
        columns = np.concatenate([node[at], self.mesh.simplices[owner[inside]].ravel()])
        W = sp.csr_array(sp.coo_array((values, (rows, columns)), shape=(k, count)))
        W.eliminate_zeros()
        return W

    def covers(self, points: Matrix) -> Mask:
        inside: Mask = (self.tree.query(points)[0] <= SAME) | (self._owners(points) >= 0)
        return inside

    @property
    def areas(self) -> Vector:
        found = np.zeros(len(self.nodes))
        corners = self.triangles
        np.add.at(found, corners, _areas(self.nodes, corners)[:, None] / 3)
        return found

    def _owners(self, points: Matrix) -> Indices:
        """The triangle of each point, −1 off the surface; of a border, the one that is kept."""
        owner = np.asarray(
            self.mesh.find_simplex(points - self.nodes.mean(axis=0), tol=ROUNDING), dtype=np.intp
        )
        for k in np.flatnonzero((owner >= 0) & ~self.kept[owner]):
            beside = [t for t in self.mesh.neighbors[owner[k]] if t >= 0 and self.kept[t]]
            touched = [t for t in beside if (self._barycentric(points[[k]], [t]) >= -ROUNDING).all()]
            owner[k] = touched[0] if touched else -1
        return owner

    def _barycentric(self, points: Matrix, triangles: Sequence[int] | Indices) -> Matrix:
        """(k, 3) of each point in its triangle, by the areas that it spans with the edges."""
        corners = self.nodes[self.mesh.simplices[np.asarray(triangles, dtype=np.intp)]]
        a, b, c = (corners[:, j] - points for j in range(3))
        shares = np.column_stack([cross(b, c), cross(c, a), cross(a, b)])
        return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def surface_of(nodes: Matrix) -> Surface:
    """A grid if the nodes (c, 2) are a full one, however it lies, else triangles.

    Raises ValueError if they are on a line.
    """
    spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
    if len(nodes) < 3 or spread[1] <= max(SAME, THIN * spread[0]):
        raise ValueError("all on one line")
    edge = _shortest_edge(nodes)
    for turn in (None, np.column_stack([edge, [-edge[1], edge[0]]])):
        (x, column), (y, row) = (_lines(axis) for axis in (nodes if turn is None else nodes @ turn).T)
        place = row * len(x) + column
        if len(place) == len(x) * len(y) == len(np.unique(place)):
            number = np.empty(len(place), dtype=np.intp)
            number[place] = np.arange(len(place))
            return Grid(x, y, number, SAME, turn)
    return Triangles.of(nodes)


def _shortest_edge(nodes: Matrix) -> Vector:
    """The direction from some node to the nearest other one: that of the lines, if the nodes are a grid."""
    away = nodes - nodes[0]
    distance = np.linalg.norm(away, axis=1)
    distance[0] = np.inf
    nearest = int(distance.argmin())
    return np.asarray(away[nearest] / distance[nearest])


def _lines(values: Vector) -> tuple[Vector, Indices]:
    """The distinct values, apart from rounding, and the number of each one's."""
    order = np.argsort(values, kind="stable")
    new = np.diff(values[order], prepend=-np.inf) > SAME
    number = np.empty(len(values), dtype=np.intp)
    number[order] = np.cumsum(new) - 1
    return values[order][new], number


def _within(grid: Vector, at: Vector, same: float) -> tuple[Indices, Vector]:
    """The element in which each point lies, and how far along it, 0 … 1, to 12 digits: what was meant to be
    at a node is there.
    """
    if same:
        nearest = grid[np.searchsorted((grid[1:] + grid[:-1]) / 2, at)]
        at = np.where(abs(at - nearest) <= same, nearest, at)
    element = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    return element, np.round((at - grid[element]) / np.diff(grid)[element], 12)


def _tributary_lengths(grid: Vector) -> Vector:
    """The tributary length of each grid point (trapezoidal rule)."""
    h = np.diff(grid)
    return 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))


def cross(u: Matrix, v: Matrix) -> Vector:
    """(k,) u × v of vectors (k, 2)."""
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _areas(nodes: Matrix, triangles: Indices) -> Vector:
    """Signed, mm²."""
    a, b, c = (nodes[triangles[:, j]] for j in range(3))
    return cross(b - a, c - a) / 2


def _no_bridges(nodes: Matrix, triangles: Indices) -> Mask:
    """Which triangles have an area, and no edge that is long beside the median edge at one of its corners."""
    edges = np.stack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]], axis=1)
    lengths = np.linalg.norm(nodes[edges[:, :, 0]] - nodes[edges[:, :, 1]], axis=2)
    longest = lengths.max(axis=1)
    solid = abs(_areas(nodes, triangles)) > FLAT * longest**2
    ends, size = edges[solid].reshape(-1, 2), lengths[solid].ravel()
    node, size = np.concatenate([ends[:, 0], ends[:, 1]]), np.tile(size, 2)
    order = np.lexsort((size, node))
    start = np.searchsorted(node[order], np.arange(len(nodes) + 1))
    middle = np.minimum((start[:-1] + start[1:]) // 2, max(len(order) - 1, 0))
    usual = np.where(start[1:] > start[:-1], size[order][middle], np.inf)
    kept: Mask = solid & (longest <= BRIDGE * usual[triangles].max(axis=1))
    return kept
