"""A measurement that cannot end in time is not run, and only such a one."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.measurement.solver_descriptions import Description, outdated
from harness.measurement.task import Task, run_task
from harness.planning.plan import expand
from harness.planning.suite import suite_from
from harness.planning.tolerance_search import predicted_timeout


def plan(**changes):
    data = {
        "scenes": ["4386/0107", "6112/0600"],
        "time_limit_s": 30,
        "time_limit_by_size_s": {"6112": 40},
        "solver": [{"name": "piqp"}],
    }
    return expand(suite_from(data | changes, Path("suite.toml")))


def row(scene, n, status="time_limit", limit=30.0, **changes):
    same = {"solver": "piqp", "form": "primal", "variant": "", "tolerance": 1e-9, "options": {}}
    facts = {
        "scene": scene,
        "n": n,
        "status": status,
        "time_limit_s": limit,
        "threads_asked": 2,
        "stop": None,
    }
    return same | facts | changes


@pytest.fixture
def large():
    return next(m for m in plan() if m.scene == "6112/0600" and m.form == "primal")


def test_limits_go_by_size(large):
    assert large.time_limit_s == 40
    assert {m.time_limit_s for m in plan() if m.scene == "4386/0107"} == {30}
    assert {m.time_limit_s for m in plan(time_limit_by_size_s={}, time_limit_s=7)} == {7}


def test_too_slow_on_every_smaller_scene_is_not_run(large):
    rows = [row("4386/0107", 4386), row("4386/1471", 4386)]
    assert predicted_timeout(large, 6112, rows) == "4386/0107, 4386/1471"


@pytest.mark.parametrize(
    ("form", "limit", "late"), [("primal", 28.0, True), ("sparse", 28.0, False), ("sparse", 29.0, True)]
)
def test_the_sparse_forms_time_may_grow_no_faster_than_the_size(form, limit, late):
    m = next(m for m in plan() if m.scene == "6112/0600" and m.form == form)
    assert bool(predicted_timeout(m, 6112, [row("4386/0107", 4386, limit=limit, form=form)])) == late


def test_what_is_left_behind_on_two_scenes_is_not_run_on_a_third_of_the_size(large):
    """By more than 3 times the fastest other library, 10 s at least."""
    behind = replace(large, stop_at_times_fastest=10.0)
    one, two, three = (
        [cell(f"6112/{k}", s), cell(f"6112/{k}", 9.0, solver="scs")] for k, s in enumerate((28.0, None, 26.0))
    )
    assert predicted_timeout(behind, 6112, [*one, *two]) == "6112/0, 6112/1"
    assert not predicted_timeout(behind, 6112, one)
    assert not predicted_timeout(behind, 6112, [*one, *two, *three])
    assert not predicted_timeout(behind, 6112, [*one, two[0]])  # nothing to compare with
    assert not predicted_timeout(behind, 6112, [*one, two[0], two[1] | {"solver": "piqp", "form": "dual"}])
    assert not predicted_timeout(large, 6112, [*one, *two])
    assert not predicted_timeout(behind, 6112, [each | {"n": 11308} for each in (*one, *two)])
    slow = [one[0] | {"tolerance": 1e-3, "verdict": "outside", "solve_s": 5.0}]  # not within: does not count
    assert predicted_timeout(behind, 6112, [*one, *slow, *two]) == "6112/0, 6112/1"
    too_large = [*one[1:], one[0] | {"status": "memory_limit", "verdict": "no_answer", "solve_s": 1.0}]
    assert predicted_timeout(behind, 6112, [*too_large, *two]) == "6112/0, 6112/1"
    quick = [each | {"solve_s": each["solve_s"] and each["solve_s"] / 3} for each in (*one, *two)]
    assert not predicted_timeout(behind, 6112, [each | {"time_limit_s": 9.9} for each in quick])  # below 10 s


def test_of_what_is_left_behind_on_all_scenes_of_the_smaller_size_one_of_the_next_is_enough(large):
    behind = replace(large, stop_at_times_fastest=10.0)

    def pair(n, k, seconds):
        other = {"n": n, "tolerance": 1e-9 if n == 6112 else 1e-8}
        slow, fast = cell(f"{n}/{k}", seconds), cell(f"{n}/{k}", 9.0, solver="scs")
        return [slow | other, fast | other]

    small, first = [*pair(4386, 0, 28.0), *pair(4386, 1, 28.0)], pair(6112, 0, 28.0)
    assert predicted_timeout(behind, 6112, [*small, *first]) == "4386/0, 4386/1, 6112/0"
    assert not predicted_timeout(behind, 6112, small)
    assert not predicted_timeout(behind, 6112, [*small[:2], *first])  # of one there
    assert not predicted_timeout(behind, 6112, [*small, *first, *pair(6112, 1, 26.0)])
    assert not predicted_timeout(behind, 6112, [*small[:2], *pair(4386, 1, 20.0), *first])


def cell(scene, seconds, solver="piqp"):
    """A row of this many seconds, within the limit; None: out of its time of 30 s."""
    ended = {"status": "solved", "verdict": "within"} if seconds else {"verdict": "no_answer"}
    return row(scene, 6112, solver=solver, solve_s=seconds, owner="library") | ended


def test_seconds_at_a_smaller_size_grow_like_its_square(large):
    ended = {"status": "solved", "verdict": "within"}
    slow, fast = (row(f"4386/{s}", 4386, solve_s=s) | ended for s in (21.0, 20.0))  # times 1.94
    assert predicted_timeout(large, 6112, [slow]) == "4386/21.0"
    assert not predicted_timeout(large, 6112, [fast])
    assert not predicted_timeout(large, 6112, [slow, fast])


@pytest.mark.parametrize(("seconds", "late"), [(0.2, False), (1.1, True)])
def test_what_is_constant_does_not_grow(large, seconds, late):
    """0.2 s at n = 306, times 400, are no 80 s: a first call takes as long at any size."""
    tiny = row("gallery/sheet-over-former", 306, solve_s=seconds) | {"status": "solved", "verdict": "within"}
    assert bool(predicted_timeout(large, 6112, [tiny])) == late


def test_what_is_not_run_says_so_and_counts_as_out_of_time(large, tmp_path):
    (told,) = run_task(Task([large], Description(["primal"], "1.0", ""), "4386/0107"), tmp_path).reports
    assert told == {"status": "not_run", "message": "too slow or too large already on 4386/0107"}
    assert not list(tmp_path.iterdir())
    rows = [row("4386/0107", 4386), row("4386/1471", 4386, told["status"])]
    assert predicted_timeout(large, 6112, rows) == "4386/0107, 4386/1471"
    assert predicted_timeout(large, 6112, [row("6112/0600", 6112, told["status"], 40.0, tolerance=1e-3)])
    assert not predicted_timeout(large, 6112, [row("6112/0600", 6112, told["status"], 39.0)])


@pytest.mark.parametrize("status", ["time_limit", "not_run"])
def test_a_row_out_of_time_stands_until_there_is_more_of_it(large, status):
    known = {"scene_key": "s", "solver_version": "1", "solver_code": "c", "gated": large.gated}
    rows = [row("6112/0600", 6112, status, t, limit_mm=large.limit_mm) | known for t in (40.0, 39.0)]
    assert [outdated(r, large, Description(["primal"], "1", "c"), "s") for r in rows] == [False, True]
    stopped, left_behind = rows[1] | {"stop": "10 × daqp"}, replace(large, stop_at_times_fastest=10.0)
    for m, expected in ((left_behind, False), (large, True)):
        assert outdated(stopped, m, Description(["primal"], "1", "c"), "s") is expected


@pytest.mark.parametrize("tolerance", [1e-9, 1e-3])
def test_out_of_time_at_a_looser_tolerance_is_not_run(large, tolerance):
    rows = [row("6112/0600", 6112, limit=40.0, tolerance=tolerance)]
    assert predicted_timeout(large, 6112, rows) == f"6112/0600 at {tolerance:g}"


@pytest.mark.parametrize(
    "rows",
    [
        [],
        [row("6112/0600", 6112, limit=40.0, tolerance=1e-10)],  # a tighter one says nothing
        [row("6112/0600", 6112, limit=39.0, tolerance=1e-3)],  # it has more time now
        [row("6112/0600", 6112, "solved", limit=40.0, tolerance=1e-3)],
        [row("4386/0107", 4386), row("4386/1471", 4386, "solved")],  # in time on one of them
        [row("6112/2300", 6112)],  # another scene of the same size says nothing
        [row("11308/0220", 11308)],  # nor does a larger one
        [row("4386/0107", 4386, limit=20.0)],  # 20 s · (6112/4386)² is less than 40 s
        [row("4386/0107", 4386, form="dual")],
        [row("4386/0107", 4386, options={"backend": "sparse"})],
        [row("4386/0107", 4386, tolerance=1e-8)],
    ],
)
def test_anything_else_is_run(large, rows):
    assert predicted_timeout(large, 6112, rows) == ""
