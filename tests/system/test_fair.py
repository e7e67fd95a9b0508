"""The rules of docs/fair.md, each held to the published rows: one function per rule, by its name."""

import json
import re
from collections import defaultdict
from datetime import datetime
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from harness.measurement.suite_run import ROUND_LASTS
from harness.planning.plan import HALF_DECADES, expand
from harness.planning.suite import read_written
from harness.planning.tolerance_search import DECADE, EXCEEDED, in_a_good_form
from harness.results.counted_rows import counting
from harness.results.schema import STATUSES
from problems.random_scenes import SIZES
from solvers.registry import make_solver, modules, owner_of
from studies.publish import NAMES, PUBLISHED, WITH_LOGS

ROOT = Path(__file__).parents[2]
FAIR = (ROOT / "docs/fair.md").read_text("utf-8")
MEASURED = [name for name in NAMES if (PUBLISHED / name / "suite.toml").is_file()]
SLACK_S = 600.0  # of a measurement, beside what is limited
Row = dict[str, Any]


@cache
def rows_of(suite: str) -> list[Row]:
    text = (PUBLISHED / suite / "measurements.jsonl").read_text("utf-8")
    return [json.loads(line) for line in text.splitlines()]


def cells(rows: list[Row]) -> dict[tuple[str, ...], list[Row]]:
    """First repeats by scene, solver, form and variant."""
    by_cell = defaultdict(list)
    for row in rows:
        if row["repeat"] == 0:
            by_cell[row["scene"], row["solver"], row["form"], row["variant"]].append(row)
    return by_cell


def test_every_rule_has_its_test_and_every_test_its_rule() -> None:
    rules = re.findall(r"^- \*\*(\w+)\.?\*\*", FAIR, re.M)
    assert len(rules) >= 8
    assert {f"test_{rule}" for rule in rules} <= set(globals())


@pytest.mark.parametrize("suite", MEASURED)
def test_judged_by_displacements(suite: str) -> None:
    """The verdict is that of the error with its bound, whatever the status."""
    for row in rows_of(suite):
        if row["displacement_error_mm"] is None:
            assert row["verdict"] in ("no_answer", "cannot_be_judged")
        elif row["verdict"] != "cannot_be_judged":
            assert (row["verdict"] == "within") is (row["displacement_error_mm"] <= row["limit_mm"])


def test_no_empty_cell() -> None:
    """A solver that came after the suite was published needs no rows."""
    rows, suite = rows_of("speed"), read_written(PUBLISHED / "speed" / "suite.toml")
    measured, planned = cells(rows), defaultdict(set)
    for m in expand(suite):
        planned[m.solver].add(m.form)
        assert measured[m.scene, m.solver, m.form, m.variant] or not in_a_good_form(m, rows), m.key
    for name in {entry.name for entry in suite.solver} & set(modules()):
        assert planned[name] == set(make_solver(name, {}).forms), name


def test_loosest_tolerance() -> None:
    for cell, rows in cells(rows_of("speed")).items():
        if owner_of(cell[1]) != "library" or "tolerance" in (rows[0]["details"] or {}):
            continue
        within = [row["tolerance"] for row in rows if row["verdict"] == "within"]
        late = all(row["status"] in EXCEEDED for row in rows)
        if within and max(within) < HALF_DECADES[0] and not late:
            place = HALF_DECADES.index(max(within))
            looser = HALF_DECADES[place - (1 if place % DECADE else DECADE)]
            assert looser in {row["tolerance"] for row in rows}, cell


def test_the_same_limits() -> None:
    suite = read_written(PUBLISHED / "speed" / "suite.toml")
    for row in rows_of("speed"):
        assert row["time_limit_s"] == suite.time_limit(row["n"]), row["key"]


def test_scenes_are_drawn() -> None:
    """Three of each size and version."""
    scenes = {row["scene"] for row in rows_of("speed")}
    versions = {at + version for _, at, version in (scene.partition("@") for scene in scenes)}
    assert scenes == {f"drawn/{n}/{k}{version}" for n in SIZES for k in range(3) for version in versions}


