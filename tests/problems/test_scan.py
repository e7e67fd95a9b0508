"""Random gaps that pass through a scan, against the conditional Gaussian distribution written out."""

import pickle
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal_of
from scipy.interpolate import RectBivariateSpline
from small_joints import JOINT, make_scene
from superelements import scene_from, write_plates

from problems.effects.measured_gap import MeasuredGap
from problems.errors import InputError
from problems.load_cases.gaps_through_scan import NOISE, Scan, square_root
from problems.load_cases.random_gaps import RandomGaps, random_gaps

SD, LENGTH, COUNT = 0.2, 120.0, 2000
SCAN = np.array([[0.0, 0.0, 0.5], [130.0, 41.0, 0.9], [133.0, 44.0, 0.95], [400.0, 120.0, 0.3]])


def cases(folder: Path, scan: np.ndarray = SCAN, **more: float) -> RandomGaps:
    path = folder / "scan.csv"
    path.write_text("x;y;gap\n" + "\n".join(";".join(f"{v}" for v in row) for row in scan.tolist()))
    return random_gaps(make_scene(JOINT), COUNT, 7, sd=SD, correlation_length=LENGTH, around=path, **more)


def test_mean_and_covariance_are_those_of_the_field_given_the_scan(tmp_path: Path) -> None:
    mean = 0.6
    drawn = np.array([cases_.load(k).g for cases_ in [cases(tmp_path, mean=mean)] for k in range(COUNT)])
    nodes, W = JOINT.nodes, JOINT.weights(SCAN[:, :2]).toarray()
    C = SD**2 * np.exp(-0.5 * ((nodes[:, None] - nodes) ** 2).sum(axis=2) / LENGTH**2)
    gain = C @ W.T @ np.linalg.inv(W @ C @ W.T + (NOISE * SD) ** 2 * np.eye(len(SCAN)))
    wanted, covariance = mean + gain @ (SCAN[:, 2] - mean), C - gain @ W @ C
    error = SD / np.sqrt(COUNT)
    assert abs(drawn.mean(axis=0) - wanted).max() < 4.5 * error
    assert abs(np.cov(drawn.T) - covariance).max() < 6 * SD * error
    assert covariance.diagonal().min() < 1e-3 * SD**2 < covariance.diagonal().max()


def test_every_case_passes_through_the_scan(tmp_path: Path) -> None:
    drawn = cases(tmp_path)
    W = JOINT.weights(SCAN[:, :2])
    for k in range(50):
        assert abs(W @ drawn.load(k).g - SCAN[:, 2]).max() < 6 * NOISE * SD
    assert drawn.field.mean == pytest.approx(SCAN[:, 2].mean())  # of the scan, if no other is given
    assert cases(tmp_path, mean=0.1).field.mean == 0.1


def test_on_superelements_too(tmp_path: Path) -> None:
    """At contacts that are not on the grid of the field, by the splines that interpolate it."""
    scene = scene_from(write_plates(tmp_path, JOINT))
    at = scene.joint.places(("a", "b"))[[3, 20, 22, 44]]
    length = 130.0
    assert abs(at[1, 0] - scene.joint.grid(length)[0]).min() > 1
    (tmp_path / "scan.csv").write_text(
        "x,y,gap\n" + "\n".join(f"{x!r},{y!r},{0.1 * k}" for k, (x, y) in enumerate(at.tolist()))
    )
    found = random_gaps(scene, 20, 7, sd=SD, correlation_length=length, around=tmp_path / "scan.csv")
    gaps = np.array([found.load(k).g for k in range(20)])
    assert abs(gaps[:, [3, 20, 22, 44]] - 0.1 * np.arange(4)).max() < 6 * NOISE * SD
    assert gaps.std(axis=0).max() > SD / 4


def test_a_scan_is_made_once_whatever_is_sent_to_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    monkeypatch.setattr(
        "problems.load_cases.gaps_through_scan.square_root",
        lambda *grid: made.append(grid) or square_root(*grid),
    )
    drawn = cases(tmp_path, SCAN + np.array([0.0, 0.0, 0.0123]))
    drawn.load(0)
    blocks = [pickle.dumps(drawn) for _ in range(2)]
    for k, block in enumerate(blocks):
        np.testing.assert_array_equal(pickle.loads(block).load(k).g, drawn.load(k).g)
    assert len(made) == 2  # along x and along y


def test_no_matrix_has_all_points_and_the_whole_grid(tmp_path: Path) -> None:
    """A fine grid on superelements, where 100 x 145 x 481 numbers would take 53 MiB."""
    joint, random = scene_from(write_plates(tmp_path, JOINT)).joint, np.random.default_rng(2)
    points = np.column_stack([random.uniform((0, 0), (400, 120), (100, 2)), random.standard_normal(100)])
    assert [len(lines) for lines in joint.grid(5.0)] == [481, 145]
    tracemalloc.start()
    try:
        scan = Scan.of(joint, points, 5.0)
        assert tracemalloc.get_traced_memory()[1] < 40 * 2**20
    finally:
        tracemalloc.stop()
    gap = scan.through(random.standard_normal((145, 481)), SD, random)
    x, y = joint.grid(5.0)
    at_points = RectBivariateSpline(y, x, gap)(points[:, 1], points[:, 0], grid=False)
    assert abs(at_points - points[:, 2]).max() < 6 * NOISE * SD


def test_the_cases_depend_on_the_scan_and_the_seed_alone(tmp_path: Path) -> None:
    one, again = cases(tmp_path), cases(tmp_path)
    other = cases(tmp_path, SCAN + np.array([0.0, 0.0, 1e-3]))
    assert one.key == again.key != other.key
    np.testing.assert_array_equal(one.load(3).g, again.load(3).g)


def test_a_scan_off_the_junction_or_beside_a_measured_gap(tmp_path: Path) -> None:
    (fault,) = refusal_of(cases, tmp_path, SCAN + np.array([1.0, 0.0, 0.0])).faults
    assert (fault.key, fault.value) == ("line 5", [401.0, 120.0])
    with pytest.raises(InputError, match="points = 5001: at most 5000"):
        cases(tmp_path, np.zeros((5001, 3)))
    cases(tmp_path)
    measured = MeasuredGap(kind="measured_gap", points=((0, 0, 1), (9, 0, 1), (0, 9, 1)))
    with pytest.raises(InputError, match="remove it: the gaps pass through"):
        random_gaps(
            make_scene(JOINT, measured), 1, 0, sd=1, correlation_length=9, around=tmp_path / "scan.csv"
        )
