"""A surface through scattered nodes: the weights of its nodes at points, and their tributary areas.

Points and nodes are in a plane, mm. With the weights W of points, Wv are the values there of a field with the
values v at the nodes, and Wᵀp are nodal forces with the resultant and the moments of forces p at the points.

    Grid        bilinear on its rectangles; areas by the trapezoidal rule
    Triangles   Wachspress' weights on `cells_of` nodes: barycentric in triangles, bilinear in rectangles

Areas of triangles: a cell is divided into triangles between its edges and the mean of its corners. Each gives
a third of its area to both ends of its edge; the last third is shared by all corners of the cell. Bays and
holes are not part of the surface.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Indices, Mask, Matrix, Vector

from .surface_cells import cells_of, cross, means, wachspress

SAME = 1e-6  # mm: closer points are one
THIN = 1e-6  # of its length: a narrower strip of nodes is a line
ROUNDING = 1e-9  # of a triangle's size, by which a point on its border may be outside


@dataclass(frozen=True, eq=False)
class Grid:
    """The rectangles between the lines x and y, after a turn of the plane.

    place : the number of the node at each crossing, x running fastest; by default 0, 1, 2, …
    same : the distance, mm, by which a point may miss a line or the surface. turn (2, 2) : the rotation of
    points (k, 2), as points @ turn.
    """

    x: Vector
    y: Vector
    place: Indices | None = None
    same: float = 0.0
    turn: Matrix | None = None

    def weights(self, points: Matrix) -> sp.csr_array:
        """(k, nodes) for points (k, 2) on the surface."""
        grids = zip((self.x, self.y), self._turned(points).T, strict=True)
        (ix, s), (iy, t) = (_within(grid, at, self.same) for grid, at in grids)
        nx, k, nodes = len(self.x), len(points), len(self.x) * len(self.y)
        corners = iy * nx + ix + np.array([[0], [1], [nx], [nx + 1]])
        shares = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t])
        columns = corners.ravel() if self.place is None else self.place[corners.ravel()]
        return _weights(shares.ravel(), np.tile(np.arange(k), 4), columns, (k, nodes))

    def covers(self, points: Matrix) -> Mask:
        """(k,) which points are on the surface, its border included."""
        points = self._turned(points)
        low, high = (np.array([self.x[k], self.y[k]]) for k in (0, -1))
        inside = (points >= low - self.same) & (points <= high + self.same)
        return np.asarray(inside.all(axis=1))

    def is_open(self, points: Matrix) -> Mask:
        """(k,) which points are in a bay or a hole: none."""
        return np.zeros(len(points), dtype=bool)

    def _turned(self, points: Matrix) -> Matrix:
        return points if self.turn is None else points @ self.turn

    @property
    def areas(self) -> Vector:
        """(nodes,) tributary areas, mm²: their sum is that of the surface."""
        shares = np.outer(_tributary_lengths(self.y), _tributary_lengths(self.x)).ravel()
        return shares if self.place is None else shares[np.argsort(self.place)]

    @property
    def triangles(self) -> Indices:
        """(t, 3) the nodes of triangles that make up the surface, all of one orientation."""
        nx, ny = len(self.x), len(self.y)
        at = (np.arange(nx * ny) if self.place is None else self.place).reshape(ny, nx)
        a, b, c, d = (each.ravel() for each in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
        return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


@dataclass(frozen=True, eq=False)
class Triangles:
    """The cells between nodes (c, 2); the order of the nodes does not change a bit.

    order : the nodes sorted by x, then y. middle : their mean.
    nodes, mesh, tree : the sorted nodes about their mean, their Delaunay triangulation and search tree.
    cell, kept (t,) : the cell of each triangle of the mesh, and whether it belongs to the surface.
    start, corner : corner[start[k]:start[k + 1]] are the corners of cell k, anticlockwise.
    """

    order: Indices
    middle: Vector
    nodes: Matrix
    mesh: Any = field(repr=False)
    tree: Any = field(repr=False)
    cell: Indices
    kept: Mask
    start: Indices
    corner: Indices

    @classmethod
    def of(cls, nodes: Matrix, holes: bool = True) -> "Triangles":
        """The surface of nodes that are SAME or more apart. holes : whether bays and holes stay open."""
        from scipy.spatial import Delaunay, cKDTree

        order = np.lexsort(nodes.T[::-1])
        middle = nodes[order].mean(axis=0)
        nodes = nodes[order] - middle
        mesh = Delaunay(nodes)
        cell, solid, bridge = cells_of(nodes, mesh.simplices, mesh.neighbors)
        kept = solid & ~(bridge & holes)
        corners = np.column_stack([np.repeat(cell[kept], 3), mesh.simplices[kept].ravel()])
        of, corner = np.unique(corners, axis=0).T
        start = np.searchsorted(of, np.arange(cell.max() + 2))
        about = nodes[corner] - means(of, nodes[corner])[of]
        corner = corner[np.lexsort((np.arctan2(about[:, 1], about[:, 0]), of))]
        return cls(order, middle, nodes, mesh, cKDTree(nodes), cell, kept, start, corner)

    @property
    def triangles(self) -> Indices:
        corners = self.mesh.simplices[self.kept].astype(np.intp)
        a, b, c = (self.nodes[corners[:, j]] for j in range(3))
        turned = cross(b - a, c - a) < 0
        corners[turned] = corners[turned, ::-1]
        return self.order[corners]

    def weights(self, points: Matrix) -> sp.csr_array:
        """As of a Grid; a row of zeros for a point off the surface."""
        points = points - self.middle
        near, node = self.tree.query(points)
        owner = np.where(near <= SAME, -1, self._owners(points))
        rows, columns, values = [at := np.flatnonzero(near <= SAME)], [node[at]], [np.ones(len(at))]
        cell = np.where(owner >= 0, self.cell[owner], -1)
        count = np.where(cell >= 0, np.diff(self.start)[cell], 0)
        for n in np.unique(count[count > 0]):
            group = np.flatnonzero(count == n)
            corners = self.corner[self.start[cell[group], None] + np.arange(n)]
            rows.append(np.repeat(group, n))
            columns.append(corners.ravel())
            values.append(wachspress(self.nodes[corners], points[group]).ravel())
        row, column, value = map(np.concatenate, (rows, columns, values))
        return _weights(value, row, self.order[column], (len(points), len(self.nodes)))

    def covers(self, points: Matrix) -> Mask:
        points = points - self.middle
        inside: Mask = (self.tree.query(points)[0] <= SAME) | (self._owners(points) >= 0)
        return inside

    def is_open(self, points: Matrix) -> Mask:
        """(k,) which points are in a bay or a hole: among the nodes, but not on the surface."""
        return (self.mesh.find_simplex(points - self.middle) >= 0) & ~self.covers(points)

    @property
    def areas(self) -> Vector:
        count = np.diff(self.start)
        of = np.repeat(np.arange(len(count)), count)
        after = np.arange(len(of)) + 1
        after[self.start[1:][count > 0] - 1] = self.start[:-1][count > 0]
        corners = self.nodes[self.corner]
        about = corners - means(of, corners)[of]
        piece = cross(about, about[after]) / 2
        shares = means(of, piece)[of] + piece
        shares[after] += piece
        found = np.zeros(len(self.nodes))
        np.add.at(found, self.order[self.corner], shares / 3)
        return found

    def _owners(self, points: Matrix) -> Indices:
        """The triangle under each point, −1 off the surface; the first one for a point on a border."""
        owner = self.mesh.find_simplex(points, tol=ROUNDING)
        best = np.full(len(points), len(self.cell))
        for triangle in np.column_stack([owner, self.mesh.neighbors[owner]]).T:
            inside = np.flatnonzero((owner >= 0) & (triangle >= 0) & self.kept[triangle] & (triangle < best))
            corners = self.mesh.simplices[triangle[inside]]
            a, b, c = (self.nodes[corners[:, j]] - points[inside] for j in range(3))
            shares = np.column_stack([cross(b, c), cross(c, a), cross(a, b)])
            shares = shares / shares.sum(axis=1, keepdims=True)
            on = inside[(shares >= -ROUNDING).all(axis=1)]
            best[on] = triangle[on]
        return np.where(best < len(self.cell), best, -1)


Surface = Grid | Triangles


def surface_of(nodes: Matrix) -> Surface:
    """The surface of nodes (c, 2): a Grid if they form a full grid without bays, turned or not; else
    Triangles.

    Raises ValueError if they are on a line.
    """
    ordered = nodes[np.lexsort(nodes.T[::-1])]
    spread = np.linalg.svd(ordered - ordered.mean(axis=0), compute_uv=False)
    if len(nodes) < 3 or spread[1] <= max(SAME, THIN * spread[0]):
        raise ValueError("all on one line")
    edge = _shortest_edge(ordered)
    for turn in (None, np.column_stack([edge, [-edge[1], edge[0]]])):
        (x, column), (y, row) = (_lines(axis) for axis in (nodes if turn is None else nodes @ turn).T)
        place = row * len(x) + column
        if len(place) == len(x) * len(y) == len(np.unique(place)):
            cells, cell = Triangles.of(nodes), np.diff(x).min() * np.diff(y).min()
            full = cells.areas.sum() > np.ptp(x) * np.ptp(y) - cell / 2
            return Grid(x, y, np.argsort(place), SAME, turn) if full else cells
    return Triangles.of(nodes)


def refuse_off(points: Matrix, on: Mask) -> None:
    """Raises InputError if not all points (k, 2) are on a surface: a force there would act on no node."""
    if not on.all():
        place = points[on.argmin()].tolist()
        raise InputError.one("joint", "point", place, "on the parts, not beyond them or in a bay or a hole")


def _weights(values: Vector, rows: Indices, columns: Indices, shape: tuple[int, int]) -> sp.csr_array:
    W = sp.csr_array(sp.coo_array((values, (rows, columns)), shape=shape))
    W.eliminate_zeros()
    return W


def _shortest_edge(nodes: Matrix) -> Vector:
    """The direction from the first node to its nearest neighbour, which is that of the lines of a grid."""
    away = nodes - nodes[0]
    distance = np.linalg.norm(away, axis=1)
    distance[0] = np.inf
    nearest = int(distance.argmin())
    return np.asarray(away[nearest] / distance[nearest])


def _lines(values: Vector) -> tuple[Vector, Indices]:
    """The distinct values, apart from rounding, and the index among them of each value."""
    order = np.argsort(values, kind="stable")
    new = np.diff(values[order], prepend=-np.inf) > SAME
    number = np.empty(len(values), dtype=np.intp)
    number[order] = np.cumsum(new) - 1
    return values[order][new], number


def _within(grid: Vector, at: Vector, same: float) -> tuple[Indices, Vector]:
    """The element of each point, and its place in it, 0 … 1, rounded to 12 digits so that nodes are exact."""
    if same:
        nearest = grid[np.searchsorted((grid[1:] + grid[:-1]) / 2, at)]
        at = np.where(abs(at - nearest) <= same, nearest, at)
    element = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    return element, np.round((at - grid[element]) / np.diff(grid)[element], 12)


def _tributary_lengths(grid: Vector) -> Vector:
    """The tributary length of each grid point (trapezoidal rule)."""
    h = np.diff(grid)
    return 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))
