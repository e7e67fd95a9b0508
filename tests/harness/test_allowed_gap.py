"""`--allow-gap` of `solve` and `series`: what it says against gaps found by another method."""

import csv
import json
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from clopper_pearson import interval_of
from commands import harness
from sample_size import draws
from small_problems import solve_by_nnls
from strip_scene import write_strip

from harness.results import series_file
from harness.scene.allowed_gap import checked
from harness.verification.assess import GapError
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly
from problems.load_cases.random_gaps import random_gaps
from problems.scene_files import read_scene
from problems.stiffness.operator import Stiffness
from report.document.numbers import percent_interval

PAIRS = [{"pair": ["a", "b"], "start": 0, "stop": 2}, {"pair": ["b", "tool"], "start": 2, "stop": 4}]
CASES = 12

pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.mark.parametrize(
    ("allowed", "uncertainty", "exceeded", "contacts"),
    [
        (0.5, 1e-9, False, []),
        (0.2, 1e-9, True, [2]),
        (0.05, 1e-9, True, [2, 1]),
        (0.3, 1e-9, None, []),  # as large as the largest gap
        (0.2, 0.11, None, []),
        (0.1, 0.11, None, []),  # below what is known of the gaps
        (0.5, np.inf, None, []),
    ],
)
def test_exceeding(allowed: float, uncertainty: float, exceeded: bool | None, contacts: list[int]) -> None:
    gap = np.array([0.0, 0.1, 0.3, -1e-12])
    check = checked(allowed, gap, np.full(4, uncertainty), PAIRS)
    assert check["exceeded"] is exceeded
    assert check["contacts"] == contacts
    assert check["share"] == len(contacts) / 4
    assert check["pairs"] == {1: ["b – tool"], 2: ["a – b", "b – tool"]}.get(len(contacts), [])


@dataclass
class Drawn:
    """A problem whose exact gaps are those of exact displacements at most `error_mm` from the given x."""

    assembly: Assembly
    g: np.ndarray
    x: np.ndarray
    error_mm: float
    exact: list[Fraction]


def drawn(rng: np.random.Generator) -> Drawn:
    """Up to five entries a contact, of any size; x* at a corner of its box, at worst for one of the gaps."""
    n, m = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    A = rng.standard_normal((n, m)) * np.exp2(rng.integers(-3, 4, (n, m)))
    x = rng.standard_normal(n) * np.exp2(rng.integers(-20, 50))
    g = A.T @ x + rng.uniform(0, 1, m) if rng.random() < 0.8 else rng.uniform(0, 1, m)
    error_mm = float(rng.choice([0.0, 1e-9, 0.01]))
    away = Fraction(error_mm) * int(rng.choice([-1, 1]))
    worst = np.sign(A[:, rng.integers(m)]).astype(int)
    moved = [Fraction(v) + away * int(s) for v, s in zip(x, worst, strict=True)]
    exact = [
        Fraction(g[j]) - sum((Fraction(A[i, j]) * moved[i] for i in range(n)), Fraction()) for j in range(m)
    ]
    return Drawn(Assembly(Stiffness.of(np.eye(n)), sp.csc_array(A)), g, x, error_mm, exact)


def test_pass_and_fail_are_those_of_the_exact_gaps() -> None:
    """In rational numbers, beside the limit, where the rounding of g − Aᵀx is larger than the gap or not."""
    rng, said = np.random.default_rng(0), Counter[object]()
    for _ in range(draws(3000, 100_000)):
        made = drawn(rng)
        gap = made.g - made.assembly.A.T @ made.x
        e = GapError.of(made.assembly)(made.g, made.x, made.error_mm)
        for exact, computed, error in zip(made.exact, gap, e, strict=True):
            assert abs(Fraction(computed) - exact) <= Fraction(error)
        largest = max(made.exact)
        beside = float(largest) + rng.choice([0.0, 1e-3, 0.9, 1.1, 2.5]) * rng.choice([-1, 1]) * e.max()
        allowed = max(float(np.nextafter(beside, rng.choice([-np.inf, np.inf]))), 0.0)
        found = checked(allowed, gap, e, [])["exceeded"]
        assert found is None or found == (largest > Fraction(allowed))
        assert found is not None or e.max() > allowed or abs(largest - Fraction(allowed)) <= 2.1 * e.max()
        said[found] += 1
    assert min(said[outcome] for outcome in (True, False, None)) > 100


def test_the_error_of_a_gap_is_no_wider_than_its_terms() -> None:
    """‖a‖₁ e, or three roundings of |g| + |a|ᵀ|x| for one entry."""
    of = GapError.of(Assembly(Stiffness.of(np.eye(1)), sp.csc_array([[3.0]])))
    assert of(np.array([1.0]), np.array([0.0]), 1e-3) == pytest.approx(3e-3, rel=0.011)
    assert of(np.array([6.0]), np.array([2.0]), 0.0) == pytest.approx(3 * 2.0**-53 * 12, rel=0.011)
    assert of(np.array([6.0]), np.array([2.0]), np.inf) == np.inf


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
    assert f"exceeded at 7 of {len(values)} contacts" in (tmp_path / "answer.md").read_text()


