"""Each effect's one term: gaps, forces at the junction, files of positions."""

import tracemalloc
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from small_joints import JOINT, PART, make_joint, make_scene

from problems.effects.clamps import Clamps
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import SHIFT, InitialGap, square_root
from problems.effects.installed_fasteners import InstalledFasteners
from problems.effects.measured_gap import MeasuredGap
from problems.effects.part_position import PartPosition
from problems.effects.pressure import Pressure
from problems.effects.rigid_tool import RigidTool
from problems.effects.shims import Shims
from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector
from problems.model.effect import ForceEffect, PartEffect, StiffnessEffect
from problems.model.fastener_forces import fastener_forces, force_error
from problems.model.interface import AnyJoint
from problems.model.joint import Joint
from problems.model.springs import Springs

POINT = st.tuples(st.floats(0, 400), st.floats(0, 120))
THREE = make_joint(PART, PART | {"name": "b"}, PART | {"name": "c"}, nodes=(9, 5))
ON_TOOL = make_joint(PART, contacts=[["a", "tool"]], nodes=(9, 5))
SCATTERED = st.lists(
    st.tuples(st.floats(1, 399), st.floats(1, 119)).map(lambda p: (round(p[0], 1), round(p[1], 1))),
    max_size=12,
    unique=True,
)
CORNERS = [(0.0, 0.0), (400.0, 0.0), (0.0, 120.0), (400.0, 120.0)]


@given(st.lists(POINT, min_size=1, max_size=6))
@settings(deadline=None, max_examples=40)
def test_a_fastener_acts_where_it_is(points: list[tuple[float, float]]) -> None:
    f = Fasteners(kind="fasteners", preload=700.0, points=tuple(points)).force(JOINT)
    on_a, on_b = f[:45], f[45:]
    np.testing.assert_array_equal(on_b, -on_a)  # equilibrium, node for node
    assert (on_a >= 0).all()
    fields = np.column_stack([np.ones(45), JOINT.nodes, JOINT.nodes.prod(axis=1)])  # 1, x, y, xy
    at = np.array(points)
    there = np.column_stack([np.ones(len(at)), at, at.prod(axis=1)]).sum(axis=0)
    np.testing.assert_allclose(on_a @ fields, 700 * there, rtol=1e-12, atol=700 * 400 * 120 * 2e-12)
    far = (abs(JOINT.nodes[:, None] - at) > (50.0, 30.0)).any(axis=2).all(axis=1)
    assert not on_a[far].any()  # on the nodes of its element alone


def test_nothing_acts_beyond_the_junction() -> None:
    with pytest.raises(InputError, match=r"point = \[400.1, 9.0\]: on the parts"):
        Fasteners(kind="fasteners", preload=1.0, points=((9.0, 9.0), (400.1, 9.0))).force(JOINT)


def test_fasteners_of_many_preloads_are_weighted_once_on_each_part(monkeypatch: pytest.MonkeyPatch) -> None:
    points, preloads = ((10.0, 10.0), (90.0, 30.0), (370.0, 100.0)), (5.0, 7.0, 11.0)
    alone = (
        Fasteners(kind="fasteners", points=(p,), preload=n) for p, n in zip(points, preloads, strict=True)
    )
    wanted, asked = sum(one.force(JOINT) for one in alone), list[str]()

    def deflection(self: Joint, part: str, points: Matrix, along: str = "") -> Any:
        asked.append(part)
        return self.weights(points)

    monkeypatch.setattr(Joint, "deflection", deflection)
    f = Fasteners(kind="fasteners", points=points, preload=preloads).force(JOINT)
    np.testing.assert_allclose(f, wanted, rtol=0, atol=1e-13)
    assert asked == ["a", "b"]


def test_a_part_between_two_opens_one_gap_and_closes_the_other() -> None:
    """And parts that are all off by the same have the gaps that they would have in their places."""
    table = {"kind": "part_position", "shift": 0.2, "slope_y": 1e-3}
    a, b, c = (PartPosition.model_validate(table | {"part": name}).gap(THREE) for name in "abc")
    r = 0.2 + 1e-3 * (THREE.nodes[:, 1] - 60.0)
    np.testing.assert_allclose(b, [*r, *-r], rtol=1e-14)
    np.testing.assert_allclose(a + b + c, np.zeros(90), atol=1e-15)


def patterned(**pattern: float) -> Fasteners:
    return Fasteners.model_validate({"kind": "fasteners", "preload": 1.0, "pattern": pattern})


