"""Plates, and plates in contact, by other codes: Argyris triangles of scikit-fem, the contacts by Clarabel.

    min Σ ½uᵀKu − fᵀu   subject to   e·u_a − e·u_b ≤ g

for the plates' own degrees of freedom u, nothing condensed; e evaluates a deflection at a point, which need
not be a vertex. Of this project nothing is used but the numbers of a joint, not what they are made into.
"""

from typing import Any

import clarabel
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


def plate(x: Array, y: Array, thickness: float, young: float, poisson: float) -> tuple[Any, sp.csr_array]:
    """Its basis and K, N/mm: each rectangle of the grid lines x and y, mm, is two triangles."""
    mesh = skfem.MeshTri.init_tensor(x / UNIT, y / UNIT)
    basis = skfem.Basis(mesh, skfem.ElementTriArgyris(), intorder=8)
    rigidity = young * thickness**3 / 12 / (1 - poisson**2)
    return basis, sp.csr_array(bending.assemble(basis, poisson=poisson) * (rigidity / UNIT**2))


def deflections(basis: Any, points: Array) -> sp.csr_array:
    """(len(points), N): the rows e of points, mm."""
    return sp.csr_array(basis.probes(points.T / UNIT))


def contact(
    joint: Joint, loads: tuple[Array, Array], contacts: tuple[Array, Array], element: float
) -> tuple[Array, Array]:
    """The gaps that are left, mm, and the contact forces, N, pair after pair.

    loads : points (k, 2), mm, and the forces there on each part, (parts, k), N. contacts : points (m, 2), mm,
    and the initial gaps there, (pairs · m,), mm. element : the side of the triangles, about, mm.
    """
    stiffness, e, force = [], {}, []
    for part, at_points in zip(joint.part, loads[1], strict=True):
        basis, K, free = _held(joint, part, element)
        stiffness.append(K[free][:, free])
        e[part.name] = deflections(basis, contacts[0])[:, free]
        force.append(deflections(basis, loads[0])[:, free].T @ at_points)
    sides = [[((name == a) - (name == b)) * e[name] for name in e] for a, b in joint.pairs]
    B, K, f = sp.block_array(sides, format="csc"), sp.block_diag(stiffness), np.concatenate(force)
    B.eliminate_zeros()
    g = contacts[1]

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    cones = [clarabel.NonnegativeConeT(len(g))]
    answer = clarabel.DefaultSolver(sp.triu(K, format="csc"), -f, B, g, cones, settings).solve()
    assert str(answer.status) == "Solved"
    u, lam = np.array(answer.x), np.array(answer.z)
    assert abs(K @ u + B.T @ lam - f).max() < 1e-9 * abs(f).max()
    return g - B @ u, lam


def _held(joint: Joint, part: Part, element: float) -> tuple[Any, sp.csr_array, NDArray[np.intp]]:
    """Basis and K of a part on a grid of its own, and what is free beside its clamped edges."""
    south = -part.south.length if part.south else 0.0
    north = joint.junction.width + (part.north.length if part.north else 0.0)
    x, y = (
        np.linspace(*ends, round((ends[1] - ends[0]) / element) + 1)
        for ends in ((0.0, joint.junction.length), (south, north))
    )
    basis, K = plate(x, y, part.thickness, part.young, part.poisson)
    held = np.zeros(basis.N, dtype=bool)
    for edge in part.clamped:
        line = {"south": south, "north": north}[edge] / UNIT
        facets = basis.mesh.facets_satisfying(lambda p, line=line: np.isclose(p[1], line))
        held[basis.get_dofs(facets).all(CLAMPED)] = True
    return basis, K, np.flatnonzero(~held)
