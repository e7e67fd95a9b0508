"""Random gaps from many scans, against the modes that the scans were made of."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal_of
from scipy.linalg import subspace_angles
from small_joints import JOINT, make_scene

from problems.effects.initial_gap import InitialGap
from problems.effects.measured_gap import MeasuredGap
from problems.errors import InputError
from problems.load_cases.random_gaps import random_gaps
from problems.load_cases.scan_modes import scan_modes

SCENE = make_scene(JOINT)
NODES = JOINT.nodes  # scans have a point at each, so that interpolation is exact
X, Y = (NODES / NODES.max(axis=0)).T
MODES = np.array([X - 0.5, np.sin(3 * Y), X * Y])
SPREAD = np.array([0.1, 0.05, 0.02])


def write(folder: Path, gaps: np.ndarray) -> str:
    for i, row in enumerate(gaps):
        table = "\n".join(
            f"{x!r},{y!r},{gap!r}" for (x, y), gap in zip(NODES.tolist(), row.tolist(), strict=True)
        )
        (folder / f"{i:03}.csv").write_text("x,y,gap\n" + table)
    return str(folder / "*.csv")


def made(folder: Path, count: int = 30) -> tuple[np.ndarray, str]:
    z = np.random.default_rng(5).standard_normal((count, 3))
    gaps = 0.4 + 0.1 * X + z * SPREAD @ MODES
    return gaps, write(folder, gaps)


def test_scans_of_three_modes_have_these(tmp_path: Path) -> None:
    gaps, pattern = made(tmp_path)
    cases = scan_modes(SCENE, pattern, 4000, 3, variance=1.0)
    assert len(cases.modes) == 3
    assert "3 of 29 principal modes of 30 scans keep 1 of" in cases.notes[-1]
    assert abs(subspace_angles(cases.modes.T, MODES.T)).max() < 1e-7
    assert abs(cases.mean - gaps.mean(axis=0)).max() < 1e-12
    drawn = np.array([cases.load(k).g for k in range(cases.count)])
    wanted = np.cov(gaps.T)
    assert abs(np.cov(drawn.T) - wanted).max() < 6 * wanted.max() / np.sqrt(cases.count)
    assert abs(drawn.mean(axis=0) - cases.mean).max() < 4.5 * np.sqrt(wanted.max() / cases.count)


def test_the_fewest_modes_that_keep_the_share(tmp_path: Path) -> None:
    gaps, pattern = made(tmp_path)
    variances = np.linalg.svd(gaps - gaps.mean(axis=0), compute_uv=False) ** 2
    shares = np.cumsum(variances) / variances.sum()
    for r in (1, 2, 3):
        below = scan_modes(SCENE, pattern, 1, 0, variance=float(shares[r - 1]) - 1e-6)
        assert len(below.modes) == r
    (tmp_path / "equal").mkdir()
    cases = scan_modes(SCENE, write(tmp_path / "equal", np.full((3, len(NODES)), 0.3)), 2, 0)
    assert len(cases.modes) == 0
    assert np.array_equal(cases.load(1).g, cases.mean)


def test_a_case_depends_on_the_seed_and_its_number_alone(tmp_path: Path) -> None:
    _, pattern = made(tmp_path, 5)
    few, many = (scan_modes(SCENE, pattern, count, 4) for count in (3, 9))
    assert few.key == many.key
    assert np.array_equal(few.load(2).g, many.load(2).g)
    other = scan_modes(SCENE, pattern, 3, 5)
    assert other.key != few.key
    assert not np.array_equal(other.load(2).g, few.load(2).g)


def test_workers_are_sent_the_modes_and_not_the_scans(tmp_path: Path) -> None:
    gaps, pattern = made(tmp_path, 60)
    cases = scan_modes(SCENE, pattern, 3, 4)
    sent = pickle.dumps(cases)
    assert len(sent) < gaps.nbytes / 2
    assert pickle.loads(sent).key == cases.key
    write(tmp_path, gaps + 1e-9)
    assert scan_modes(SCENE, pattern, 3, 4).key != cases.key


def test_scans_and_scatter_are_between_the_parts_of_the_gap_that_they_replace(tmp_path: Path) -> None:
    """Not on the contacts with a tool."""
    joint, m = JOINT.with_contacts((("a", "b"), ("b", "tool"))), len(NODES)
    gap = InitialGap(kind="initial_gap", mean=0.1, between=("a", "b"))
    pattern = made(tmp_path)[1]
    cases = scan_modes(make_scene(joint, gap), pattern, 1, 0)
    scan = MeasuredGap(kind="measured_gap", between=("a", "b"), points=((0, 0, 1), (9, 0, 1), (0, 9, 1)))
    drawn = random_gaps(make_scene(joint, scan), 1, 0, sd=0.1, correlation_length=50.0).load(0).g
    for g in (cases.load(0).g, cases.mean, drawn):
        assert g[:m].all()
        assert not g[m:].any()
    with pytest.raises(InputError, match="at most one can be random"):
        scan_modes(make_scene(joint, gap, gap.model_copy(update={"between": ("b", "tool")})), pattern, 1, 0)


def test_faults_of_all_scans_at_once(tmp_path: Path) -> None:
    _, pattern = made(tmp_path, 2)
    (tmp_path / "a.csv").write_text("x,y,gap\n0,0,1\n1,1,1\n2,2,1\n")
    (tmp_path / "b.csv").write_text("x,y,gap\n0,0,1\n")
    (tmp_path / "c.csv").write_text("x,y\n0,0\n")
    said = str(refusal_of(scan_modes, SCENE, pattern, 1, 0))
    assert all(name in said for name in ("a.csv", "b.csv", "c.csv"))
    assert "000.csv" not in said
    with pytest.raises(InputError, match="two files or more; 1 there"):
        scan_modes(SCENE, str(tmp_path / "000.csv"), 1, 0)
    points = ((0.0, 0.0, 0.1), (100.0, 0.0, 0.1), (0.0, 50.0, 0.1))
    with pytest.raises(InputError, match="remove it"):
        scan_modes(make_scene(JOINT, MeasuredGap(kind="measured_gap", points=points)), pattern, 1, 0)
