"""The estimated mesh error of a gap, beside references on finer meshes."""

import numpy as np
import pytest

from harness import load_scene, own_matrices, solve
from harness.scene.mesh_error import estimated, mesh_record, on_mesh, remeshed
from harness.scene.solution import Solution
from problems.model.scene import JointScene

STRIPS = {
    "junction": {"length": 300.0, "width": 60.0, "nodes": [21, 5]},
    "part": [
        {"name": name, "thickness": 3.0, "north": {"length": 60.0, "elements": 4}, "clamped": ["north"]}
        for name in ("upper", "lower")
    ],
}


def strips(*effects: dict[str, object]) -> Solution:
    gap = {"kind": "initial_gap", "mean": 0.5, "random": {"sd": 0.2, "correlation_length": 60, "seed": 3}}
    return solve({"title": "strips", "joint": STRIPS, "effect": [gap, *effects]}, form="sparse")


PLANS = {
    "fasteners at nodes": [{"kind": "fasteners", "preload": 400.0, "points": [[50, 30], [250, 30]]}],
    "fasteners between nodes": [
        {"kind": "fasteners", "preload": 400.0, "pattern": {"columns": 4, "rows": 2, "edge": 13}}
    ],
    "pressure": [
        {"kind": "pressure", "part": "upper", "value": 0.02},
        {"kind": "pressure", "part": "lower", "value": -0.02},
    ],
    "springs": [{"kind": "installed_fasteners", "approach": 0.4, "points": [[51, 22], [250, 31]]}],
}


@pytest.mark.parametrize("plan", PLANS)
def test_the_estimate_is_about_the_distance_to_a_far_finer_mesh(plan: str) -> None:
    found = strips(*PLANS[plan])
    two, three = estimated(found), estimated(found, refine=True)
    true, *_ = on_mesh(found, remeshed(found.problem.scene.joint, 4.0))
    assert (two.grids, two.order, three.grids) == (2, None, 3)
    assert true / 2 < three.error_mm < 2 * true
    assert true / 2 < two.error_mm < 20 * true  # rough, and rarely too small
    assert 0 < three.order < 4


def test_fasteners_on_nodes_stay_where_they_are_on_another_mesh() -> None:
    pattern = {"columns": 4, "rows": 2, "edge": 13, "on_nodes": True}
    found = strips({"kind": "fasteners", "preload": 400.0, "pattern": pattern})
    scene = found.problem.scene
    assert isinstance(scene, JointScene)
    _, other, _ = on_mesh(found, remeshed(scene.joint, 0.5))
    np.testing.assert_array_equal(other.marks(), scene.marks())


def test_a_coarser_mesh_keeps_the_sides_and_one_element_at_least() -> None:
    joint = load_scene("gallery/measured-gap").joint
    coarse = remeshed(joint, 0.5)
    assert coarse.junction.nodes == (31, 6)
    assert [part.north.elements for part in coarse.part] == [2, 2]
    assert (coarse.x[-1], coarse.y[-1]) == (joint.x[-1], joint.y[-1])
    assert remeshed(remeshed(coarse, 1e-3), 1e-3).junction.nodes == (2, 2)
    assert remeshed(joint, 2.0).junction.nodes == (121, 21)


def test_an_answer_without_a_coarser_mesh_says_so() -> None:
    single = {"junction": {"length": 300.0, "width": 60.0, "nodes": [2, 2]}, "part": STRIPS["part"]}
    gap = {"kind": "initial_gap", "mean": 0.5}
    assert estimated(solve({"joint": single, "effect": [gap]}, form="sparse")) is None
    given = own_matrices(np.eye(2), np.eye(2), [1.0, 2.0], [0.5, 3.0])
    assert mesh_record(estimated(solve(given))) == {"said": "Mesh error: not known here"}


def test_gaps_that_no_mesh_moves_leave_nothing_out() -> None:
    """Parts that nothing presses keep their gap on every mesh."""
    found = solve({"joint": STRIPS, "effect": [{"kind": "initial_gap", "mean": 0.5}]}, form="sparse")
    assert isinstance(found.problem.scene, JointScene)
    assert estimated(found).error_mm < 1e-12
    assert estimated(found, refine=True).error_mm < 1e-12


def test_gaps_that_a_coarser_mesh_does_not_see_count() -> None:
    """Closed on every second line, 0.05 mm between: at the nodes of the coarser mesh nothing moves."""
    x, y = np.meshgrid(np.linspace(0, 300, 21), np.linspace(0, 60, 5))
    between = np.logical_or(*np.indices(x.shape) % 2)
    points = np.column_stack([x.ravel(), y.ravel(), 0.05 * between.ravel()]).tolist()
    found = solve({"joint": STRIPS, "effect": [{"kind": "measured_gap", "points": points}]}, form="sparse")
    assert estimated(found).error_mm == pytest.approx(0.05)


def test_a_mesh_without_an_answer_costs_the_estimate_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    found = strips(*PLANS["pressure"])
    monkeypatch.setattr("harness.scene.mesh_error.candidate_forces", lambda *_: iter(()))
    assert estimated(found) is None
