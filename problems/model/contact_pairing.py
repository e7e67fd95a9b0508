"""Pairs the contact nodes of one face with their feet on another.

The foot of a node p along its normal n is p + tn, where that line meets the second face. Both faces are in
the axes of the junction's plane; the third coordinate is the height above it. A foot that hardly misses the
border, as places in files are rounded, is moved onto the face.
"""

from dataclasses import dataclass, field
from itertools import product

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Indices, Mask, Matrix, Vector

from .surface import Surface
from .surface_cells import cross

STEPS, SETTLED = 50, 1e-10  # of the search for a foot; mm
BORDER = 1e-3  # of b's usual spacing, by which rounded places may miss its border


@dataclass(frozen=True)
class Face:
    """The contact nodes of a part: xyz (c, 3) mm, normals (c, 3), and the surface through them from above."""

    xyz: Matrix
    normals: Matrix
    surface: Surface


@dataclass(frozen=True)
class Pairing:
    """The contacts of two faces a and b, and the nodes of a that are none.

    nodes (c,) : the contacts, as nodes of a. W (c, nodes of b) : the weights of b's nodes at their feet.
    apart (c,) : their distances t, mm. beyond : the number of nodes of a without a foot on b. far : t, mm, of
    each node that is too far from b. over_bays : how many of `beyond` are near b, over a bay or a hole of it.
    crossed : triangles of a whose feet have the other orientation. lost : nodes near b for which no foot was
    found.
    """

    nodes: Indices
    W: sp.csr_array
    apart: Vector
    beyond: int = 0
    far: dict[int, float] = field(default_factory=dict)
    over_bays: int = 0
    crossed: tuple[tuple[int, ...], ...] = ()
    lost: tuple[int, ...] = ()


def with_tool(a: Face) -> Pairing:
    """The contacts of a face with a rigid tool: all nodes, without feet."""
    count = len(a.xyz)
    return Pairing(np.arange(count), sp.csr_array((count, 0)), np.zeros(count))


def paired(a: Face, b: Face, distance: float) -> Pairing:
    """The contacts of two faces. distance : the largest |t| of a contact, mm."""
    t, foot, has_foot, away = _feet(a, b)
    onto, off = foot.copy(), np.flatnonzero(~b.surface.covers(foot))
    reach = BORDER * np.sqrt(b.surface.areas.mean())
    for step in product((-reach, reach), repeat=2):
        onto[off] = foot[off] + step
        off = off[~b.surface.covers(onto[off])]
    on = has_foot & ~np.isin(np.arange(len(t)), off)
    over_bays = int((has_foot & (abs(t) <= distance))[off][b.surface.is_open(foot[off])].sum())
    near = on & (abs(t) <= distance)
    nodes = np.flatnonzero(near)
    far = {int(k): float(t[k]) for k in np.flatnonzero(on & ~near)}
    corners = a.surface.triangles
    corners = corners[near[corners].all(axis=1)]
    u, v = (foot[corners[:, k]] - foot[corners[:, 0]] for k in (1, 2))
    turned = corners[cross(u, v) <= 0]
    crossed = tuple(tuple(each) for each in turned.tolist())
    lost = np.flatnonzero(~has_foot & (away <= distance))
    W = b.surface.weights(onto[nodes])
    return Pairing(nodes, W, t[nodes], int((~on).sum()), far, over_bays, crossed, tuple(lost.tolist()))


def _feet(a: Face, b: Face) -> tuple[Vector, Matrix, Mask, Vector]:
    """The feet of a's nodes on b, by Newton's method from b's nearest node.

    At q = p + tn, b is replaced by a plane: the one through its point above q with its normal m there, or
    beyond its surface the one of the node nearest to q. t changes by r·m / n·m, with r from q to that point.
    Returns t (c,), the feet (c, 2), whether each was found, and the distance of b's nearest node (c,).
    """
    from scipy.spatial import cKDTree

    p, n, tree = a.xyz, a.normals, cKDTree(b.xyz)
    away, nearest = tree.query(p)
    t = ((b.xyz[nearest] - p) * n).sum(axis=1)
    for _ in range(STEPS):
        q = p + t[:, None] * n
        off = ~b.surface.covers(q[:, :2])
        W = b.surface.weights(q[:, :2])
        point, m = W @ b.xyz, W @ b.normals
        nearest = tree.query(q[off])[1]
        point[off], m[off] = b.xyz[nearest], b.normals[nearest]
        with np.errstate(divide="ignore", invalid="ignore"):
            step = ((point - q) * m).sum(axis=1) / (n * m).sum(axis=1)
        settled = abs(step) <= SETTLED
        t = t + np.nan_to_num(step, nan=0.0, posinf=0.0, neginf=0.0)
        if settled.all():
            break
    return t, (p + t[:, None] * n)[:, :2], settled, away
