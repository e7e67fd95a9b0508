"""tolerances = "auto" and repeats = "auto": what is measured, and what the report makes of it."""

from concurrent.futures import Executor, Future
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tiny_joint
from refusals import refusal_of
from rich.console import Console
from suite_runs import rows_of, said_by

from harness.commands.run_comparison import compare
from harness.measurement import suite_run
from harness.measurement.suite_run import run
from harness.measurement.task import Task
from harness.planning.overrides import Overrides, overridden, tolerances_of
from harness.planning.plan import HALF_DECADES, Measurement, expand
from harness.planning.suite import suite_from
from harness.planning.tolerance_search import (
    START,
    decided_by,
    decides_on,
    in_a_good_form,
    next_tolerance,
    still_needed,
    unmeasured,
)
from harness.results.records import MEASUREMENTS, Row, rewrite
from harness.verification.gate import gate
from problems.errors import InputError
from report.results.reader import read

#: Right to a tenth of the tolerance; below `least` it gives up.
ROUGH = (
    tiny_joint.EXACT.partition("        return")[0]
    + """
        if tolerance < self.least:
            return Answer("inaccurate", lam * (1 + self.least))
        return Answer("solved", lam * (1 + tolerance))

    def __init__(self, *, least=0.0):
        self.least = least
"""
)

LOOSE = 2e-5  # mm: found in few steps


def suite_of(folder: Path, limit_mm: float = 1e-7, **changes: Any) -> Any:
    (folder / "rough.py").write_text(ROUGH)
    suite = tiny_joint.suite(folder, limit_mm=limit_mm)
    change = Overrides(solvers=("rough",), tolerances="auto", plugin=folder / "rough.py", **changes)
    return overridden(suite, change)


def measured(suite: Any, directory: Path) -> list[dict[str, Any]]:
    assert said_by(run, suite, directory)[0] in (0, 3)
    return rows_of(directory)


def test_the_search_ends_at_the_first_tolerance_that_suffices(tmp_path: Path) -> None:
    suite = suite_of(tmp_path, LOOSE, repeats=2)
    rows = measured(suite, tmp_path / "out")
    first = [row for row in rows if row["repeat"] == 0]
    tried = {row["tolerance"]: row["verdict"] for row in first}
    enough = max(tolerance for tolerance, verdict in tried.items() if verdict == "within")
    looser = HALF_DECADES[HALF_DECADES.index(enough) - 2]
    assert first[0]["tolerance"] == START
    assert tried[looser] == "outside"
    # Only what is enough is repeated; and nothing is left for the same command.
    assert [row["tolerance"] for row in rows if row["repeat"] == 1] == [enough]
    assert measured(suite, tmp_path / "out") == rows

    results = read(tmp_path / "out")
    (cell,) = results.cells.to_dict("records")
    assert (cell["label"], cell["tolerance"], cell["repeats"]) == ("rough (dual)", enough, 2)

    # On a second scene it starts where it ended: the tolerance tried last, and the one beside it.
    data = suite.model_dump(exclude_none=True) | {"repeats": 1}
    second = tmp_path / "second.npz"
    second.write_bytes(Path(*suite.scenes).read_bytes())
    data["scenes"] = [*suite.scenes, str(second)]
    rows = measured(suite_from(data, tmp_path / "s.toml"), tmp_path / "out")
    assert [row["tolerance"] for row in rows if row["scene"] == "second"] == [enough, looser]
    assert read(tmp_path / "out").cells["tolerance"].nunique() == 1


def test_the_gate_judges_what_a_search_keeps(tmp_path: Path) -> None:
    """And misses its next tolerance or repeat, none of the tolerances that it need not try."""
    rows, out = measured(suite_of(tmp_path, repeats=2), tmp_path / "out"), tmp_path / "out"
    kept = [row["key"] for row in rows if row["tolerance"] == rows[-1]["tolerance"]]
    whole = gate(out)
    assert whole.passed
    assert [finding.key for finding in whole.findings] == kept
    assert len(kept) == 2 < len(rows)
    for count in (len(rows) - 1, 1):
        rewrite(out / MEASUREMENTS, rows[:count])
        judged, missing = gate(out).findings
        assert judged.judged
        assert (missing.key, missing.judgement.verdict) == (rows[count]["key"], "no_answer")


