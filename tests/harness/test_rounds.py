"""`beside` of a suite: rounds of ours beside libraries, what stays published and what is measured anew."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
import tiny_joint
from rich.console import Console
from suite_runs import rows_of
from synthetic_results import shown

from harness.measurement import suite_run
from harness.measurement.solver_descriptions import Description
from harness.measurement.task import Task, TaskResult
from harness.measurement.worker import OWN_LIMIT, Run
from harness.planning.plan import expand
from harness.planning.suite import Suite, read_suite
from harness.results.records import MEASUREMENTS, OUTDATED, Row, read, rewrite
from problems.errors import InputError
from report.document.blocks import Table
from report.results.reader import read as read_results
from report.sections import history
from studies import publish as published

SUITE = """
[[solver]]
name = "newton"
forms = ["dual"]
beside = true

[[solver]]
name = "textbook-active-set"
forms = ["dual"]
beside = true

[[solver]]
name = "gi"
forms = ["dual"]

[[solver]]
name = "exact"
forms = ["dual"]
variant = "a"

[[solver]]
name = "exact"
forms = ["dual"]
variant = "b"
"""


class Collected:
    """The events of a measuring process, in this one."""

    def __init__(self) -> None:
        self.fields: Row = {}

    def report(self, **event: Any) -> None:
        self.fields |= event


def measured_here(task: Task, answers: Path) -> TaskResult:
    (m,), events = task.batch, Collected()
    for outcome in Run([m], [answers / f"{m.stem}.npz"], events).outcomes():  # type: ignore[arg-type]
        events.report(**outcome)
    return TaskResult([events.fields], 0.0)  # type: ignore[list-item]


class Clock:
    """Each measurement begins `step` after the one before."""

    def __init__(self, step: timedelta) -> None:
        self.time, self.step = datetime(2026, 1, 1, tzinfo=UTC), step

    def now(self, _: Any) -> datetime:
        self.time += self.step
        return self.time


@pytest.fixture
def suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Suite:
    """Its measurements are made in this process, and published by `release`."""
    made = tiny_joint.suite(tmp_path, SUITE)
    monkeypatch.setattr(suite_run, "run_task", measured_here)
    monkeypatch.setattr(suite_run, "datetime", Clock(timedelta(minutes=1)))
    monkeypatch.setattr(published, "PUBLISHED", tmp_path / "published")
    monkeypatch.setattr(published, "STAGED", tmp_path / "publishing")
    monkeypatch.setattr(published, "read_suite", lambda name: made)
    return made


@pytest.fixture
def release(suite: Suite, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Row]]:
    def publish(commit: str, **versions: str) -> list[Row]:
        """The published rows of a commit with these versions of the libraries a and b, 1 by default."""

        def describe(suite: Suite, reporter: Any) -> list[Description]:
            owners = {"newton": "ours", "gi": "ours", "exact": "library"}
            return [
                Description(["dual"], versions.get(e.variant, "1"), "code", owners.get(e.name, "textbook"))
                for e in suite.solver
            ]

        def ended(words: Sequence[str]) -> int:
            return suite_run.run(suite, Path(words[-1]), Console(quiet=True))

        monkeypatch.setattr(suite_run, "describe", describe)
        monkeypatch.setattr(suite_run, "provenance", lambda: {"commit": commit, "clean": True})
        monkeypatch.setattr(published, "ended", ended)
        assert published.measure(["small"], commit) == []
        return rows_of(tmp_path / "published" / "small")

    return publish


def made(rows: list[Row], commit: str) -> list[str]:
    """What that commit measured, in its order; rounds with their marks."""
    words = [row["variant"] or row["solver"] + (" again" if row["round"] else "") for row in rows]
    return [word for word, row in zip(words, rows, strict=True) if row["commit"] == commit]


OURS = ["newton", "textbook-active-set", "gi"]
ROUND = ["newton again", "textbook-active-set again"]


def test_only_a_changed_library_is_measured_anew(release: Callable[..., list[Row]], tmp_path: Path) -> None:
    first = release("first")
    assert made(first, "first") == [*OURS, *ROUND, "a", "b"]
    rounds = {row["round"] or row["beside_round"] for row in first} - {None}
    assert len(rounds) == 1
    assert all(row["key"].endswith(f" round={row['round']}") for row in first if row["round"])

    second = release("second", b="2")
    assert made(second, "second") == [*OURS, *ROUND, "b"]
    assert [row for row in second if row["commit"] == "first"] == [
        row for row in first if made([row], "first")[0] in (*ROUND, "a")
    ]
    assert len({row["key"] for row in second}) == len(second)
    folder = tmp_path / "published" / "small"
    assert [row["variant"] for row in read(folder / OUTDATED)] == ["b"]
    assert release("second", b="2") == second

    results = read_results(folder)
    assert sorted(results.rows["solver"] + results.rows["variant"]) == sorted([*OURS, "exacta", "exactb"])
    section = history.section(results)
    assert section is not None
    table = next(block for block in section.blocks if isinstance(block, Table))
    assert [line[:2] + line[3:5] for line in shown(table)[1:]] == [
        ["exact", "1", "1", "1"],
        ["exact", "2", "1", "1"],
    ]
    assert release("third", b="2")
    assert len(read_results(folder).rounds) == 4


def test_an_interrupted_run_goes_on_with_another_commit(
    release: Callable[..., list[Row]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also where older rows are published; logs are taken along."""
    monkeypatch.setattr(published, "WITH_LOGS", ("small",))
    release("zeroth", a="0", b="0")
    first = [row | {"log": f"logs/{row['variant']}.txt"} for row in release("first")]
    folder, left = (tmp_path / at / "small" for at in ("published", "publishing/first"))
    shutil.copytree(folder, left)
    rewrite(left / MEASUREMENTS, first[:-1])
    (left / "logs").mkdir(exist_ok=True)
    (left / "logs/a.txt").write_text("iter 1\n")
    rewrite(folder / MEASUREMENTS, [row | {"recorded_at": "2025-01-01T00:00:00+00:00"} for row in first[:1]])

    second = release("second")
    assert made(second, "second") == [*OURS, *ROUND, "b"]
    assert made(second, "first") == [*ROUND, "a"]
    assert (folder / "logs/a.txt").read_text() == "iter 1\n"


