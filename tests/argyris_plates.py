"""Plates of another code: Argyris triangles of scikit-fem, their deflections and curvatures at points."""

from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.helpers import dd, ddot, eye, trace

from problems.model.joint import Joint, Part

Array = NDArray[np.float64]

UNIT = 200.0  # mm; scikit-fem inverts matrices of powers of the coordinates, which are best near one
CLAMPED = ("u", "u_x", "u_y", "u_xx", "u_xy", "u_n")  # zero along a clamped edge y = const: all but w_yy


@skfem.BilinearForm  # type: ignore[untyped-decorator]
def bending(u: Any, v: Any, w: Any) -> Any:
    """Of rigidity one: ∫ (1 − ν) κ(u):κ(v) + ν tr κ(u) tr κ(v)."""
    kappa = dd(u)
    return ddot((1 - w.poisson) * kappa + w.poisson * eye(trace(kappa), 2), dd(v))


@cache
def plate(length: float, south: float, north: float, side: float, poisson: float) -> tuple[Any, sp.csr_array]:
    """Basis and K of rigidity one, two triangles per square of a side, mm. Products of κ are of order 6."""
    x, y = (
        np.linspace(*ends, round((ends[1] - ends[0]) / side) + 1) / UNIT
        for ends in ((0.0, length), (south, north))
    )
    basis = skfem.Basis(skfem.MeshTri.init_tensor(x, y), skfem.ElementTriArgyris(), intorder=6)
    return basis, sp.csr_array(bending.assemble(basis, poisson=poisson) / UNIT**2)


def held(joint: Joint, part: Part, side: float) -> tuple[Any, sp.csr_array, NDArray[np.intp]]:
    """Basis and K, N/mm, of a part in triangles of a side, mm; what is free beside its clamped edges."""
    south = -part.south.length if part.south else 0.0
    north = joint.junction.width + (part.north.length if part.north else 0.0)
    basis, K = plate(joint.junction.length, south, north, side, part.poisson)
    rigidity = part.young * part.thickness**3 / 12 / (1 - part.poisson**2)
    fixed = np.zeros(basis.N, dtype=bool)
    for edge in part.clamped:
        line = {"south": south, "north": north}[edge] / UNIT
        facets = basis.mesh.facets_satisfying(lambda p, line=line: np.isclose(p[1], line))
        fixed[basis.get_dofs(facets).all(CLAMPED)] = True
    return basis, rigidity * K, np.flatnonzero(~fixed)


def deflections(basis: Any, points: Array) -> sp.csr_array:
    """(k, basis.N) what evaluates w at points (k, 2), mm."""
    return sp.csr_array(basis.probes(points.T / UNIT))


def curvatures(basis: Any, points: Array, u: Array) -> Array:
    """(k, 3) −w_xx, −w_yy, −w_xy at points (k, 2), 1/mm. u : (basis.N,), mm."""
    at = points.T / UNIT
    cells = basis.mesh.element_finder(mapping=basis.mapping)(*at)
    local = basis.mapping.invF(at[:, :, None], tind=cells)
    w = np.zeros((2, 2, len(points)))
    for k, unknowns in enumerate(basis.dofs.element_dofs[:, cells]):
        (field, *_) = basis.elem.gbasis(basis.mapping, local, k, tind=cells)
        w += field.hess[..., 0] * u[unknowns]
    return -np.column_stack([w[0, 0], w[1, 1], w[0, 1]]) / UNIT**2