def test_pattern_spreads_evenly_up_to_the_edge() -> None:
    made = patterned(columns=4, rows=3, edge=20.0)
    expected = [(x, y) for y in (20.0, 60.0, 100.0) for x in (20.0, 140.0, 260.0, 380.0)]
    np.testing.assert_allclose(made.marks(JOINT), expected)
    np.testing.assert_allclose(patterned(columns=1, rows=1, edge=20.0).marks(JOINT), [(200.0, 60.0)])


def test_a_pattern_has_no_more_points_than_a_structure() -> None:
    with pytest.raises(ValidationError, match="at most 10000 points"):
        patterned(columns=10_000, rows=2)


def test_a_pattern_on_nodes_has_the_nearest_of_each_axis() -> None:
    free, moved = (patterned(columns=7, rows=3, edge=20.0, on_nodes=on) for on in (False, True))
    x, y = (np.array(sorted(set(free.marks(JOINT)[:, axis]))) for axis in (0, 1))
    nearest = [
        [min(grid, key=lambda line: abs(line - at)) for at in own]
        for own, grid in ((x, JOINT.x), (y, JOINT.y))
    ]
    np.testing.assert_array_equal(moved.marks(JOINT), [(a, b) for b in nearest[1] for a in nearest[0]])
    assert set(moved.force(JOINT)[:45]) == {0.0, 1.0}
    keys = {make_scene(JOINT, effect).key for effect in (free, moved)}
    assert len(keys) == 2
    assert Fasteners.model_validate(moved.model_dump()) == moved  # as `--sweep` makes it anew


@pytest.mark.parametrize(
    ("rows", "edge", "most"), [(1, 199.0, None), (1, 200.0, "200 mm"), (2, 59.0, None), (2, 60.0, "60 mm")]
)
def test_the_edge_of_a_pattern_is_bounded_along_its_rows_and_columns(
    rows: int, edge: float, most: str | None
) -> None:
    """On 400 × 120 mm: a single row stands in the middle, whatever the edge."""
    said = [allowed for _, _, allowed in patterned(columns=4, rows=rows, edge=edge).faults(JOINT)]
    assert said == ([f"less than half the junction, {most}"] if most else [])


@pytest.mark.parametrize("extra", [{}, {"points": [[1.0, 1.0]], "pattern": {"columns": 1, "rows": 1}}])
def test_fasteners_by_points_or_by_a_pattern(extra: dict[str, object]) -> None:
    with pytest.raises(ValidationError, match="one of points, file and pattern"):
        Fasteners.model_validate({"kind": "fasteners", "preload": 1.0} | extra)


def test_pressure_sums_to_value_times_area() -> None:
    f = Pressure(kind="pressure", part="b", value=-0.003).force(JOINT)
    assert f[:45].tolist() == 45 * [0.0]
    assert f[45:].sum() == pytest.approx(-0.003 * 400 * 120, rel=1e-12)
    grid = f[45:].reshape(5, 9)
    cell = -0.003 * 50 * 30
    assert grid[2, 4] == pytest.approx(cell)
    assert grid[0, 4] == grid[2, 0] == pytest.approx(cell / 2)
    assert grid[-1, -1] == pytest.approx(cell / 4)


@pytest.mark.parametrize("length", [30.0, 800.0])
def test_rounding_does_not_change_a_random_gap(length: float) -> None:
    """A grid and its mirror image, whose rounding differs: of one field the gaps differ by some 1e-10 of its
    deviation, where roots of eigenvalues near zero differ by 1e-8.
    """
    grid = np.linspace(0.0, 4000.0, 258)
    root = square_root(grid.tobytes(), length)
    mirrored = square_root((4000.0 - grid[::-1]).tobytes(), length)[::-1, ::-1]
    Z = np.random.default_rng(5).standard_normal((258, 20))
    np.testing.assert_allclose(mirrored @ Z, root @ Z, rtol=0, atol=1e-9)
    C = np.exp(-0.5 * ((grid[:, None] - grid) / length) ** 2)
    np.testing.assert_allclose(root @ root, C, rtol=0, atol=1.1 * SHIFT * np.linalg.norm(C, 2))


@given(SCATTERED, st.floats(-1, 1), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01))
@settings(deadline=None, max_examples=40)
def test_a_measured_plane_is_met_exactly(
    inner: list[tuple[float, float]], a: float, b: float, c: float
) -> None:
    points = tuple((x, y, a + b * x + c * y) for x, y in CORNERS + inner)
    g = MeasuredGap(kind="measured_gap", points=points).gap(JOINT)
    x, y = JOINT.nodes.T
    np.testing.assert_allclose(g, a + b * x + c * y, atol=1e-10)


