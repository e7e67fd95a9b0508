"""The plate element against closed forms, beam theory and another code."""

from typing import Any

import numpy as np
import pytest
import skfem
from argyris_plates import bending
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from small_joints import degrees, dof

from problems.effects.ribs import Ribs
from problems.effects.stringers import Stringers
from problems.effects.supports import Supports
from problems.model.plate import Plate, line_matrices

UNEVEN_X = np.array([0.0, 70.0, 110.0, 260.0, 300.0])
UNEVEN_Y = np.array([-90.0, 0.0, 35.0, 50.0])


@given(
    st.lists(st.floats(-2, 2), min_size=4, max_size=4),
    st.lists(st.floats(-2, 2), min_size=4, max_size=4),
    st.floats(-1.5, 3.5),
    st.floats(-1.5, 3.5),
)
@settings(max_examples=60, deadline=None)
def test_line_integrals_of_cubics(u: list[float], v: list[float], a: float, b: float) -> None:
    grid = np.array([-1.0, -0.4, 0.3, 1.0, 2.5])
    start, stop = min(a, b), max(a, b)
    low, high = np.clip([start, stop], grid[0], grid[-1])
    U, V = Polynomial(u), Polynomial(v)
    u_dofs, v_dofs = (np.column_stack([P(grid), P.deriv()(grid)]).ravel() for P in (U, V))
    line = line_matrices(grid, start, stop)
    for matrix, product in [
        (line.M, U * V),
        (line.G, U.deriv() * V.deriv()),
        (line.H, U.deriv(2) * V.deriv(2)),
        (line.B, U.deriv(2) * V),
    ]:
        integral = product.integ()
        assert u_dofs @ (matrix @ v_dofs) == pytest.approx(integral(high) - integral(low), rel=1e-9, abs=1e-9)


def test_stiffness_equals_that_of_scikit_fem() -> None:
    """Entry by entry; on coordinates near one, since scikit-fem inverts an unscaled Vandermonde matrix."""
    x, y = np.array([0.0, 0.3, 0.5, 1.0]), np.array([0.0, 0.4, 0.7])
    plate = Plate(x, y, thickness=0.5, young=30.0, poisson=0.3)
    basis = skfem.Basis(skfem.MeshQuad.init_tensor(x, y), skfem.ElementQuadBFS(), intorder=8)
    theirs = plate.rigidity * bending.assemble(basis, poisson=0.3).toarray()
    order = np.zeros(plate.size, dtype=int)
    for node, (px, py) in enumerate(basis.mesh.p.T):
        ix, iy = abs(x - px).argmin(), abs(y - py).argmin()
        for k, name in enumerate(basis.elem.dofnames):
            dx, dy = {"u": (0, 0), "u_x": (1, 0), "u_y": (0, 1), "u_xy": (1, 1)}[name]
            order[dof(len(x), int(ix), int(iy), dx, dy)] = basis.nodal_dofs[k, node]
    ours = plate.stiffness().toarray()
    np.testing.assert_allclose(ours, theirs[np.ix_(order, order)], atol=1e-9 * abs(theirs).max())


def cubic(x: float, y: float) -> tuple[float, float, float, float]:
    """w = 1e-6 (x²y² + 2 x y³ − x³)."""
    return (
        1e-6 * (x**2 * y**2 + 2 * x * y**3 - x**3),
        1e-6 * (2 * x * y**2 + 2 * y**3 - 3 * x**2),
        1e-6 * (2 * x**2 * y + 6 * x * y**2),
        1e-6 * (4 * x * y + 6 * y**2),
    )


STRINGERS = Stringers(kind="stringers", part="a", pitch=130.0, start=-60.0, stop=42.0, I=3e4, J=2e3)
RIBS = Ribs(kind="ribs", part="a", lines=(-20.0, 40.0), I=5e4, J=1e3)


@pytest.mark.parametrize(
    ("effect", "at", "rates", "ends"),
    [  # where the beams lie, w_ss and w_xy along them, and from where to where
        (STRINGERS, (0.0, 130.0, 260.0), lambda x: ([2 * x**2, 12 * x], [0, 4 * x, 6]), (-60.0, 42.0)),
        (RIBS, (-20.0, 40.0), lambda y: ([2 * y**2, -6], [6 * y**2, 4 * y]), (0.0, 300.0)),
    ],
)
def test_energy_of_beams_between_grid_lines(effect: Any, at: Any, rates: Any, ends: Any) -> None:
    plate = Plate(UNEVEN_X, UNEVEN_Y, 6.0, 70e3, 0.33)
    w, expected = degrees(plate.x, plate.y, cubic), 0.0
    for place in at:
        for stiffness, rate in zip((effect.I, effect.J / (2 * 1.33)), rates(place), strict=True):
            integral = (Polynomial(rate) ** 2).integ() * 70e3 * stiffness * 1e-12
            expected += integral(ends[1]) - integral(ends[0])
    assert w @ (effect.stiffness(plate) @ w) == pytest.approx(expected, rel=1e-10)


def test_energy_of_supports_between_grid_points() -> None:
    plate = Plate(UNEVEN_X, UNEVEN_Y, 6.0, 70e3, 0.33)
    w = degrees(plate.x, plate.y, cubic)
    points = ((10.0, -80.0), (151.0, 17.0), (300.0, 50.0))
    expected = sum(2e4 * cubic(*point)[0] ** 2 for point in points)
    effect = Supports(kind="supports", part="a", points=points, stiffness_per_point=2e4)
    assert w @ (effect.stiffness(plate) @ w) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("at", [(0.0, -90.0), (300.0, 50.0), (110.0, 0.0), (151.0, 17.0)])
def test_a_point_is_read_from_the_unknowns(at: tuple[float, float]) -> None:
    plate = Plate(UNEVEN_X, UNEVEN_Y, 6.0, 70e3, 0.33)
    w = degrees(plate.x, plate.y, cubic)
    for value, order in zip(cubic(*at), [(0, 0), (1, 0), (0, 1), (1, 1)], strict=True):
        assert (plate.evaluate(*at, *order) @ w)[0] == pytest.approx(value, rel=1e-9, abs=1e-12)
