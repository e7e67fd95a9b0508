"""The contacts of two faces: each node of the first with its foot on the second.

The foot of p along its normal n is p + tn, at the height of the second face there; both faces are given in
the axes of the junction's plane, whose third one is the height.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Indices, Mask, Matrix, Vector

from .surface import Surface
from .surface_cells import cross

STEPS, SETTLED = 50, 1e-10  # of the search for a foot; mm


@dataclass(frozen=True)
class Face:
    """xyz (c, 3) mm and normals (c, 3) of contact nodes; the surface through them, seen from above."""

    xyz: Matrix
    normals: Matrix
    surface: Surface


@dataclass(frozen=True)
class Pairing:
    """Of faces a and b. nodes (c,) : the contacts, as nodes of a. W (c, nodes of b) : weights of their feet.

    apart (c,) : t, mm. beyond : how many nodes of a have no foot on b. far : those too far from it, by t.
    crossed : triangles of a whose feet go round the other way. lost : nodes near b whose foot was not found.
    """

    nodes: Indices
    W: sp.csr_array
    apart: Vector
    beyond: int = 0
    far: dict[int, float] = field(default_factory=dict)
    crossed: tuple[tuple[int, ...], ...] = ()
    lost: tuple[int, ...] = ()


def with_tool(a: Face) -> Pairing:
    """Every node, without a second face."""
    count = len(a.xyz)
    return Pairing(np.arange(count), sp.csr_array((count, 0)), np.zeros(count))


def paired(a: Face, b: Face, distance: float) -> Pairing:
    """distance : up to which |t| two surfaces may touch, mm."""
    t, foot, has_foot, away = _feet(a, b)
    on = has_foot & b.surface.covers(foot)
    near = on & (abs(t) <= distance)
    nodes = np.flatnonzero(near)
    far = {int(k): float(t[k]) for k in np.flatnonzero(on & ~near)}
    corners = a.surface.triangles
    corners = corners[near[corners].all(axis=1)]
    u, v = (foot[corners[:, k]] - foot[corners[:, 0]] for k in (1, 2))
    turned = corners[cross(u, v) <= 0]
    crossed = tuple(tuple(each) for each in turned.tolist())
    lost = np.flatnonzero(~has_foot & (away <= distance))
    W = b.surface.weights(foot[nodes])
    return Pairing(nodes, W, t[nodes], int((~on).sum()), far, crossed, tuple(lost.tolist()))


def _feet(a: Face, b: Face) -> tuple[Vector, Matrix, Mask, Vector]:
    """t (c,), the feet (c, 2), which were found, how far b's nearest node is: from that by Newton's method.

    At q = p + tn, b is the plane through its point above q with its normal m there, or beyond its surface
    that of the node nearest to q: t changes by r·m / n·m, with r from q to the point.
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