@pytest.mark.parametrize("suite", MEASURED)
def test_no_row_is_taken_out(suite: str) -> None:
    """What the suite beside the rows plans is there; of a search and of repeats by pace, the first."""
    rows, plan = rows_of(suite), expand(read_written(PUBLISHED / suite / "suite.toml"))
    keys, measured = {row["key"] for row in rows}, set(cells(rows))
    assert measured <= {(m.scene, m.solver, m.form, m.variant) for m in plan}
    for m in plan:
        searched = m.searched or m.paced
        there = (m.scene, m.solver, m.form, m.variant) in measured if searched else m.key in keys
        assert there or not in_a_good_form(m, rows), m.key


def test_settings_are_named() -> None:
    """Options are only in variants, which have names; each library has its part of the page."""
    for suite in MEASURED:
        assert all(row["variant"] or not row["options"] for row in rows_of(suite))
    headings = re.findall("^## `(.*)`", (ROOT / "docs/libraries.md").read_text("utf-8"), re.M)
    libraries = {row["solver"] for row in rows_of("speed") if row["owner"] == "library"}
    assert libraries == set(headings)


@pytest.mark.parametrize("suite", MEASURED)
def test_the_same_problem(suite: str) -> None:
    asked: dict[str, set[tuple[str, float]]] = defaultdict(set)
    for row in rows_of(suite):
        asked[row["scene"]].add((row["scene_key"], row["limit_mm"]))
    assert {len(each) for each in asked.values()} == {1}


@pytest.mark.parametrize("suite", MEASURED)
def test_the_same_machine(suite: str) -> None:
    """One for each round of a scene; the rows of a scene that one commit measured follow one another."""
    machines: dict[tuple[str, str], set[str]] = defaultdict(set)
    times: dict[tuple[str, str], list[datetime]] = defaultdict(list)
    rounds = {(row["scene"], row["round"]) for row in rows_of(suite) if row.get("round")}
    for row in rows_of(suite):
        began = row.get("round") or row.get("beside_round") or ""
        machines[row["scene"], began].add(row["machine"])
        if row.get("case") is None:
            at = datetime.fromisoformat(row["recorded_at"])
            times[row["commit"], row["scene"]].append(at)
        if row.get("beside_round"):
            assert (row["scene"], began) in rounds
            after = (at - datetime.fromisoformat(began)).total_seconds()
            assert after <= ROUND_LASTS.total_seconds() + row["time_limit_s"] + SLACK_S, row["key"]
    assert {len(at) for at in machines.values()} == {1}
    spans = sorted((min(at), max(at)) for at in times.values())
    assert all(end <= start for (_, end), (start, _) in pairwise(spans))


@pytest.mark.parametrize("suite", MEASURED)
def test_versions_and_commands(suite: str) -> None:
    rows = rows_of(suite)
    assert all(row["solver_version"] and row["commit"] for row in rows)
    assert len({row["key"] for row in rows}) == len(rows)


@pytest.mark.parametrize("suite", WITH_LOGS)
def test_logs_are_published(suite: str) -> None:
    others = (row for row in counting(rows_of(suite)) if owner_of(row["solver"]) != "ours")
    logs = {row["log"] for row in others} - {None}
    assert logs
    assert all((PUBLISHED / suite / log).is_file() for log in logs)


def test_three_figures() -> None:
    """The README and the page on speed claim no ratio to the libraries but those of the table."""
    claim = r"librar.{0,150}times as (long|fast)|times as (long|fast).{0,150}librar"
    for page in (ROOT / "README.md", ROOT / "docs/speed.md"):
        for line in page.read_text("utf-8").split("\n- "):
            assert not re.search(claim, line, re.DOTALL), line


@pytest.mark.parametrize("suite", MEASURED)
def test_failures_are_shown(suite: str) -> None:
    for row in rows_of(suite):
        assert row["status"] in STATUSES
        if row["status"] in ("crashed", "time_limit", "memory_limit", "unsupported"):
            assert row["message"], row["key"]
