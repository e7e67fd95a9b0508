"""The cells between scattered nodes: Delaunay's polygons, and which of them bridge a hole or a bay.

The corners of a cell are all nodes on one empty circle: three as a rule, four in a grid. Delaunay's
triangulation divides a cell by diagonals of its choice, which have no influence here.

An edge opposite to an angle of 90° or more does not join neighbours, as the centre of the triangle's circle
lies beyond it. The cells on both sides of such an edge belong to one pocket. A pocket is a hole if its
largest circle is wider than 2.5 times the usual distance of neighbours at any of its nodes, or than 2.25
times the longest edge around it. (A missing node of a mesh gives a ratio of 2, a round hole of eight nodes
2.6.) In a pocket that opens to the outside, a cell is part of a bay if its longest edge exceeds the first of
these limits.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems.forms.assembly import Indices, Mask, Matrix, Vector

FLAT = 1e-9  # of its longest edge squared: a triangle without area
ROUNDING = 1e-3  # rad, by which 90°, or four nodes on one circle, may be missed
SLIVER = 1e-2  # rad: a triangle with a smaller angle is no half of a rectangle
BRIDGE, HOLE = 2.5, 2.25  # times the usual distance of neighbours; times the longest edge


def cells_of(nodes: Matrix, triangles: Indices, beside: Indices) -> tuple[Indices, Mask, Mask]:
    """The cell of each triangle, whether the triangle has an area, and whether it is in a bay or a hole.

    triangles (t, 3) : their nodes. beside (t, 3) : the triangle across from each corner, −1 outside.
    """
    corners = nodes[triangles]
    first, second = np.roll(triangles, -1, axis=1), np.roll(triangles, 1, axis=1)
    u, v = nodes[first] - corners, nodes[second] - corners
    double, edge = abs(cross(u[:, 0], v[:, 0])), np.linalg.norm(u - v, axis=2)
    solid = double > 2 * FLAT * edge.max(axis=1) ** 2
    angle = np.arctan2(double[:, None], (u * v).sum(axis=2))
    here = np.repeat(np.arange(len(triangles))[:, None], 3, axis=1)
    opposite = (beside[beside] == here[:, :, None]).argmax(axis=2)
    inside = (beside >= 0) & solid[beside] & solid[:, None]
    across = np.where(inside, angle[beside, opposite], 0.0)
    blunt = angle >= np.pi / 2 - ROUNDING
    fat = angle.min(axis=1) > SLIVER
    alike = inside & fat[:, None] & fat[beside] & (abs(angle + across - np.pi) <= ROUNDING)
    masks = alike, alike | inside & blunt
    cell, pocket = (_joined(here[links], beside[links], len(here)) for links in masks)

    near = solid[:, None] & (~inside | ~blunt & (across < np.pi / 2 - ROUNDING))
    usual = _medians(np.concatenate([first[near], second[near]]), np.tile(edge[near], 2), len(nodes))
    circle = np.divide(edge.prod(axis=1), double, out=np.zeros(len(double)), where=solid)
    border = np.where(inside & (pocket[beside] == pocket[:, None]), 0.0, edge)
    apart, around = (_largest(pocket, links.max(axis=1)) for links in (usual[triangles], border))
    opens = _largest(pocket, (blunt & ~inside).max(axis=1)) > 0
    width = np.where(opens[pocket], _largest(cell, edge.max(axis=1))[cell], _largest(pocket, circle)[pocket])
    limit = np.minimum(BRIDGE * apart, np.where(opens, np.inf, HOLE * around))
    return cell, solid, width > limit[pocket]


def _joined(first: Indices, second: Indices, count: int) -> Indices:
    """(count,) the connected component of each triangle; first[k] and second[k] are connected."""
    links = sp.coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.intp)


def _medians(label: Indices, values: Vector, count: int) -> Vector:
    """(count,) the median of the values of each label, the upper of two; 0 without any."""
    order = np.lexsort((values, label))
    start = np.searchsorted(label[order], np.arange(count + 1))
    middle = np.minimum((start[:-1] + start[1:]) // 2, len(order) - 1)
    return np.where(start[1:] > start[:-1], values[order][middle], 0.0)


def _largest(label: Indices, values: Vector | Mask) -> Vector:
    """The largest of the values, 0 or more, of each label."""
    found = np.zeros(label.max() + 1)
    np.maximum.at(found, label, values)
    return found


def cross(u: Matrix, v: Matrix) -> Vector:
    """u × v of vectors (…, 2)."""
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def means(label: Indices, values: Matrix | Vector) -> Any:
    """The mean of the values of each label 0, 1, …"""
    found = np.zeros((label.max(initial=-1) + 1, *values.shape[1:]))
    np.add.at(found, label, values)
    return found / np.maximum(np.bincount(label), 1).reshape(-1, *[1] * (values.ndim - 1))


def wachspress(corners: Matrix, points: Matrix) -> Matrix:
    """(k, n) weights of the corners (k, n, 2) of convex polygons at points (k, 2) in them, to 12 digits.

    w_i is the area of the triangle of corner i and its neighbours, times the areas of the triangles between
    the point and each edge that does not meet corner i.
    """
    previous, after = np.roll(corners, 1, axis=1), np.roll(corners, -1, axis=1)
    at = points[:, None]
    spanned = np.clip(cross(corners - at, after - at), 0.0, None)
    spanned /= spanned.max(axis=1, keepdims=True)
    shares = cross(corners - previous, after - corners)
    n = corners.shape[1]
    for i in range(n):
        shares[:, i] *= np.delete(spanned, [i - 1, i], axis=1).prod(axis=1)
    shares = np.clip(shares, 0.0, None)
    return np.asarray(np.round(shares / shares.sum(axis=1, keepdims=True), 12))
