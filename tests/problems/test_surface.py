"""Weights and areas of a surface through nodes: linear fields are met, areas add up, bays stay open."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.model.surface import Grid, Triangles, surface_of

LINES = np.array([0.0, 1.0, 3.0, 7.0, 8.5]), np.array([2.0, 5.0, 6.0])


def crossings(x: np.ndarray = LINES[0], y: np.ndarray = LINES[1]) -> np.ndarray:
    return np.column_stack([each.ravel() for each in np.meshgrid(x, y)])


def test_a_grid_is_found_in_any_order_of_its_nodes_and_apart_from_rounding() -> None:
    nodes = crossings()
    order = np.random.default_rng(1).permutation(len(nodes))
    for given_nodes in (
        nodes,
        nodes[order],
        nodes + 1e-9 * np.random.default_rng(2).uniform(-1, 1, nodes.shape),
    ):
        assert isinstance(surface_of(given_nodes), Grid)
    assert isinstance(surface_of(nodes[:-1]), Triangles)
    flanges = surface_of(crossings(np.array([0.0, 10, 20, 30, 70, 80, 90, 100]), np.arange(0.0, 110, 10)))
    np.testing.assert_array_equal(flanges.covers(np.array([[15.0, 55], [50, 50], [85, 0]])), [1, 0, 1])


@given(st.integers(0, 10_000), st.booleans())
@settings(deadline=None, max_examples=40)
def test_linear_fields_are_met_and_nodes_are_themselves(seed: int, scattered: bool) -> None:
    random = np.random.default_rng(seed)
    nodes = crossings()
    if scattered:
        turn = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])
        nodes = (nodes + random.uniform(-0.2, 0.2, nodes.shape)) @ turn
    surface = surface_of(nodes)
    np.testing.assert_array_equal(surface.weights(nodes).toarray(), np.eye(len(nodes)))
    points = 0.999 * random.dirichlet(np.ones(3), 50) + 0.001 / 3  # in triangles, more than SAME off edges
    corners = nodes[surface.triangles[random.integers(0, len(surface.triangles), 50)]]
    at = (points[:, :, None] * corners).sum(axis=1)
    W = surface.weights(at)
    assert surface.covers(at).all()
    assert (W.data > 0).all()
    fields = np.column_stack([np.ones(len(nodes)), nodes])
    np.testing.assert_allclose(W @ fields, np.column_stack([np.ones(50), at]), atol=1e-10)


def test_triangles_have_the_area_of_what_they_fill() -> None:
    nodes = np.random.default_rng(4).uniform(0, 1, (300, 2))
    nodes = np.concatenate([nodes, [[0, 0], [1, 0], [0, 1], [1, 1]]]) * [40.0, 20.0]
    x = np.linspace(0, 1, 20)[1:-1, None]
    border = np.concatenate([x * [40, 0], x * [40, 0] + [0, 20], x * [0, 20], x * [0, 20] + [40, 0]])
    surface = surface_of(np.concatenate([nodes, border]))
    assert surface.areas.sum() == pytest.approx(800.0)
    assert not surface.covers(np.array([[40.1, 10.0], [-1.0, 3.0]])).any()
    assert surface.weights(np.array([[40.1, 10.0]])).nnz == 0


def test_a_mesh_that_grows_coarser_keeps_its_triangles() -> None:
    """By a third from line to line, with elements five times as long as wide."""
    x = 5 * np.cumsum(1.33 ** np.arange(14))
    nodes = crossings(x, np.linspace(0, 30, 7))[:-1]  # without a corner it is no grid
    surface = surface_of(nodes)
    assert surface.areas.sum() == pytest.approx((x[-1] - x[0]) * 30 - (x[-1] - x[-2]) * 5 / 2)


@pytest.mark.parametrize(("moved", "missing"), [(0.0, []), (0.0, [40]), (0.3, [40])])
def test_the_order_of_the_nodes_changes_no_bit(moved: float, missing: list[int]) -> None:
    """In a grid, in one without a node, whose diagonals are free, and in scattered nodes."""
    random = np.random.default_rng(7)
    nodes = crossings(np.arange(12.0), np.arange(9.0)) + moved * random.uniform(-1, 1, (108, 2))
    nodes = np.delete(nodes, missing, axis=0)
    points, order = random.uniform(-0.5, 12, (400, 2)), random.permutation(len(nodes))
    plain, shuffled = surface_of(nodes), surface_of(nodes[order])
    np.testing.assert_array_equal(
        shuffled.weights(points).toarray(), plain.weights(points).toarray()[:, order]
    )
    np.testing.assert_array_equal(shuffled.areas, plain.areas[order])
    np.testing.assert_array_equal(shuffled.covers(points), plain.covers(points))


def test_a_missing_node_changes_the_elements_around_it_alone() -> None:
    """Elsewhere weights stay bilinear, and areas a quarter of each rectangle."""
    nodes = crossings(np.arange(12.0), 0.7 * np.arange(9.0))
    whole, holed = surface_of(nodes), surface_of(np.delete(nodes, 40, axis=0))
    x, y = np.random.default_rng(8).uniform([0, 0], [11, 5.6], (300, 2)).T
    points = np.column_stack([x, y])[(abs(x - 4) > 1) | (abs(y - 2.1) > 0.7)]
    wanted = np.delete(whole.weights(points).toarray(), 40, axis=1)
    np.testing.assert_allclose(holed.weights(points).toarray(), wanted, atol=1e-11)
    assert holed.areas.sum() == pytest.approx(whole.areas.sum())
    assert (abs(holed.areas - np.delete(whole.areas, 40)) > 1e-12).sum() == 8


@pytest.mark.parametrize("moved", [0.0, 0.3])
@pytest.mark.parametrize("long", [1.0, 4.0])
@pytest.mark.parametrize("count", [8, 11, 24])
@pytest.mark.parametrize("radius", [9.0, 24.0])
def test_a_round_hole_stays_open(radius: float, count: int, long: float, moved: float) -> None:
    """Nodes on a circle in a mesh of 6 mm, regular or not, its elements square or four times longer."""
    random = np.random.default_rng(9)
    nodes = crossings(np.arange(0, 151, 6 * long), np.arange(0, 121, 6.0))
    inner = ((nodes > 0) & (nodes < nodes.max(axis=0))).all(axis=1)
    nodes[inner] += 6 * moved * random.uniform(-1, 1, (inner.sum(), 2))
    assert surface_of(nodes[:-1]).covers(nodes).sum() >= len(nodes) - 1
    middle, angles = np.array([70.3, 61.8]), 0.3 + np.arange(count) * 2 * np.pi / count
    ring = middle + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    away = np.linalg.norm(nodes - middle, axis=1)
    near = max(3.0, 2 * radius * np.sin(np.pi / count) * 0.6)  # the first elements are no flatter
    surface = surface_of(np.concatenate([nodes[away > radius + near], ring]))
    filled = np.prod(nodes.max(axis=0)) - count / 2 * radius**2 * np.sin(2 * np.pi / count)
    assert surface.areas.sum() == pytest.approx(filled, rel=1e-9)
    inside = middle + 0.9 * np.outer(random.uniform(0, np.cos(np.pi / count), 50), [0.6, 0.8]) * radius
    assert not surface.covers(inside).any()


def test_rounded_coordinates_leave_no_weight_that_is_no_number() -> None:
    """Nodes of a border a little off its line make slivers, four of which may seem to lie on one circle."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        nodes = crossings(5 * np.arange(9.0), np.arange(13.0))[:-1]
        surface = surface_of(nodes + random.uniform(-1, 1, nodes.shape) * 10.0 ** (-7 + seed % 4))
        t = np.linspace(0, 1, 101)
        south, west = np.outer(t, [40, 0]), np.outer(t, [0, 12])
        ends = np.concatenate([south, west, south + np.array([0, 12])])
        assert np.isfinite(surface.weights(ends).data).all()
        assert surface.areas.sum() == pytest.approx(477.5, rel=1e-3)


def test_nodes_on_a_line_are_no_surface() -> None:
    line = np.linspace(0, 9, 10)[:, None] * [1.0, 2.0]
    with pytest.raises(ValueError, match="one line"):
        surface_of(line)
