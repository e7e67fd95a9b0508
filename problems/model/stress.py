"""The bending stresses of a plate, from all of its unknowns.

A Kirchhoff plate has κ = −∇∇w − κ₀, κ₀ the curvature that it takes without stress, and at the height z

    σ_xx = E z/(1 − ν²) (κ_xx + ν κ_yy),    σ_yy = E z/(1 − ν²) (κ_yy + ν κ_xx),    τ_xy = E z/(1 + ν) κ_xy.

They are given at the 2 × 2 Gauss points of each element, where the curvatures of the cubic elements are most
accurate. On the top face, z = t/2 in the direction of positive displacements; on the bottom they are −σ.

An error e of the unknowns changes them by no more than its energy allows. C^½ κ is a polynomial of degree 3
in each direction, so that at a point of an element of the sides h_x, h_y, with the Legendre polynomials P_k,

    κᵀCκ ≤ S / (h_x h_y D) ‖e‖²_K,    S = s(ξ) s(η),    s(ξ) = Σ_{k ≤ 3} (2k + 1) P_k(ξ)²,

κᵀCκ = κ_xx² + κ_yy² + 2ν κ_xx κ_yy + 2(1 − ν) κ_xy². No stress, and not the von Mises stress, then changes by
more than √β E t / (2(1 − ν²)) (κᵀCκ)^½, β = max(1, 3(1 − ν)/2). D is that of the thinnest place of the part.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Indices, Mask, Matrix, Vector

from .part import PartLoadEffect, PartModel
from .plate import shape

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
SAME = 1e-6  # mm, by which a force on a mesh line may seem to be beside it


@dataclass(frozen=True)
class PartStress:
    """Stresses of a part, N/mm², at k points.

    places : (k, 2) x and y, mm. components : (k, 3) σ_xx, σ_yy, τ_xy. sensitivity : (k,) the most that any of
    them, or the von Mises stress, changes per √(N·mm) of ‖e‖_K. near_force : (k,) whether a force at a point
    acts on the element or the next one, where the plate's own moment has no limit. side : (k,) 1 top face, -1
    bottom, 0 top of two, of which the bottom has the negative ones.
    """

    part: str
    places: Matrix
    components: Matrix
    sensitivity: Vector
    near_force: Mask
    side: Indices

    @property
    def von_mises(self) -> Vector:
        """(k,) √(σ_xx² − σ_xx σ_yy + σ_yy² + 3 τ_xy²); infinite, never NaN, where it is not known."""
        scale = abs(self.components).max(axis=1)  # squares of what is above 1e154 overflow
        with np.errstate(over="ignore", invalid="ignore"):
            x, y, xy = self.components.T / np.where(scale > 0, scale, 1.0)
            value = scale * np.sqrt(x**2 - x * y + y**2 + 3 * xy**2)
        return np.where(np.isnan(value), np.inf, value)


def part_stress(
    name: str, model: PartModel, loads: Sequence[PartLoadEffect], u: Vector, forces: Matrix
) -> PartStress:
    """The stresses of a part.

    loads : those of its loads that may bend it without stress. u (model.plate.size,) : all of its unknowns,
    zero where it is built in. forces (k, 2) : the places of forces at points, mm.
    """
    plate, W = model.plate, u.reshape(2 * len(model.plate.y), 2 * len(model.plate.x))
    (x, hx, at_x), (y, hy, at_y) = _line(plate.x), _line(plate.y)
    places = np.column_stack([values.ravel() for values in np.meshgrid(x, y)])
    thickness, pads = np.full(len(places), plate.thickness), [e.pad for e in model.effects if e.pad]
    for pad, x_range, y_range in pads:
        low, high = np.transpose([x_range, y_range])
        thickness[((low <= places) & (places <= high)).all(axis=1)] = pad
    bent = sum((load.free_curvature(thickness) for load in loads), start=np.zeros(len(places)))
    of_xx, of_yy, of_xy = (-(at_y[b] @ W @ at_x[a].T).ravel() for a, b in ((2, 0), (0, 2), (1, 1)))
    of_xx, of_yy = of_xx - bent, of_yy - bent
    nu, E = plate.poisson, plate.young
    scale = E * thickness / 2 / (1 - nu**2)
    components = scale[:, None] * np.column_stack([of_xx + nu * of_yy, of_yy + nu * of_xx, (1 - nu) * of_xy])
    thinnest = min([plate.thickness, *(pad for pad, _, _ in pads)])  # also between the points
    rigidity = E * thinnest**3 / (12 * (1 - nu**2))
    areas = np.multiply.outer(hy, hx).ravel()
    s = sum((2 * k + 1) * np.polynomial.legendre.Legendre.basis(k)(GAUSS[0]) ** 2 for k in range(4))
    sensitivity = scale * np.sqrt(max(1.0, 1.5 * (1 - nu)) * s**2 / (areas * rigidity))
    lines = [(g, np.searchsorted(g, at) - 1) for g, at in zip((plate.x, plate.y), places.T, strict=True)]
    low, high = (  # the ends of an element and the next ones
        np.column_stack([g[np.clip(k + ends, 0, len(g) - 1)] for g, k in lines]) for ends in (-1, 2)
    )
    near = np.zeros(len(places), dtype=bool)
    for force in forces:
        near |= ((low - SAME <= force) & (force <= high + SAME)).all(axis=1)
    return PartStress(name, places, components, sensitivity, near, np.zeros(len(places), dtype=np.intp))


def _line(grid: Vector) -> tuple[Vector, Vector, list[sp.csr_array]]:
    """The Gauss points on a mesh line, the length of the element of each, and the matrices that evaluate a
    field there, and its first and second derivative.
    """
    elements, h = np.arange(len(grid) - 1).repeat(2), np.diff(grid).repeat(2)
    t = np.tile((1 + GAUSS) / 2, len(grid) - 1)
    columns = (2 * elements[:, None] + np.arange(4)).ravel()
    rows, size = np.arange(len(t)).repeat(4), (len(t), 2 * len(grid))
    matrices = [sp.csr_array((shape(t, h, d).T.ravel(), (rows, columns)), shape=size) for d in range(3)]
    return grid[elements] + t * h, h, matrices
