"""Condensed parts: their nodes, what is refused, and contact against beam theory."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from joints import make_joint, make_scene
from numpy.typing import NDArray
from small import solve_by_nnls

from problems.build import prepared
from problems.effects.supports import Supports
from problems.errors import InputError
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.model.condense import NotPositiveDefinite, condense

SHORT, LONG = {"length": 90.0, "elements": 2}, {"length": 250.0, "elements": 4}
PARTS: list[dict[str, Any]] = [
    {"north": SHORT, "clamped": ["north"]},
    {"south": SHORT, "clamped": ["south"]},
    {"south": LONG, "north": SHORT, "clamped": ["north"]},
]


def test_nodes_stand_in_the_order_of_the_unknowns() -> None:
    """By lines of ascending y, whichever the direction of elimination."""
    for part in PARTS:
        joint = make_joint(part, contacts=[["a", "tool"]], nodes=(7, 5))
        made = prepared(make_scene(joint))
        nodes = [(400.0 * ix / 6, 120.0 * iy / 4) for iy in range(5) for ix in range(7)]
        np.testing.assert_allclose(made.assembly.nodes, nodes)
        flexibility = made.assembly.K.solve(np.eye(35))
        # the part is built in at one edge: the mean flexibility falls towards it
        by_line = np.diag(flexibility).reshape(5, 7).mean(axis=1)
        assert (by_line[0] > by_line[-1]) == ("north" in part["clamped"])


def test_a_motion_without_energy_is_refused() -> None:
    spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = sp.csr_array(sp.block_diag([spring, np.eye(2)]))
    with pytest.raises(NotPositiveDefinite):
        condense(K, [np.array([0, 1]), np.array([2, 3])], np.array([False, False, False, True]))


@pytest.mark.parametrize("points", [(), ((30.0, 20.0), (130.0, 40.0), (330.0, 80.0))])  # on one line
def test_a_part_that_floats_is_refused(points: tuple[tuple[float, float], ...]) -> None:
    joint = make_joint({"south": LONG}, contacts=[["a", "tool"]])
    effects = [Supports(kind="supports", part="a", points=points)] if points else []
    with pytest.raises(InputError, match="held against every rigid motion"):
        _ = prepared(make_scene(joint, *effects)).assembly.K.factors


# --- A narrow clamped strip along y, pressed on a flat obstacle -----------------------------------------

LENGTH, ELEMENTS, WIDTH, GAP = 1000.0, 100, 20.0, 1.0
H = LENGTH / ELEMENTS
EI = 70e3 * WIDTH * 6.0**3 / 12
FIRST_TOUCH = 384 * EI * GAP / LENGTH**4


@pytest.fixture(scope="module")
def strip() -> Prepared:
    end = {"length": H, "elements": 1}
    joint = make_joint(
        {"poisson": 0.0, "south": end, "north": end, "clamped": ["south", "north"]},
        contacts=[["a", "tool"]],
        length=WIDTH,
        width=LENGTH - 2 * H,
        nodes=(2, ELEMENTS - 1),
    )
    return prepared(make_scene(joint))


def pressed(strip: Prepared, q: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Deflection and contact force of each node line under q N/mm."""
    load = LoadCase(np.full(strip.assembly.n, q * H / 2), np.full(strip.assembly.m, GAP))
    x, lam = solve_by_nnls(strip, load)
    assert (lam >= 0).all()
    assert (load.g - strip.assembly.A.T @ x >= -1e-9).all()
    return x.reshape(-1, 2).mean(axis=1), lam.reshape(-1, 2).sum(axis=1)


def test_strip_touches_at_the_load_of_beam_theory(strip: Prepared) -> None:
    w, force = pressed(strip, 0.995 * FIRST_TOUCH)
    assert force.max() == 0
    assert w.max() == pytest.approx(0.995 * GAP, rel=1e-3)
    _, force = pressed(strip, 1.005 * FIRST_TOUCH)
    assert np.flatnonzero(force).tolist() == [ELEMENTS // 2 - 1]


@pytest.mark.parametrize("times", [1.2, 2.0, 2.9])
def test_reaction_in_point_contact(strip: Prepared, times: float) -> None:
    q = times * FIRST_TOUCH
    _, force = pressed(strip, q)
    assert np.flatnonzero(force).tolist() == [ELEMENTS // 2 - 1]
    assert force.sum() == pytest.approx(q * LENGTH / 2 - 192 * EI * GAP / LENGTH**3, rel=2e-3)