def test_a_row_of_a_round_is_measured_again_by_its_key(
    suite: Suite, release: Callable[..., list[Row]], tmp_path: Path
) -> None:
    again = next(row for row in release("first") if row["round"])
    assert suite_run.run(suite, tmp_path / "again", Console(quiet=True), key=again["key"]) == 0
    (row,) = rows_of(tmp_path / "again")
    assert again["key"] == f"{row['key']} round={again['round']}"


def test_rows_that_are_still_planned_are_kept_with_the_scenes_that_they_need(
    suite: Suite, release: Callable[..., list[Row]], monkeypatch: pytest.MonkeyPatch
) -> None:
    release("first")
    smaller = suite.model_copy(update={"solver": suite.solver[:-1]})
    monkeypatch.setattr(published, "read_suite", lambda name: smaller)
    published.begin("small", directory := published.STAGED / "second")
    assert {row["variant"] for row in rows_of(directory) if row["beside_round"]} == {"a"}
    problems, kept = (folder / "problems.jsonl" for folder in (published.PUBLISHED / "small", directory))
    assert kept.read_text() == problems.read_text()


def test_after_an_hour_there_is_another_round(
    release: Callable[..., list[Row]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(suite_run, "datetime", Clock(timedelta(hours=1.1)))
    rows = release("first")
    assert made(rows, "first") == [*OURS, *ROUND, "a", *ROUND, "b"]
    assert len({row["beside_round"] for row in rows if row["variant"]}) == 2


@pytest.mark.parametrize("key", ['tolerances = "auto"', "[series]\ncases = 2"])
def test_a_round_searches_for_nothing_and_has_no_series(tmp_path: Path, key: str) -> None:
    path = tiny_joint.write_suite(tmp_path, f'[[solver]]\nname = "newton"\nbeside = true\n{key}\n')
    with pytest.raises(InputError, match=r"solver\.0\.beside"):
        read_suite(str(path))


def test_a_trace_searches_for_nothing(tmp_path: Path) -> None:
    path = tiny_joint.write_suite(tmp_path, '[[solver]]\nname = "newton"\ntolerances = "auto"\n', trace=True)
    with pytest.raises(InputError, match=r"solver\.0\.tolerances"):
        read_suite(str(path))


LATE = """
import time
import numpy as np
from solvers.base import Answer, Solver


class Late(Solver):
    forms = ("dual",)

    def solve(self, ready, load, tolerance):
        time.sleep(self.time_limit_s)
        return Answer("failed", np.maximum(load.p, 0), iterations=7)
"""


def test_the_last_iterate_of_what_stops_by_itself_is_judged(suite: Suite, tmp_path: Path) -> None:
    (tmp_path / "late.py").write_text(LATE)
    entry = suite.solver[-1].model_copy(update={"name": "late"})
    late = suite.model_copy(update={"plugin": str(tmp_path / "late.py"), "solver": [entry]})
    (m,) = expand(late)
    answers = tmp_path / "answers"
    answers.mkdir()
    task = Task([replace(m, time_limit_s=0.01)], Description(["dual"], "1", "code"), "")
    (report,) = measured_here(task, answers).reports
    assert (report["status"], report["iterations"]) == ("time_limit", 7)
    assert report["message"] == f"stopped by itself after {OWN_LIMIT * 0.01:g} s, with its last iterate"
    assert (tmp_path / str(report["answer"])).is_file()


def test_a_plug_in_over_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each state of its file is a version, in the order of their minutes; beside the textbook's method."""
    solvers = '[[solver]]\nname = "textbook-active-set"\nbeside = true\n[[solver]]\nname = "exact"\n'
    path, out = tiny_joint.write_suite(tmp_path, solvers), tmp_path / "out"
    for minute in (31, 32, 33):
        clock = Clock(timedelta())
        clock.time += timedelta(hours=10, minutes=minute)
        monkeypatch.setattr("harness.measurement.task.datetime", clock)
        with (tmp_path / "exact.py").open("a") as file:
            file.write(f"# {minute}\n")
        assert suite_run.run(read_suite(str(path)), out, Console(quiet=True)) == 0
    section = history.section(read_results(out))
    assert section is not None
    lines = shown(next(block for block in section.blocks if isinstance(block, Table)))[1:]
    assert [line[:1] + line[2:5] for line in lines] == [
        ["exact", f"2026-01-01T10:{minute}", "1", "1"] for minute in (31, 32, 33)
    ]
    assert len({line[1] for line in lines}) == 3
    assert all(float(line[-1]) > 0 for line in lines)