def test_beyond_the_measured_points_the_nearest_one_counts() -> None:
    points = ((100.0, 30.0, 0.1), (300.0, 30.0, 0.3), (200.0, 90.0, 0.2))
    g = MeasuredGap(kind="measured_gap", points=points).gap(JOINT).reshape(5, 9)
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
    alone = InitialGap.model_validate(data).gap(JOINT)
    named = InitialGap.model_validate(data | {"between": ["b", "c"]}).gap(THREE)
    np.testing.assert_array_equal(named[45:], alone)
    both = InitialGap.model_validate(data).gap(THREE)  # each contact has a field of its own
    assert abs(both[:45] - both[45:]).max() > 0.05


def test_shims_fill_their_rectangle_borders_included() -> None:
    g = Shims(kind="shims", thickness=0.3, x=(50, 150), y=(30, 60)).gap(JOINT).reshape(5, 9)
    expected = np.zeros((5, 9))
    expected[1:3, 1:4] = -0.3
    np.testing.assert_array_equal(g, expected)


@pytest.mark.parametrize(("length", "count", "x"), [(120.0, 51, (7.2, 24.0)), (110.0, 101, (0.0, 6.6))])
def test_borders_are_included_where_nodes_are_rounded(
    length: float, count: int, x: tuple[float, float]
) -> None:
    joint = make_joint(PART, PART | {"name": "b"}, length=length, nodes=(count, 3))
    step = length / (count - 1)
    assert not {*x} - {0.0} <= {*joint.nodes[:, 0]}  # a border is beside its nodes, by rounding
    even = Shims(kind="shims", thickness=0.3, x=x, y=(0, 120)).gap(joint).reshape(3, count)
    first, last = round(x[0] / step), round(x[1] / step)
    np.testing.assert_array_equal(np.flatnonzero(even[0]), np.arange(first, last + 1))
    ramp = Shims(kind="shims", thickness=(0.1, 0.3), x=x, y=(0, 5)).gap(joint).reshape(3, count)[0]
    assert -0.3 <= ramp.min() < ramp[first] == -0.1


def test_shims_that_touch_fill_no_contact_twice() -> None:
    """Rectangles that share a border or a corner at a node are refused, outlines add up to an even sheet."""

    def shims(x: tuple[float, float], y: tuple[float, float], **more: Any) -> Shims:
        return Shims.model_validate({"kind": "shims", "thickness": 0.2, "x": x, "y": y} | more)

    def outlined(shim: Shims) -> Shims:
        (west, east), (south, north) = shim.ranges.tolist()
        corners = (west, south), (east, south), (east, north), (west, north)
        return Shims(kind="shims", thickness=0.2, outline=corners)

    west, east = shims((0, 150), (0, 120)), shims((150, 400), (0, 120))
    touching = [(west, east), (outlined(west), east), (west, shims((50, 400), (120, 130)))]
    for one, other in [*touching, (shims((0, 150), (0, 60)), shims((150, 400), (60, 120)))]:
        for ((_, _, allowed),) in (one.faults(JOINT, [other]), other.faults(JOINT, [one])):
            assert "no common border with other shims" in allowed
    inside, beyond = shims((0, 50), (0, 60)), shims((151, 400), (0, 120))
    for other in (shims((100, 400), (0, 120)), beyond, inside, outlined(east)):
        assert not [*outlined(west).faults(JOINT, [other]), *other.faults(JOINT, [outlined(west)])]
    even = outlined(west).gap(JOINT) + outlined(east).gap(JOINT)
    np.testing.assert_array_equal(even, np.full(45, -0.2))
    above = shims((0, 150), (0, 120), between=("a", "b"))
    assert not [*above.faults(THREE, [shims((150, 400), (0, 120), between=("b", "c"))])]