def test_a_tolerance_that_a_search_tried_is_measured_again(tmp_path: Path) -> None:
    suite, again = suite_of(tmp_path), tmp_path / "again"
    first, *_ = measured(suite, tmp_path / "out")
    run(suite, again, Console(quiet=True), key=first["key"])
    (row,) = rows_of(again)
    same = ("key", "tolerance", "verdict", "displacement_error_mm")
    assert [row[name] for name in same] == [first[name] for name in same]
    (compared,) = compare(tmp_path / "out", again, key=first["key"], max_slowdown=1e6)
    assert not compared.worse
    (finding,) = gate(again).findings
    assert finding.judgement.verdict == row["verdict"]


def test_it_ends_where_the_solver_gives_up(tmp_path: Path) -> None:
    rows = measured(suite_of(tmp_path, options=("rough.least=1e-3",)), tmp_path / "out")
    assert {row["tolerance"]: row["status"] for row in rows} == {
        **dict.fromkeys((1e-6, 1e-5, 1e-4), "inaccurate"),
        1e-3: "solved",
    }
    (cell,) = read(tmp_path / "out").cells.to_dict("records")
    assert cell["verdict"] == "outside"


@pytest.mark.parametrize(
    ("tried", "expected"),
    [
        ({}, 1e-6),
        ({1e-3: "outside"}, 1e-4),
        ({1e-3: "outside", 1e-4: "within"}, None),
        ({1e-6: "within"}, 1e-5),
        ({1e-6: "within", 1e-5: "outside"}, None),
        ({1e-6: "time_limit"}, 1e-5),
        ({1e-6: "time_limit", 1e-5: "time_limit"}, None),
        ({1e-6: "time_limit", 1e-5: "outside"}, None),
        ({1e-6: "inaccurate", 1e-5: "within", 1e-4: "within", 1e-3: "within"}, None),
        ({1e-9: "within", 1e-8: "within"}, 1e-6),
        ({1e-9: "within", 1e-8: "within", 1e-6: "within"}, 1e-4),
        ({1e-9: "within", 1e-8: "within", 1e-6: "outside"}, 1e-7),
        ({1e-9: "within", 1e-8: "within", 1e-6: "outside", 1e-7: "within"}, None),
        ({1e-9: "within", 1e-8: "within", 1e-6: "outside 2e-7", 1e-7: "within"}, 3e-7),
        ({1e-16: "outside"}, None),
        ({1e-3: "outside 3.1e-7", 1e-4: "within"}, 3e-4),
        ({1e-3: "outside 3.2e-7", 1e-4: "within"}, None),
        ({1e-3: "outside 1.1e-7", 1e-4: "within", 3e-4: "outside 1.05e-7"}, None),
        ({1e-3: "outside 1.1e-7", 1e-4: "within", 3e-4: "within"}, None),
        ({1e-3: "outside 1.1e-7"}, 1e-4),
    ],
)
def test_the_next_tolerance(tmp_path: Path, tried: dict[float, str], expected: float | None) -> None:
    m = expand(suite_of(tmp_path))[0]
    rows = []
    for tolerance, (ended, *error) in ((each, words.split()) for each, words in tried.items()):
        row = row_of(replace(m, tolerance=tolerance), 1.0, ended if ended == "within" else "outside")
        row["displacement_error_mm"] = float(*error) if error else None
        rows.append(row | ({"status": ended} if ended in ("time_limit", "inaccurate") else {}))
    assert next_tolerance(m, rows) == expected


