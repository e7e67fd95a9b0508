"""Hertz's line contact against its closed form: a rigid cylinder on a solid in plane strain.

The sparse K is scikit-fem's, of bilinear elements, and taken as it is. With P the force per length,
E* = E/(1 − ν²) and R the radius, a = √(4PR/πE*) is the half-width of the contact, p₀ = √(PE*/πR) the largest
pressure, and p = p₀ √(1 − x²/a²) (K. L. Johnson, Contact Mechanics, 1985, section 4.2). All follow from P, so
how far the cylinder was moved does not matter, nor the solid's depth where that is large beside a.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from harness.solving.solver_session import answer_of
from harness.verification.reference import best_of_candidates
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness
from solvers.registry import make_solver

E, NU, RADIUS = 70e3, 0.33, 100.0  # N/mm², –, mm
CONTACT_MODULUS = E / (1 - NU**2)
DEPTH, CLOSE, PRESSED = 60.0, 2.0, 0.03  # mm: of the solid; where it may touch; of the cylinder

ELEMENTS = (6, 12, 24)  # along a millimetre of the surface near the contact


@dataclass(frozen=True)
class Contact:
    """Half of it, x ≥ 0: the places of the contacts, mm, their pressures, N/mm², and the half-width by P."""

    x: np.ndarray
    pressure: np.ndarray
    half_width: float
    largest: float

    @property
    def second_moment_width(self) -> float:
        """∫x²p / ∫p = a²/4."""
        weight = np.append(self.pressure[0] / 2, self.pressure[1:])
        return 2 * float(np.sqrt(weight @ self.x**2 / weight.sum()))


def hertz(elements: int) -> Contact:
    fine = np.linspace(0.0, CLOSE, int(CLOSE * elements) + 1)
    lines = np.append(fine, np.geomspace(CLOSE, DEPTH, 2 * elements + 1)[1:])
    mesh = skfem.MeshQuad.init_tensor(lines, -lines[::-1])
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad1()))
    K = sp.csc_array(linear_elasticity(*lame_parameters(E, NU)).assemble(basis))
    across, up = basis.nodal_dofs
    held = np.concatenate([across[mesh.p[0] == 0], basis.nodal_dofs[:, mesh.p[1] == -DEPTH].ravel()])
    free = np.setdiff1d(np.arange(basis.N), held)
    top = np.flatnonzero((mesh.p[1] == 0) & (mesh.p[0] <= CLOSE))
    top = top[np.argsort(mesh.p[0, top])]
    x = mesh.p[0, top]
    rows = np.searchsorted(free, up[top])
    A = sp.csc_array((np.ones(len(top)), (rows, np.arange(len(top)))), shape=(len(free), len(top)))
    nodes = basis.doflocs[:, free].T
    data = Prepared(Assembly(Stiffness.of(sp.csc_array(K[free][:, free])), A, nodes, ("solid",)))
    load = LoadCase(np.zeros(len(free)), x**2 / (2 * RADIUS) - PRESSED)

    answer = answer_of("newton", make_solver("newton", {}), data, "sparse", load, 1e-11)
    assert answer.status == "solved"
    reference = best_of_candidates(data, load, first=[("newton", answer.lam)])
    assert reference.bound_mm < 1e-10
    assert abs(reference.x - np.asarray(answer.x)).max() < 1e-10
    assert 5 < reference.active.sum() < len(top) - 3
    whole = np.append(2 * reference.lam[0], reference.lam[1:])  # the cell at x = 0 is half there
    force = 2 * reference.lam.sum()
    half_width = np.sqrt(4 * force * RADIUS / (np.pi * CONTACT_MODULUS))
    largest = np.sqrt(force * CONTACT_MODULUS / (np.pi * RADIUS))
    return Contact(x, whole * elements, float(half_width), float(largest))


@pytest.fixture(scope="module")
def meshes() -> list[Contact]:
    return [hertz(elements) for elements in ELEMENTS]


def test_the_edge_of_the_contact_is_within_an_element_of_hertz(meshes: list[Contact]) -> None:
    for elements, found in zip(ELEMENTS, meshes, strict=True):
        edge = found.x[found.pressure > 0].max()
        assert abs(edge - found.half_width) < 1 / elements


def test_half_width_and_pressure_converge(meshes: list[Contact]) -> None:
    errors = {
        "half-width": [abs(found.second_moment_width / found.half_width - 1) for found in meshes],
        "largest pressure": [abs(found.pressure[0] / found.largest - 1) for found in meshes],
        "half ellipse": [deviation(found) for found in meshes],
    }
    for of_meshes in errors.values():
        assert of_meshes == sorted(of_meshes, reverse=True)
        assert of_meshes[-1] < of_meshes[0] / 4  # better than first order
        assert of_meshes[-1] < 1e-3


def deviation(contact: Contact) -> float:
    """From the half ellipse, of the largest pressure, up to 0.9 a."""
    share = contact.x[contact.x < 0.9 * contact.half_width] / contact.half_width
    pressure = contact.pressure[: len(share)] / contact.largest
    return float(abs(pressure - np.sqrt(1 - share**2)).max())
