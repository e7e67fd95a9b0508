"""`--allow-gap` of `solve` and `series`: what it says against gaps found by another method."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small import solve_by_nnls
from strip import write_strip
from typer.testing import CliRunner, Result

from harness.cli.app import app
from harness.scene.allowed_gap import checked
from problems.build import load_case, prepared
from problems.load_cases.random_gaps import random_gaps
from problems.scene import read_scene

PAIRS = [{"pair": ["a", "b"], "start": 0, "stop": 2}, {"pair": ["b", "tool"], "start": 2, "stop": 4}]
CASES = 12


@pytest.fixture(autouse=True)
def _without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("report.writers.solution.answer_figures", lambda *_: {})
    monkeypatch.setattr("report.writers.series.write", lambda directory: directory)


@pytest.mark.parametrize(
    ("allowed", "uncertainty", "exceeded", "contacts"),
    [
        (0.5, 1e-9, False, []),
        (0.2, 1e-9, True, [2]),
        (0.05, 1e-9, True, [2, 1]),
        (0.3, 1e-9, None, []),  # as large as the largest gap
        (0.2, 0.11, None, []),
        (0.1, 0.11, None, [2]),  # below what is known of the gaps
        (0.5, np.inf, None, []),
    ],
)
def test_a_gap_is_larger_only_beyond_its_uncertainty(
    allowed: float, uncertainty: float, exceeded: bool | None, contacts: list[int]
) -> None:
    gap = np.array([0.0, 0.1, 0.3, -1e-12])
    found = checked(allowed, gap, np.full(4, uncertainty), PAIRS)
    assert found["exceeded"] is exceeded
    assert found["contacts"] == contacts
    assert found["share"] == len(contacts) / 4
    assert found["pairs"] == {1: ["b – tool"], 2: ["a – b", "b – tool"]}.get(len(contacts), [])


def harness(*words: object) -> Result:
    return CliRunner().invoke(app, [*map(str, words)])


@pytest.fixture(scope="module")
def gap(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """The strip, and its remaining gaps by another method."""
    path = write_strip(tmp_path_factory.mktemp("strip"))
    scene = read_scene(str(path))
    data, load = prepared(scene), load_case(scene)
    x, _ = solve_by_nnls(data, load)
    return path, load.g - data.assembly.A.T @ x


def between(values: np.ndarray, rank: int) -> float:
    """A length that `rank` of the values exceed."""
    ordered = np.sort(values)[::-1]
    return float(ordered[rank - 1] + ordered[rank]) / 2


def test_solve_says_where_the_gap_is_larger(gap: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    path, values = gap
    allowed = between(values, 7)
    done = harness("solve", path, "--allow-gap", allowed, "--out", tmp_path)
    assert done.exit_code == 4, done.output
    assert f"at 7 of {len(values)} contacts, {7 / len(values):.1%} of the junction" in done.stdout
    with (tmp_path / "exceeding.csv").open() as file:
        found = [float(line["gap_after_mm"]) for line in csv.DictReader(file)]
    np.testing.assert_allclose(found, np.sort(values)[::-1][:7], atol=1e-9)
    recorded = json.loads((tmp_path / "solution.json").read_text())["allowed_gap"]
    assert sorted(recorded["contacts"]) == sorted(np.argsort(-values)[:7].tolist())
    assert "**The gap is larger than" in (tmp_path / "answer.md").read_text()


@pytest.mark.parametrize(
    ("allowed", "code", "message"),
    [("9.0", 0, "PASS"), ("1e-16", 3, "cannot be told"), ("nan", 2, "--allow-gap")],
)
def test_solve_passes_fails_or_cannot_tell(
    gap: tuple[Path, np.ndarray], tmp_path: Path, allowed: str, code: int, message: str
) -> None:
    done = harness("solve", gap[0], "--allow-gap", allowed, "--out", tmp_path)
    assert done.exit_code == code, done.output
    assert message in done.stdout + done.stderr


def test_series_counts_the_cases(gap: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    path, _ = gap
    scene = read_scene(str(path))
    data, cases = prepared(scene), random_gaps(scene, CASES, 3)
    loads = [cases.load(k) for k in range(CASES)]
    gaps = np.array([load.g - data.assembly.A.T @ solve_by_nnls(data, load)[0] for load in loads])
    allowed = between(gaps.max(axis=1), 5)
    larger = gaps > allowed
    asked: tuple[Any, ...] = ("series", path, "--cases", CASES, "--seed", 3, "--check", 0, "--threads", 1)
    done = harness(*asked, "--allow-gap", allowed, "--out", tmp_path)
    assert done.exit_code == 4, done.output
    assert f"in 5 of {CASES} cases" in done.stdout
    assert f"at {larger.any(axis=0).sum()} of {gaps.shape[1]} contacts" in done.stdout
    assert f"in case {gaps.max(axis=1).argmax()}." in done.stdout
    assert (tmp_path / "allowed-gap.png").is_file()
    with (tmp_path / "allowed-gap.csv").open() as file:
        table = list(csv.DictReader(file))
    np.testing.assert_allclose([float(line["share_of_cases"]) for line in table], larger.mean(axis=0))
    again = harness(*asked, "--allow-gap", 9.0, "--out", tmp_path)
    assert (again.exit_code, "PASS: in none of 12 cases" in again.stdout) == (0, True)
    unknown = harness(*asked, "--allow-gap", 1e-16, "--out", tmp_path)
    assert (unknown.exit_code, "In 12 of 12 cases it cannot be told" in unknown.stdout) == (3, True)