@pytest.mark.parametrize(
    ("allowed", "code", "message"),
    [("9.0", 0, "PASS"), ("1e-16", 3, "CANNOT BE TOLD"), ("nan", 2, "--allow-gap")],
)
def test_verdict(gap: tuple[Path, np.ndarray], tmp_path: Path, allowed: str, code: int, message: str) -> None:
    done = harness("solve", gap[0], "--allow-gap", allowed, "--out", tmp_path)
    assert done.exit_code == code, done.output
    assert message in done.stdout + done.stderr
    assert code == 2 or message in (tmp_path / "answer.md").read_text()


def test_series_counts_the_cases(gap: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    path, _ = gap
    scene = read_scene(str(path))
    data, cases = prepared(scene), random_gaps(scene, CASES, 3)
    loads = [cases.load(k) for k in range(CASES)]
    gaps = np.array([load.g - data.assembly.A.T @ solve_by_nnls(data, load)[0] for load in loads])
    allowed = between(gaps.max(axis=1), 5)
    larger = gaps > allowed
    command: tuple[Any, ...] = ("series", path, "--cases", CASES, "--seed", 3, "--check", 0, "--threads", 1)
    done = harness(*command, "--allow-gap", allowed, "--out", tmp_path)
    assert done.exit_code == 4, done.output
    assert f"in 5 of {CASES} cases" in done.stdout
    interval = percent_interval(interval_of(CASES - 5, CASES), 2)
    assert f"Surely within {allowed:g} mm: {CASES - 5} of {CASES} cases" in done.stdout
    assert f"the share of joints is {interval}, with 95 %" in done.stdout
    assert f"at {larger.any(axis=0).sum()} of {gaps.shape[1]} contacts" in done.stdout
    assert f"in case {gaps.max(axis=1).argmax()}." in done.stdout
    said = f"FAIL: the gap is larger than {allowed:g} mm in 5 of {CASES} cases"
    assert all(said in (tmp_path / "report" / name).read_text() for name in ("report.md", "index.html"))
    assert (tmp_path / "allowed-gap.png").is_file()
    with (tmp_path / "allowed-gap.csv").open() as file:
        table = list(csv.DictReader(file))
    np.testing.assert_allclose([float(line["share_of_cases"]) for line in table], larger.mean(axis=0))
    again = harness(*command, "--allow-gap", 9.0, "--out", tmp_path)
    assert (again.exit_code, "PASS: in none of 12 cases" in again.stdout) == (0, True)
    assert harness(*command, "--out", tmp_path).exit_code == 0
    assert "PASS" not in (tmp_path / "report" / "report.md").read_text()
    assert not [*tmp_path.glob("allowed-gap.*")]
    unknown = harness(*command, "--allow-gap", 1e-16, "--out", tmp_path)
    assert (unknown.exit_code, "In 12 of 12 cases it cannot be told" in unknown.stdout) == (3, True)
    unjudged = harness(*command, "--limit", 1e-30, "--allow-gap", allowed, "--out", tmp_path / "unjudged")
    assert (unjudged.exit_code, f"{CASES} cannot be judged" in unjudged.stdout) == (4, True)


@pytest.mark.usefixtures("without_report")
def test_a_case_without_an_answer_is_in_the_verdict(gap: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    """It cannot pass; what the others show is said all the same."""
    command = ("series", gap[0], "--cases", CASES, "--check", 0, "--threads", 1, "--out", tmp_path)
    assert harness(*command).exit_code == 0
    row = list(series_file.rows(tmp_path))[3]
    lost = {"case": 3, "gap_seed": row["gap_seed"], "status": "failed", "verdict": "no_answer", "message": ""}
    series_file.append(tmp_path, [(lost, None)])
    done = harness(*command, "--allow-gap", 9.0)
    assert done.exit_code == 1
    assert f"Surely within 9 mm: {CASES - 1} of {CASES} cases" in done.stdout
    low, _ = interval_of(CASES - 1, CASES)
    assert f"the share of joints is {percent_interval((low, 1.0), 2)}, with 95 %" in done.stdout
    assert (
        f"In 1 of {CASES} cases it cannot be told whether a gap is larger than 9 mm: there is no"
        in done.stdout
    )
    assert "PASS" not in done.stdout
    assert (tmp_path / "allowed-gap.csv").is_file()
    done = harness(*command, "--allow-gap", 1e-3)
    assert done.exit_code == 4
    assert f"FAIL: the gap is larger than 0.001 mm in {CASES - 1} of {CASES} cases" in done.stdout


@pytest.mark.usefixtures("without_report")
def test_steps_of_a_sweep_are_no_sample(gap: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    swept = ("--sweep", "initial_gap.mean=0.1,0.2", "--check", 0, "--threads", 1, "--allow-gap", 9.0)
    done = harness("series", gap[0], *swept, "--out", tmp_path)
    assert done.exit_code == 0, done.output
    assert "Surely within 9 mm: 2 of 2 cases.\n" in done.stdout


@pytest.mark.usefixtures("without_report")
def test_a_series_without_errors_of_gaps_cannot_be_told(gap: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    command = ("series", gap[0], "--cases", 3, "--check", 0, "--threads", 1, "--out", tmp_path)
    assert harness(*command).exit_code == 0
    rows = list(series_file.rows(tmp_path))
    assert all(row["gap_error_mm"] >= row["bound_mm"] for row in rows)
    with series_file.connected(tmp_path) as connection:
        connection.execute("UPDATE cases SET row = json_remove(row, '$.gap_error_mm')")
    assert harness(*command, "--allow-gap", 9.0).exit_code == 3
