"""A library is measured on larger scenes in the forms that were good on smaller ones; limits go by size."""

from dataclasses import replace
from pathlib import Path

import pytest
import tiny_joint

from harness.measurement.solver_descriptions import Description, outdated
from harness.planning.plan import expand
from harness.planning.suite import read_written, suite_from, to_toml
from harness.planning.tolerance_search import still_needed

SCENES = ["6112/0600", "4386/0107", "4386/1471", "6112/2300", "11308/0220"]


def plan(**changes):
    solver = {"name": "piqp", "forms": ["dual", "primal", "sparse"], "tolerances": [1e-9]}
    sizes = {"6112": 40}
    data = {"scenes": SCENES, "time_limit_s": 30, "time_limit_by_size_s": sizes, "times_best_form": 3}
    return expand(suite_from(data | {"solver": [solver]} | changes, Path("suite.toml")))


def row(scene, form, seconds, **changes):
    same = {"solver": "piqp", "variant": "", "tolerance": 1e-9, "options": {}, "repeat": 0}
    facts = {"scene": scene, "form": form, "threads_asked": 2, "status": "solved", "owner": "library"}
    verdict = "no_answer" if seconds is None else "within"
    return same | facts | {"solve_s": seconds, "verdict": verdict} | changes


def forms(scene, rows):
    return {m.form for m in plan() if m.scene == scene and still_needed(m, rows)}


ALL = {"dual", "primal", "sparse"}


def test_all_forms_on_the_first_of_the_smallest_size():
    rows = [row(scene, "dual", 1.0) for scene in SCENES]
    assert forms("4386/0107", rows) == ALL


@pytest.mark.parametrize(
    ("seconds", "first_of_next", "other_of_size"),
    [
        ({"dual": 1.0, "primal": 3.0, "sparse": 3.1}, {"dual", "primal"}, {"dual"}),
        ({"dual": 8.0, "primal": None, "sparse": 2.9}, {"dual", "sparse"}, {"sparse"}),
        ({"dual": 3.1, "primal": 4.0}, {"dual", "primal"}, set()),  # of a limit of 30 s
        ({"dual": None, "primal": None}, {"dual", "primal"}, {"dual", "primal"}),
        ({}, ALL, ALL),
    ],
)
def test_good_forms_go_on(seconds, first_of_next, other_of_size):
    rows = [row("4386/0107", form, each) for form, each in seconds.items()]
    assert forms("6112/0600", rows) == first_of_next
    assert forms("4386/1471", rows) == other_of_size
    assert forms("6112/2300", rows) == ALL  # nothing is known of the first of its size
    assert forms("11308/0220", rows) == ALL


def test_the_fastest_answer_within_the_limit_counts_and_ours_are_measured_in_all_forms():
    rows = [row("4386/0107", "dual", 1.0), row("4386/0107", "sparse", 2.0)]
    assert forms("4386/1471", [*rows, row("4386/0107", "sparse", 0.5, tolerance=1e-6)]) == {"sparse"}
    assert forms("4386/1471", [*rows, row("4386/0107", "sparse", 0.5, verdict="outside")]) == {"dual"}
    assert forms("4386/1471", [each | {"owner": "ours"} for each in rows]) == ALL
    assert {m.guide for m in plan(times_best_form=None)} == {None}


def test_own_matrices_neither_guide_nor_are_guided(tmp_path):
    """They all counted as the smallest size, and as one."""
    own = [str(tiny_joint.write_problem(tmp_path / f"{name}.npz")) for name in "ab"]
    guides = {m.scene: m.guide for m in plan(scenes=[*own, "4386/0107"])}
    assert guides == dict.fromkeys(("a", "b", "4386/0107"))


def test_limits_go_by_size():
    limits = {m.scene: m.time_limit_s for m in plan()}
    assert limits["6112/0600"] == limits["6112/2300"] == 40
    assert limits["4386/0107"] == limits["11308/0220"] == 30
    assert {m.time_limit_s for m in plan(time_limit_by_size_s={}, time_limit_s=7)} == {7}


def test_a_row_out_of_time_stands_until_there_is_more_of_it():
    m = next(m for m in plan() if m.time_limit_s == 40)
    facts = {"solver_version": "1", "solver_code": "c", "gated": True}
    facts |= {"limit_asked_mm": m.suite.limit_mm, "status": "time_limit"}
    rows = [row(m.scene, m.form, None, **facts, time_limit_s=limit) for limit in (40.0, 39.0)]
    rows.append(rows[0] | {"status": "not_run"})
    solver = Description(["primal"], "1", "c")
    assert [outdated(each, m, solver) for each in rows] == [False, True, True]
    assert not outdated(rows[1], replace(m, time_limit_s=39.0), solver)
    assert not outdated(rows[0], m, replace(solver, code="", failure="no network"))


def test_a_written_suite_may_have_a_key_of_an_older_version(tmp_path):
    suite = plan()[0].suite
    (tmp_path / "suite.toml").write_text("stop_at_times_fastest = 3\n" + to_toml(suite))
    assert read_written(tmp_path / "suite.toml") == suite
