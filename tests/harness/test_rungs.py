"""Rungs of the ladders in a run: judged by what conditioning allows, and refused where the model refuses."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from commands import wrong_usage
from suite_runs import gated, moved, rows_of, said_by

from harness.measurement.suite_run import run
from harness.planning.overrides import Overrides, overridden
from harness.planning.plan import expand
from harness.planning.suite import Suite, read_suite
from harness.results import records
from harness.scene.solution import solve
from problems.errors import InputError

WIDE, REFUSED = "hard/conditioning/1e+10", "hard/duplicates/copies"


@pytest.fixture(scope="module")
def suite() -> Suite:
    only = Overrides(scenes=(WIDE, REFUSED), solvers=("gi",), forms=("primal",))
    return overridden(read_suite("hard"), only)


@pytest.fixture(scope="module")
def directory(suite: Suite, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("rungs")
    assert said_by(run, suite, directory)[0] == 0
    return directory


def test_the_limit_of_a_rung_is_what_conditioning_allows(directory: Path) -> None:
    (row,) = rows_of(directory)
    problems = {problem["scene"]: problem for problem in records.read(directory / "problems.jsonl")}
    with np.load(directory / row["answer"]) as saved:
        largest = abs(saved["x"]).max()
    assert row["limit_asked_mm"] == 1e-7
    assert row["limit_mm"] == pytest.approx(100 * problems[WIDE]["cond_K"] * 2.0**-53 * largest, rel=1e-6)
    assert row["verdict"] == "within"
    assert row["backward_error"] < 1e-7
    assert problems[WIDE]["reference_bound_mm"] == 0.0


def test_a_refused_rung_is_recorded_and_not_measured(directory: Path, suite: Suite) -> None:
    assert REFUSED in suite.scenes
    assert {m.scene for m in expand(suite)} == {WIDE}
    problems = {problem["scene"]: problem for problem in records.read(directory / "problems.jsonl")}
    assert "must not depend on the columns before it" in problems[REFUSED]["refused"]
    assert "refused" not in problems[WIDE]


def test_refused_rungs_alone_are_nothing_to_measure(suite: Suite) -> None:
    """The message had named the solvers as the cause."""
    with pytest.raises(InputError, match="there are no other scenes"):
        expand(suite.model_copy(update={"scenes": [REFUSED]}))


@pytest.mark.parametrize(("share", "code"), [(0.9, 0), (1.1, 1)])
def test_the_gate_finds_the_limit_itself(directory: Path, share: float, code: int, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(directory, tmp_path / "copy"))
    (row,) = rows_of(copy)
    moved(copy / row["answer"], share * row["limit_mm"], 5)
    found, said = gated(copy)
    assert found == code
    assert ("within their limits" in said) == (code == 0)


def test_rungs_are_meant_by_their_prefix_alone() -> None:
    suite = read_suite("gate")
    assert not any(name.startswith("hard/") for name in overridden(suite, Overrides(scenes=("*",))).scenes)
    some = overridden(suite, Overrides(scenes=("hard/parts/*",))).scenes
    assert "hard/parts/one-node" in some
    with pytest.raises(InputError, match="hard/conditioning/1e"):
        overridden(suite, Overrides(scenes=("hard/conditioning/1e+07",)))


def test_gaps_in_other_units_than_mm_are_held_to_no_limit(tmp_path: Path) -> None:
    """One of 0.46 mm passed 0.3 mm; the error of each is in its own unit."""
    for words in (("solve", "hard/units/m-N", "--allow-gap", 0.3), ("series", "hard/units/contacts")):
        assert "one in mm, not: Two parts" in wrong_usage(*words, "--out", tmp_path / "out")
    exact, answer = solve("hard/units/um-N"), solve("hard/units/um-N", "piqp", form="primal", tolerance=1.0)
    assert (abs(answer.gap - exact.gap) <= answer.gap_error_mm).all()
