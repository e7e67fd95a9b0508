"""Effects on gaps and forces at the junction: measured gap, shims, tool, clamps, files of positions."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joints import make_joint

from problems.effects.clamps import Clamps
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import InitialGap
from problems.effects.measured_gap import MeasuredGap
from problems.effects.rigid_tool import RigidTool
from problems.effects.shims import Shims
from problems.model.effect_tables import EffectTable

PART = {"north": {"length": 90.0, "elements": 2}, "clamped": ["north"]}
THREE = make_joint(PART, PART | {"name": "b"}, PART | {"name": "c"}, nodes=(9, 5))
TWO = make_joint(PART, PART | {"name": "b"}, nodes=(9, 5))
ON_TOOL = make_joint(PART, contacts=[["a", "tool"]], nodes=(9, 5))
SCATTERED = st.lists(
    st.tuples(st.floats(1, 399), st.floats(1, 119)).map(lambda p: (round(p[0], 1), round(p[1], 1))),
    max_size=12,
    unique=True,
)
CORNERS = [(0.0, 0.0), (400.0, 0.0), (0.0, 120.0), (400.0, 120.0)]


@given(SCATTERED, st.floats(-1, 1), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01))
@settings(deadline=None, max_examples=40)
def test_a_measured_plane_is_met_exactly(
    inner: list[tuple[float, float]], a: float, b: float, c: float
) -> None:
    points = tuple((x, y, a + b * x + c * y) for x, y in CORNERS + inner)
    g = MeasuredGap(kind="measured_gap", points=points).gap(TWO)
    x, y = TWO.nodes.T
    np.testing.assert_allclose(g, a + b * x + c * y, atol=1e-10)


def test_beyond_the_measured_points_the_nearest_one_counts() -> None:
    points = ((100.0, 30.0, 0.1), (300.0, 30.0, 0.3), (200.0, 90.0, 0.2))
    g = MeasuredGap(kind="measured_gap", points=points).gap(TWO).reshape(5, 9)
    assert (g[0, 0], g[0, -1], g[-1, 4]) == (0.1, 0.3, 0.2)


def test_a_gap_between_two_named_parts_leaves_the_others() -> None:
    pair = ("b", "c")
    for effect in (
        InitialGap(kind="initial_gap", mean=0.5, between=pair),
        MeasuredGap(kind="measured_gap", points=tuple((x, y, 0.5) for x, y in CORNERS), between=pair),
        Shims(kind="shims", thickness=0.5, x=(0, 400), y=(0, 120), between=pair),
    ):
        g = effect.gap(THREE)
        assert abs(g).tolist() == 45 * [0.0] + 45 * [0.5]


def test_a_random_gap_of_one_contact_is_that_of_a_joint_with_this_contact_alone() -> None:
    random = {"sd": 0.2, "correlation_length": 100.0, "seed": 5}
    data = {"kind": "initial_gap", "mean": 0.6, "random": random}
    alone = InitialGap.model_validate(data).gap(TWO)
    named = InitialGap.model_validate(data | {"between": ["b", "c"]}).gap(THREE)
    np.testing.assert_array_equal(named[45:], alone)
    both = InitialGap.model_validate(data).gap(THREE)  # each contact has a field of its own
    assert abs(both[:45] - both[45:]).max() > 0.05


def test_shims_fill_their_rectangle_borders_included() -> None:
    g = Shims(kind="shims", thickness=0.3, x=(50, 150), y=(30, 60)).gap(TWO).reshape(5, 9)
    expected = np.zeros((5, 9))
    expected[1:3, 1:4] = -0.3
    np.testing.assert_array_equal(g, expected)


def test_a_tool_is_a_parabola_about_its_crest() -> None:
    tool = RigidTool(kind="rigid_tool", part="a", distance=0.2, curvature=(2e-6, -1e-5))
    g = tool.gap(ON_TOOL).reshape(5, 9)
    assert g[2, 4] == pytest.approx(0.2)
    assert g[2, 0] == pytest.approx(0.2 + 1e-6 * 200**2)
    assert g[0, 4] == pytest.approx(0.2 - 0.5e-5 * 60**2)
    assert g[-1, -1] == pytest.approx(0.2 + 1e-6 * 200**2 - 0.5e-5 * 60**2)
    moved = tool.model_copy(update={"crest": (100.0, 0.0)}).gap(ON_TOOL).reshape(5, 9)
    assert moved[0, 2] == pytest.approx(0.2)
    assert moved[-1, -1] == pytest.approx(0.2 + 1e-6 * 300**2 - 0.5e-5 * 120**2)


def test_a_clamp_spreads_its_force_evenly_under_its_pad() -> None:
    f = Clamps(kind="clamps", clamping_force=900.0, radius=51.0, points=((199.0, 61.0), (0.0, 0.0))).force(
        TWO
    )
    on_a = f[:45].reshape(5, 9)
    np.testing.assert_array_equal(f[45:], -f[:45])
    assert on_a.sum() == pytest.approx(1800.0)
    # Around the middle node: itself, ±50 in x, ±30 in y; the diagonal is 58 mm away.
    np.testing.assert_allclose(on_a[[2, 2, 2, 1, 3], [4, 3, 5, 4, 4]], 180.0)
    # In the corner the pad meets three nodes only, and bears the same force.
    np.testing.assert_allclose(on_a[[0, 0, 1], [0, 1, 0]], 300.0)


def test_a_clamp_smaller_than_the_mesh_is_a_fastener() -> None:
    point = ((120.0, 100.0),)
    clamp = Clamps(kind="clamps", clamping_force=40.0, radius=1.0, points=point)
    fastener = Fasteners(kind="fasteners", preload=40.0, points=point)
    np.testing.assert_array_equal(clamp.force(THREE), fastener.force(THREE))


def test_a_fastener_through_a_stack_presses_its_outer_parts_alone() -> None:
    through = Fasteners(kind="fasteners", preload=40.0, points=((200.0, 60.0),))
    f = through.force(THREE).reshape(3, 45)
    assert f[:, 22].tolist() == [40.0, 0.0, -40.0]
    short = through.model_copy(update={"between": ("a", "b")}).force(THREE).reshape(3, 45)
    assert short[:, 22].tolist() == [40.0, -40.0, 0.0]


def test_positions_from_a_file_are_those_of_the_list(tmp_path: Path) -> None:
    (tmp_path / "rivets.csv").write_text("hole,x,y\n1,100,30\n\n2, 250.5 ,90\n")
    data = {"kind": "fasteners", "preload": 7.0}
    listed = Fasteners.model_validate(data | {"points": [[100, 30], [250.5, 90]]})
    table = EffectTable(tmp_path / "scene.toml", 0, data | {"file": "rivets.csv"})
    assert list(table.read()) == []
    assert table.effect == listed
