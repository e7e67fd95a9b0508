"""A run of both roads on one scene: measured, judged, recorded beside each other, and gated."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from strip_scene import write_strip
from suite_runs import moved, rows_of, said_by

from harness.measurement.suite_run import run
from harness.planning.suite import read_suite
from harness.results import records
from harness.verification.gate import gate
from harness.verification.reference_problem import measurable, record
from problems.forms import Form

pytestmark = pytest.mark.slow

SUITE = """
scenes = ["strip.toml"]
threads = [1]
time_limit_s = 60
tolerances = [1e-10]
[[solver]]
name = "newton"
forms = ["dual", "sparse"]
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run; tests that change it take a copy."""
    folder = tmp_path_factory.mktemp("both")
    write_strip(folder)
    (folder / "both.toml").write_text(SUITE)
    assert said_by(run, read_suite(str(folder / "both.toml")), folder / "run")[0] == 0
    return folder / "run"


def by_form(directory: Path) -> dict[str, Any]:
    return {row["form"]: row for row in rows_of(directory)}


def test_both_forms_are_within_and_say_so_in_the_same_terms(finished: Path) -> None:
    rows = by_form(finished)
    assert set(rows) == {"dual", "sparse"}
    for row in rows.values():
        assert (row["status"], row["verdict"], row["n"], row["m"]) == ("solved", "within", 45, 45)
        assert row["displacement_error_mm"] < 1e-9
        assert row["reference_bound_mm"] < 1e-9
        assert row["contact_mismatch"] == 0
        assert row["cholesky_s"] is row["product_s"] is None  # no yardstick was asked for
    assert rows["dual"]["active"] == rows["sparse"]["active"] > 0
    assert rows["dual"]["scene_key"] == rows["sparse"]["scene_key"]
    with (
        np.load(finished / rows["sparse"]["answer"]) as sparse,
        np.load(finished / rows["dual"]["answer"]) as dual,
    ):
        assert len(sparse["x"]) > len(dual["x"]) == 45
        np.testing.assert_allclose(sparse["lam"], dual["lam"], atol=1e-6)


def test_a_scene_has_one_row_with_the_facts_of_both_roads(finished: Path) -> None:
    (problem,) = records.read(finished / "problems.jsonl")
    assert (problem["n"], problem["m"]) == (45, 45)
    assert problem["cond_K"] > 1
    assert problem["reference_bound_mm"] < 1e-9
    sparse = problem["sparse"]
    assert sparse["unknowns"] == 4 * 9 * (5 + 2 - 1)
    assert sparse["reference_bound_mm"] < 1e-9
    assert sparse["reference_route"] == "newton, refined"
    with np.load(finished / "scenes" / "strip.npz") as arrays:
        assert arrays["x"].shape == arrays["lam"].shape == (45,)


@pytest.mark.parametrize("named", ["mine", "newton"])
def test_reference_from_first_answer(named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not from one that is cut off, nor from one with NaN."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    path = str(write_strip(tmp_path))
    lam = measurable(path).reference.lam
    problem = measurable(path, form="sparse")
    for bad in (lam[:-1], np.where(lam > 0, np.nan, lam), *([lam] if named == "mine" else [])):
        np.savez(tmp_path / "answer.npz", x=np.zeros(216), lam=bad)
        problem.add_candidate(named, tmp_path / "answer.npz")
    assert (problem.reference.route, len(problem.first)) == (f"{named}, refined", named == "mine")
    assert problem.reference.bound_mm < 1e-9


@pytest.mark.parametrize("order", [("sparse", "dual", "dual"), ("sparse", "sparse")])
def test_both_roads_are_recorded_in_either_order(order: tuple[Form, ...], tmp_path: Path) -> None:
    path = str(write_strip(tmp_path))
    (tmp_path / "scenes").mkdir()
    for form in order:
        record(measurable(path, form=form), tmp_path, "A CPU")
    (problem,) = records.read(tmp_path / "problems.jsonl")
    assert problem["sparse"]["unknowns"] == 216
    assert (problem["cond_K"] is not None) == ("dual" in order)


def test_a_scene_has_a_row_of_each_machine(tmp_path: Path) -> None:
    """One that names none, of an older version, gives way to that of the machine that goes on."""
    path, file = str(write_strip(tmp_path)), tmp_path / "problems.jsonl"
    (tmp_path / "scenes").mkdir()
    dense, sparse = (measurable(path, form=form) for form in ("dual", "sparse"))
    record(dense, tmp_path, "A CPU")
    (first,) = records.read(file)
    records.rewrite(file, [{name: value for name, value in first.items() if name != "machine"}])
    record(sparse, tmp_path, "A CPU")
    record(sparse, tmp_path, "B CPU")
    record(dense, tmp_path, "A CPU")
    b, a = records.read(file)
    assert [(each["machine"], each["cond_K"] is None, "unknowns" in each["sparse"]) for each in (a, b)] == [
        ("A CPU", False, True),
        ("B CPU", True, True),
    ]
    records.rewrite(file, [a, b | {"scene_key": "of the scene as it was"}])
    record(dense, tmp_path, "A CPU")
    assert [each["machine"] for each in records.read(file)] == ["A CPU"]


@pytest.mark.parametrize("form", ["dual", "sparse"])
@pytest.mark.parametrize(("shift", "code"), [(5e-8, 0), (2e-7, 1)])
def test_the_gate_sees_an_answer_that_was_moved(copy: Path, form: str, shift: float, code: int) -> None:
    """At the last displacement of the junction; an inner unknown is not judged."""
    row = by_form(copy)[form]
    problem = measurable(row["source"], form=row["form"])
    junction = problem.prepared.assembly.junction
    moved(copy / row["answer"], shift, -1 if junction is None else junction[-1])
    if junction is not None:
        inner = np.setdiff1d(np.arange(problem.prepared.assembly.n), junction)
        moved(copy / row["answer"], 1e-3, inner[0])
    assert gate(copy).code == code


def test_an_answer_of_the_other_form_is_none(copy: Path) -> None:
    """x of the junction alone in the row of the sparse form."""
    rows = by_form(copy)
    shutil.copy(copy / rows["dual"]["answer"], copy / rows["sparse"]["answer"])
    assert gate(copy).code == 1