def test_an_outline_of_many_corners_takes_little_memory() -> None:
    """Of 2000 corners on a circle; all places times corners at once took 0.5 GB."""
    angle = 2 * np.pi * np.arange(2000) / 2000
    corners = np.column_stack([200 + 50 * np.cos(angle), 60 + 50 * np.sin(angle)])
    shim = Shims(kind="shims", thickness=0.2, outline=tuple(map(tuple, corners.tolist())))
    places = np.random.default_rng(0).uniform((140, 0), (260, 120), (5000, 2))
    tracemalloc.start()
    try:
        covered = shim.covers(places, JOINT)
        assert tracemalloc.get_traced_memory()[1] < 64 * 2**20
    finally:
        tracemalloc.stop()
    distance = np.linalg.norm(places - (200, 60), axis=1)
    sure = abs(distance - 50) > 1e-3
    np.testing.assert_array_equal(covered[sure], distance[sure] < 50)


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
    fine = make_joint(PART, PART | {"name": "b"}, nodes=(81, 25))
    clamp = Clamps(kind="clamps", clamping_force=900.0, radius=40.0, points=((199.0, 61.0),))
    f = clamp.force(fine).reshape(2, -1)
    np.testing.assert_array_equal(f[1], -f[0])
    x, y = fine.nodes.T - np.array([[199.0], [61.0]])
    assert f[0].sum() == pytest.approx(900.0)
    assert abs(f[0] @ np.column_stack([x, y])).max() < 1e-9
    for second in (x * x, y * y):  # ∫ of a uniform pressure on a disc: F R²/4
        assert f[0] @ second == pytest.approx(900.0 * 40.0**2 / 4, rel=0.03)
    assert not f[0][np.hypot(x, y) > 40 + np.hypot(5, 5)].any()
    # In the corner a quarter of the pad bears the same force.
    corner = clamp.model_copy(update={"points": ((0.0, 0.0),)}).force(fine)[: fine.node_count]
    assert corner.sum() == pytest.approx(900.0)
    np.testing.assert_allclose(corner @ fine.nodes, 900.0 * 4 * 40.0 / (3 * np.pi), rtol=0.02)


def test_a_small_clamp_is_a_fastener() -> None:
    point = ((120.0, 100.0),)
    clamp = Clamps(kind="clamps", clamping_force=40.0, radius=1e-3, points=point)
    fastener = Fasteners(kind="fasteners", preload=40.0, points=point)
    np.testing.assert_allclose(clamp.force(THREE), fastener.force(THREE), atol=1e-12)


def test_a_fastener_through_a_stack_presses_its_outer_parts_alone() -> None:
    through = Fasteners(kind="fasteners", preload=40.0, points=((200.0, 60.0),))
    f = through.force(THREE).reshape(3, 45)
    assert f[:, 22].tolist() == [40.0, 0.0, -40.0]
    short = through.model_copy(update={"between": ("a", "b")}).force(THREE).reshape(3, 45)
    assert short[:, 22].tolist() == [40.0, -40.0, 0.0]


def test_a_parameter_that_hides_a_method_is_refused_where_its_class_is_written() -> None:
    with pytest.warns(UserWarning, match="shadows"), pytest.raises(TypeError, match=r"Pads\.stiffness: call"):

        class Pads(StiffnessEffect):
            stiffness: float  # type: ignore[assignment]


def test_a_preload_elsewhere_than_at_points_is_no_fastener() -> None:
    class Plungers(PartEffect, ForceEffect):
        preload: float

        def force(self, joint: AnyJoint) -> Vector:
            return np.full(joint.size[0], self.preload)

    press = Plungers(kind="plungers", part="a", preload=3.0)
    fasteners = Fasteners(kind="fasteners", preload=(5.0, 7.0), points=((10.0, 10.0), (90.0, 10.0)))
    entries = fastener_forces(make_scene(JOINT, press, fasteners), np.zeros(JOINT.size[0]))
    assert [entry["force_N"] for entry in entries] == [5.0, 7.0]


def test_the_error_of_a_spring_s_force_is_that_of_x_and_of_rounding() -> None:
    """Against fractions, of an x that is exact, and of one that is off by a known error."""
    points = ((50.0, 30.0), (200.0, 60.1), (333.3, 10.0))
    rivets = InstalledFasteners(
        kind="installed_fasteners", stiffness=1e5 / 3, approach=0.7, preload=0.1, points=points
    )
    scene, x = make_scene(JOINT, rivets), np.random.default_rng(0).standard_normal(JOINT.size[0])
    springs, off = Springs.of(scene), []
    for j, found in enumerate(fastener_forces(scene, x)):
        t = springs.T[:, [j]].toarray().ravel()
        reached = sum(Fraction(t[i]) * Fraction(x[i]) for i in np.flatnonzero(t))
        exact = Fraction(0.1) + Fraction(springs.k[j]) * (Fraction(0.7) - reached)
        off.append(abs(Fraction(found["force_N"]) - exact))
    assert 0 < max(off) <= force_error(springs, scene, x, 0.0) < 1e-9
    assert 1e5 / 3 * 2e-3 <= force_error(springs, scene, x, 1e-3) <= 1.02 * 1e5 / 3 * 2e-3
    assert force_error(springs, scene, x, np.inf) == np.inf
    assert force_error(Springs.of(make_scene(JOINT)), make_scene(JOINT), x, 1e-3) == 0
