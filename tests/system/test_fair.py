"""The rules of docs/fair.md, each held to the published rows: one function per rule, by its name."""

import json
import re
from collections import defaultdict
from datetime import datetime
from functools import cache
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any

import pytest

from harness.planning.plan import DECADES, expand
from harness.planning.suite import read_written
from harness.results.schema import STATUSES, STEPS
from problems.random_scenes import SIZES
from solvers.registry import make_solver, modules, owner_of
from studies.publish import NAMES, PUBLISHED

ROOT = Path(__file__).parents[2]
FAIR = (ROOT / "docs/fair.md").read_text("utf-8")
MEASURED = [name for name in NAMES if (PUBLISHED / name / "suite.toml").is_file()]
Row = dict[str, Any]


@cache
def rows_of(suite: str) -> list[Row]:
    text = (PUBLISHED / suite / "measurements.jsonl").read_text("utf-8")
    return [json.loads(line) for line in text.splitlines()]


def seconds(row: Row) -> float:
    return float(sum(row[step] or 0.0 for step in STEPS))


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
    measured, suite = cells(rows_of("speed")), read_written(PUBLISHED / "speed" / "suite.toml")
    for scene in {row["scene"] for row in rows_of("speed")}:
        for name in {entry.name for entry in suite.solver} & set(modules()):
            for form in make_solver(name, {}).forms:
                assert measured[scene, name, form, ""], (scene, name, form)


def test_loosest_tolerance() -> None:
    measured = cells(rows_of("speed"))
    for cell, rows in measured.items():
        if owner_of(cell[1]) != "library" or "tolerance" in (rows[0]["details"] or {}):
            continue
        within = [row["tolerance"] for row in rows if row["verdict"] == "within"]
        if within and max(within) < DECADES[0]:
            looser = DECADES[DECADES.index(max(within)) - 1]
            like = [row for other, some in measured.items() if other[1:] == cell[1:] for row in some]
            at = [row for row in like if row["n"] == rows[0]["n"] and row["tolerance"] == looser]
            here = any(row["scene"] == cell[0] for row in at)
            missed = {row["scene"] for row in at if row["verdict"] != "within"}
            assert here or (len(missed) >= 2 and len(missed) == len({row["scene"] for row in at})), cell


def test_stopped_only_when_far_behind() -> None:
    limits = read_written(PUBLISHED / "speed" / "suite.toml")
    assert limits.stop_at_times_fastest == 3
    for row in rows_of("speed"):
        within = [
            other
            for other in rows_of("speed")
            if other["scene"] == row["scene"] and other["verdict"] == "within" and not other["repeat"]
        ]
        other_forms = [
            3 * seconds(o)
            for o in within
            if (o["solver"], o["variant"]) == (row["solver"], row["variant"]) and o["form"] != row["form"]
        ]
        others = [3 * seconds(o) for o in within if o["owner"] == "library" and o["solver"] != row["solver"]]
        if row["stop"]:
            assert row["time_limit_s"] >= max(10.0, min(other_forms + others)), row["key"]
        else:
            assert row["time_limit_s"] == limits.time_limit(row["n"]), row["key"]


def test_not_run_only_after_two_losses() -> None:
    rows = rows_of("speed")
    late = [row for row in rows if row["status"] == "not_run"]
    assert late
    for row in late:
        scenes = row["message"].partition(" already on ")[2].split(" at ")[0].split(", ")
        same = ("solver", "form", "variant")
        cell = [r for r in rows if all(r[name] == row[name] for name in same) and r["scene"] in scenes]
        assert {r["scene"] for r in cell} == set(scenes), row["key"]
        same_size = {r["scene"] for r in cell if r["n"] == row["n"]}
        smaller = {r["scene"] for r in cell} - same_size
        growth = row["n"] / min(r["n"] for r in cell)
        growth *= growth if row["form"] != "sparse" else 1
        alike = [r for r in cell if r["tolerance"] == row["tolerance"]]
        grown = alike and not same_size and all(growth * took(r) >= row["time_limit_s"] for r in alike)
        if scenes == [row["scene"]] or grown:
            continue  # it ran out of time here, or would by its growth
        assert len(same_size) >= (1 if smaller else 2)
        assert not smaller or smaller == {f"drawn/{SIZES[SIZES.index(row['n']) - 1]}/{k}" for k in range(3)}
        for scene in scenes:
            here = [r for r in cell if r["scene"] == scene]
            if all(r["status"] in ("time_limit", "memory_limit", "not_run") for r in here):
                continue
            least = min(took(r) for r in [r for r in here if r["verdict"] == "within"] or here)
            others = [r for r in rows if r["scene"] == scene and r["owner"] == "library"]
            fastest = [took(r) for r in others if r["verdict"] == "within" and r["solver"] != row["solver"]]
            assert least >= max(10.0, 3 * min(fastest)), row["key"]


def took(row: Row) -> float:
    """Seconds, or the limit that was not enough; infinite if the memory was not."""
    if row["status"] == "memory_limit":
        return inf
    return float(row["time_limit_s"]) if row["status"] in ("time_limit", "not_run") else seconds(row)


def test_scenes_are_drawn() -> None:
    drawn = {f"drawn/{n}/{k}" for n in SIZES for k in range(3)}
    assert {row["scene"] for row in rows_of("speed")} == drawn


@pytest.mark.parametrize("suite", MEASURED)
def test_no_row_is_taken_out(suite: str) -> None:
    """What the suite beside the rows plans is there; of a search and of repeats by pace, the first."""
    plan = expand(read_written(PUBLISHED / suite / "suite.toml"))
    keys = {row["key"] for row in rows_of(suite)}
    missing = [m.key for m in plan if m.key not in keys and not (m.searched or m.paced)]
    assert not missing
    cell = {(row["scene"], row["solver"], row["form"], row["variant"]) for row in rows_of(suite)}
    assert {(m.scene, m.solver, m.form, m.variant) for m in plan} == cell


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
    """One for each scene, whose rows follow one another, repeat by repeat."""
    rows = [row for row in rows_of(suite) if row.get("case") is None]
    machines: dict[str, set[str]] = defaultdict(set)
    for row in rows_of(suite):
        machines[row["scene"]].add(row["machine"])
    assert {len(at) for at in machines.values()} == {1}
    times: dict[str, list[datetime]] = defaultdict(list)
    for row in rows:
        times[row["scene"]].append(datetime.fromisoformat(row["recorded_at"]))
    spans = sorted((min(at), max(at)) for at in times.values())
    assert all(end <= start for (_, end), (start, _) in pairwise(spans))


@pytest.mark.parametrize("suite", MEASURED)
def test_versions_and_commands(suite: str) -> None:
    rows = rows_of(suite)
    assert all(row["solver_version"] and row["commit"] for row in rows)
    assert len({row["key"] for row in rows}) == len(rows)


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
        if row["status"] in ("crashed", "not_run", "time_limit", "memory_limit", "unsupported"):
            assert row["message"], row["key"]