def test_a_search_after_one_on_another_scene_starts_at_its_last_tolerance(tmp_path: Path) -> None:
    """And ends if its time or memory runs out there."""
    m = expand(suite_of(tmp_path))[0]
    late = {"status": "memory_limit", "scene": "a"}
    rows = [row_of(replace(m, tolerance=each), 1.0, "no_answer") | late for each in (1e-6, 1e-5)]
    assert next_tolerance(m, rows) == 1e-5
    assert next_tolerance(m, [*rows, rows[1] | {"scene": m.scene}]) is None
    assert next_tolerance(m, [*rows, row_of(replace(m, tolerance=1e-5), 1.0)]) == 1e-4
    half = row_of(replace(m, tolerance=3e-7), 1.0) | {"scene": "a"}
    assert next_tolerance(m, [*rows, half]) == 1e-5  # a search begins at a decade
    other = row_of(replace(m, tolerance=1e-9), 1.0) | {"scene": "a", "options": {"least": 1e-12}}
    assert next_tolerance(m, [*rows, other]) == 1e-5
    assert next_tolerance(m, [other]) == 1e-9


def test_a_tolerance_that_was_measured_twice_counts_once(tmp_path: Path) -> None:
    """As its rows were made by several workers at once: a second one that exceeds a limit ends the search."""
    m = expand(suite_of(tmp_path))[0]
    late = row_of(replace(m, tolerance=1e-6), 1.0, "no_answer") | {"status": "time_limit"}
    assert next_tolerance(m, [late] * 4) == 1e-5
    assert next_tolerance(m, [late, late | {"tolerance": 1e-5}]) is None


