"""A measurement is not run where its solver exceeded its limits before, and only there."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.measurement.solver_descriptions import Description, outdated
from harness.measurement.task import Task, run_task
from harness.planning.plan import expand
from harness.planning.suite import suite_from
from harness.planning.tolerance_search import exceeded_on


def plan(**changes):
    data = {
        "scenes": ["4386/0107", "6112/0600"],
        "time_limit_s": 30,
        "time_limit_by_size_s": {"6112": 40},
        "solver": [{"name": "piqp"}],
    }
    return expand(suite_from(data | changes, Path("suite.toml")))


def row(scene, status="time_limit", limit=40.0, **changes):
    same = {"solver": "piqp", "form": "primal", "variant": "", "tolerance": 1e-9, "options": {}}
    facts = {"scene": scene, "n": 6112, "status": status, "time_limit_s": limit, "threads_asked": 2}
    return same | facts | {"stop": None} | changes


@pytest.fixture
def large():
    return next(m for m in plan() if m.scene == "6112/0600" and m.form == "primal")


def stopped_at(m, times):
    return replace(m, suite=m.suite.model_copy(update={"stop_at_times_fastest": times}))


def test_limits_go_by_size(large):
    assert large.time_limit_s == 40
    assert {m.time_limit_s for m in plan() if m.scene == "4386/0107"} == {30}
    assert {m.time_limit_s for m in plan(time_limit_by_size_s={}, time_limit_s=7)} == {7}


@pytest.mark.parametrize("status", ["time_limit", "not_run", "memory_limit"])
def test_what_exceeds_its_limits_on_all_of_two_scenes_is_not_run_on_a_third_of_the_size(large, status):
    behind = stopped_at(large, 3.0)
    one, two = row("6112/1", status, 10.0, tolerance=1e-6), row("6112/2", limit=12.0)
    assert exceeded_on(behind, 6112, [one, two]) == "6112/1, 6112/2"
    assert not exceeded_on(large, 6112, [one, two])  # each loss is of interest where nothing is stopped
    for other in (
        [],
        [two | {"n": 4386}],
        [two | {"form": "dual"}],
        [two | {"options": {"backend": "sparse"}}],
        [two, two | {"status": "solved", "tolerance": 1e-3}],
        [two, row("6112/3", "solved")],
    ):
        assert not exceeded_on(behind, 6112, [one, *other])


def test_what_is_not_run_says_so(large, tmp_path):
    (told,) = run_task(Task([large], Description(["primal"], "1.0", ""), "4386/0107"), tmp_path).reports
    assert told == {"status": "not_run", "message": "too slow or too large already on 4386/0107"}
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("status", ["time_limit", "not_run"])
def test_a_row_out_of_time_stands_until_there_is_more_of_it(large, status):
    known = {"scene_key": "s", "solver_version": "1", "solver_code": "c", "gated": large.entry.gated}
    rows = [row("6112/0600", status, t, limit_asked_mm=large.suite.limit_mm) | known for t in (40.0, 39.0)]
    assert [outdated(r, large, Description(["primal"], "1", "c"), "s") for r in rows] == [False, True]
    stopped, left_behind = rows[1] | {"stop": "10 × daqp"}, stopped_at(large, 10.0)
    for m, expected in ((left_behind, False), (large, True)):
        assert outdated(stopped, m, Description(["primal"], "1", "c"), "s") is expected


@pytest.mark.parametrize("status", ["time_limit", "not_run"])
@pytest.mark.parametrize("tolerance", [1e-9, 1e-3])
def test_out_of_time_at_a_looser_tolerance_is_not_run(large, tolerance, status):
    rows = [row("6112/0600", status, tolerance=tolerance)]
    assert exceeded_on(large, 6112, rows) == f"6112/0600 at {tolerance:g}"


@pytest.mark.parametrize(
    "rows",
    [
        [],
        [row("6112/0600", tolerance=1e-10)],  # a tighter one says nothing
        [row("6112/0600", limit=39.0, tolerance=1e-3)],  # it has more time now
        [row("6112/0600", "solved", tolerance=1e-3)],
        [row("6112/0600", form="dual")],
        [row("6112/2300")],  # another scene
    ],
)
def test_anything_else_is_run(large, rows):
    assert exceeded_on(large, 6112, rows) == ""
