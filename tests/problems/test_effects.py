"""Each effect's one term, and that an effect which no scene names takes no part."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joints import make_joint, make_scene
from pydantic import ValidationError

from problems.build import load_case, prepared
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import SHIFT, InitialGap
from problems.effects.initial_gap import _square_root as square_root
from problems.effects.pressure import Pressure
from problems.model.joint import Joint

PART = {"north": {"length": 90.0, "elements": 2}, "clamped": ["north"]}
JOINT = make_joint(PART, PART | {"name": "b"}, nodes=(9, 5))
POINT = st.tuples(st.floats(0, 400), st.floats(0, 120))


def field_of(seed: int, joint: Joint = JOINT, sd: float = 0.2, length: float = 150.0) -> np.ndarray:
    random = {"sd": sd, "correlation_length": length, "seed": seed}
    return InitialGap.model_validate({"kind": "initial_gap", "mean": 0.6, "random": random}).gap(joint)


@given(st.lists(POINT, min_size=1, max_size=6))
@settings(deadline=None)
def test_fastener_acts_on_the_nearest_node(points: list[tuple[float, float]]) -> None:
    f = Fasteners(kind="fasteners", preload=700.0, points=tuple(points)).force(JOINT)
    on_a, on_b = f[:45], f[45:]
    assert on_a.sum() == pytest.approx(700.0 * len(points))
    np.testing.assert_array_equal(on_b, -on_a)  # equilibrium, node for node
    nodes = np.array([(50.0 * ix, 30.0 * iy) for iy in range(5) for ix in range(9)])
    loaded = nodes[on_a > 0]
    for point in points:
        nearest = np.linalg.norm(nodes - point, axis=1).min()
        assert np.linalg.norm(loaded - point, axis=1).min() <= nearest + 1e-9
        assert nearest <= np.hypot(25.0, 15.0)


def test_fastener_closes_the_gap() -> None:
    """The sign: without contact the parts come closer, x_a − x_b > 0."""
    scene = make_scene(JOINT, Fasteners(kind="fasteners", preload=10.0, points=((200.0, 60.0),)))
    made = prepared(scene)
    approach = made.assembly.A.T @ made.assembly.K.solve(load_case(scene).f)
    assert (approach > 0).all()


def test_fastener_on_a_tool_has_no_counterpart() -> None:
    joint = make_joint(PART, contacts=[["a", "tool"]], nodes=(9, 5))
    f = Fasteners(kind="fasteners", preload=10.0, points=((0.0, 0.0),)).force(joint)
    assert f.tolist() == [10.0] + 44 * [0.0]


def test_pattern_spreads_evenly_up_to_the_edge() -> None:
    made = Fasteners.model_validate(
        {"kind": "fasteners", "preload": 1.0, "pattern": {"columns": 4, "rows": 3, "edge": 20.0}}
    )
    expected = [(x, y) for y in (20.0, 60.0, 100.0) for x in (20.0, 140.0, 260.0, 380.0)]
    np.testing.assert_allclose(made.marks(JOINT), expected)
    single = Fasteners.model_validate(
        {"kind": "fasteners", "preload": 1.0, "pattern": {"columns": 1, "rows": 1, "edge": 20.0}}
    )
    np.testing.assert_allclose(single.marks(JOINT), [(200.0, 60.0)])


@pytest.mark.parametrize(
    ("rows", "edge", "most"), [(1, 200.0, None), (1, 201.0, "200 mm"), (2, 60.0, None), (2, 61.0, "60 mm")]
)
def test_the_edge_of_a_pattern_is_bounded_along_its_rows_and_columns(
    rows: int, edge: float, most: str | None
) -> None:
    """On 400 × 120 mm: a single row stands in the middle, whatever the edge."""
    pattern = {"columns": 4, "rows": rows, "edge": edge}
    made = Fasteners.model_validate({"kind": "fasteners", "preload": 1.0, "pattern": pattern})
    said = [allowed for _, _, allowed in made.faults(JOINT)]
    assert said == ([f"at most half the junction, {most}"] if most else [])


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
    root, mirrored = (
        square_root(grid.tobytes(), length),
        square_root((4000.0 - grid[::-1]).tobytes(), length)[::-1, ::-1],
    )
    Z = np.random.default_rng(5).standard_normal((258, 20))
    np.testing.assert_allclose(mirrored @ Z, root @ Z, rtol=0, atol=1e-9)
    C = np.exp(-0.5 * ((grid[:, None] - grid) / length) ** 2)
    np.testing.assert_allclose(root @ root, C, rtol=0, atol=1.1 * SHIFT * np.linalg.norm(C, 2))