class AtOnce(Executor):
    """Does what is submitted at once; what is submitted ahead of an outcome knows none of it."""

    def submit(self, work: Any, *sent: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(work(*sent, **named))
        except RuntimeError as error:
            future.set_exception(error)
        return future


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two workers, of two tasks each."""
    monkeypatch.setattr(suite_run, "workers", lambda *_: nullcontext((AtOnce(), 2)))


@pytest.mark.usefixtures("workers")
def test_workers_search_as_one_process_does(tmp_path: Path) -> None:
    """What depends on a row that is being made waits for it; others go first."""
    suite = suite_of(tmp_path, LOOSE, repeats=2)
    other = suite.solver[0].model_copy(update={"name": "newton"})
    suite = suite.model_copy(update={"solver": [*suite.solver, other]})
    alone = measured(suite, tmp_path / "alone")
    assert said_by(lambda console: run(suite, tmp_path / "out", console, "workers"))[0] == 0
    rows = rows_of(tmp_path / "out")
    assert sorted(row["key"] for row in rows) == sorted(row["key"] for row in alone)
    assert [row["solver"] for row in rows[:2]] == ["rough", "newton"]
    assert [row["solver"] for row in alone[:2]] == ["rough", "rough"]


@pytest.mark.usefixtures("workers")
def test_a_search_does_not_try_again_what_its_workers_did_not_survive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def lost(task: Task) -> None:
        tried.append(task.batch[0].key)
        raise RuntimeError("the worker ended")

    monkeypatch.setattr(suite_run, "run_task_on_worker", lost)
    suite = suite_of(tmp_path, repeats=2)
    assert said_by(lambda console: run(suite, tmp_path / "out", console, "workers"))[0] == 1
    (key,) = tried
    assert f"tol={START:g}" in key


def test_a_tolerance_that_was_only_tried_is_measured_where_it_is_asked_for(tmp_path: Path) -> None:
    """The gate missed it, as it keeps one row of a search, and the same command did not measure it."""
    suite, out = suite_of(tmp_path, LOOSE), tmp_path / "out"
    tried = measured(suite, out)[0]["tolerance"]
    rows = measured(overridden(suite, Overrides(tolerances=(tried,))), out)
    assert [row["searched"] for row in rows if row["tolerance"] == tried] == [False]
    assert not [finding for finding in gate(out).findings if "never measured" in finding.why]


def test_a_row_is_waited_for_where_it_decides(tmp_path: Path) -> None:
    """Of a search its own in the form, of a form that may be left out those of the guide in any."""
    searched = expand(suite_of(tmp_path, repeats=2))
    first = searched[0]
    again = next(m for m in searched if m.repeat and m.form == first.form)
    assert all(decided_by(m) & decides_on(first) for m in (first, again))
    assert not decides_on(again)
    assert not decided_by(first) & decides_on(replace(first, scene="another"))
    assert not decided_by(first) & decides_on(replace(first, form="dual"))
    assert decided_by(replace(first, guide=("another", 3.0, 1.0))) & decides_on(
        replace(first, scene="another", form="dual")
    )
    (alone,) = expand(tiny_joint.suite(tmp_path))
    assert not decided_by(alone)


def row_of(m: Measurement, seconds: float, verdict: str = "within") -> dict[str, Any]:
    names = ("scene", "solver", "form", "variant", "tolerance", "repeat")
    steps = dict.fromkeys(("convert_s", "prepare_s", "setup_s", "form_s")) | {"solve_s": seconds}
    asked = {name: getattr(m, name) for name in names} | {"threads_asked": m.threads}
    asked["options"] = m.entry.options
    judged = {"verdict": verdict, "status": "solved", "displacement_error_mm": None, "limit_mm": 1e-7}
    return asked | steps | judged | {"n": 4, "owner": "library"}


@pytest.mark.parametrize(("seconds", "repeats"), [(0.1, 5), (3.0, 3), (30.0, 1), (None, 1)])
def test_what_is_quick_is_repeated(tmp_path: Path, seconds: float | None, repeats: int) -> None:
    suite = tiny_joint.suite(tmp_path).model_copy(update={"repeats": "auto"})
    plan = [m for m in expand(suite) if m.solver == suite.solver[0].name]
    rows = [row_of(plan[0], seconds)]
    others = [m for m in plan if m.tolerance == plan[0].tolerance and m.form == plan[0].form]
    assert [m.repeat for m in others if still_needed(m, rows)] == [*range(repeats)]
    assert still_needed(replace(plan[0], repeat=4), [])


class Unread(list[Row]):
    def __iter__(self) -> Any:
        raise AssertionError("the rows were read")


def test_rows_are_read_only_for_what_they_may_leave_out(tmp_path: Path) -> None:
    """So that a series of many cases resumes in a time that grows with their number, not its square."""
    (m,) = expand(tiny_joint.suite(tmp_path))
    assert still_needed(m, Unread()) == m
    with pytest.raises(AssertionError):
        still_needed(expand(suite_of(tmp_path))[0], Unread())


def test_what_is_missing_is_decided_by_the_rows_of_its_solver_alone(tmp_path: Path) -> None:
    """The rows of all would be read for every measurement of a plan, whose forms may all be good."""
    plan = expand(suite_of(tmp_path))
    assert unmeasured(plan, [{"key": "of another", "solver": "another"}]) == plan
    assert in_a_good_form(plan[0], Unread())


def test_tolerances_of_the_command_line() -> None:
    assert tolerances_of(["auto"]) == "auto"
    assert tolerances_of(["1e-6", "1e-9"]) == (1e-6, 1e-9)
    with pytest.raises(InputError, match="numbers, or auto alone"):
        tolerances_of(["1e-6", "auto"])


@pytest.mark.parametrize("option", ["rough.least", "rough.least=[1"])
def test_a_bad_option(tmp_path: Path, option: str) -> None:
    with pytest.raises(InputError, match=r"--option.*SOLVER\.KEY=VALUE"):
        suite_of(tmp_path, options=(option,))


def test_a_series_searches_for_nothing(tmp_path: Path) -> None:
    data = tiny_joint.suite(tmp_path).model_dump(exclude_none=True)
    data |= {"series": {"cases": 2}, "tolerances": "auto", "repeats": "auto"}
    assert len(refusal_of(suite_from, data, tmp_path / "suite.toml").faults) == 2
