"""How the report reads rows: those of several forms and of different code."""

import re
from pathlib import Path
from typing import Any

import pytest
from synthetic_results import HIGH, LOW, row, write_rows

from report.analysis import checks
from report.analysis.checks import warnings
from report.results.reader import read
from report.results.rows import in_order
from report.writers.suite_report import write

pytestmark = pytest.mark.usefixtures("without_pictures")
HERE, OTHER = "0123456789" * 4, "abcdef0123" * 4


@pytest.fixture(autouse=True)
def _drawn_by_one_commit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "provenance", lambda: {"commit": HERE, "clean": True})


def said(directory: Path, *rows: dict[str, Any]) -> list[str]:
    return warnings(read(write_rows(directory, list(rows))))


# Order and forms.


def test_ours_first_then_by_name_and_the_sparse_form_before_dual_and_primal(tmp_path: Path) -> None:
    lines = [("piqp", "primal"), ("newton", "dual"), ("clarabel", "sparse"), ("clarabel", "primal")]
    lines += [("clarabel", "dual"), ("gi", "primal"), ("mine", "other"), ("mine", "dual"), ("gi", "sparse")]
    cells = read(write_rows(tmp_path, [row(LOW, solver, form) for solver, form in lines])).cells
    assert in_order(cells) == [
        *("gi (sparse)", "gi (primal)", "newton (dual)"),
        *("clarabel (sparse)", "clarabel (dual)", "clarabel (primal)"),
        *("mine (dual)", "mine (other)", "piqp (primal)"),
    ]
    assert in_order(cells, "solver") == ["gi", "newton", "clarabel", "mine", "piqp"]


# Different code.


def test_rows_of_the_code_that_draws_call_for_no_warning(tmp_path: Path) -> None:
    assert said(tmp_path, row(LOW, "a", commit=HERE, clean=True), row(LOW, "b", commit=HERE)) == []


def test_rows_of_different_code_in_one_table_are_said_first(tmp_path: Path) -> None:
    rows = [row(LOW, "a", commit=HERE, clean=True), row(HIGH, "a", commit=OTHER, clean=False), row(LOW, "b")]
    mixed, unclean, older = said(tmp_path, *rows)
    assert mixed == (
        "The tables mix rows measured with different code: commit 0123456789 (1 row), commit abcdef0123 "
        "(1 row) and a commit that is not recorded (1 row)."
    )
    assert unclean == "1 row was measured with uncommitted changes to that commit."
    assert older == "1 of 3 rows was measured with other code than that which drew this report."
    text = write(tmp_path).read_text("utf-8")
    assert text.index(mixed) < text.index("|")
    assert re.search(rf"\| commit +\| {HERE} \(clean\), {OTHER} \(with uncommitted changes\) and not", text)


def test_rows_of_older_code_and_of_an_unknown_commit_are_said(tmp_path: Path) -> None:
    (older,) = said(tmp_path / "old", row(LOW, "a", commit=OTHER, clean=True))
    assert older == "All rows were measured with other code than that which drew this report."
    assert said(tmp_path / "unknown", row(LOW, "a")) == ["No row records the commit it was measured with."]
    (installed,) = said(tmp_path / "installed", row(LOW, "a", commit="0.2.0"))
    assert installed == older


def test_different_code_of_one_solver_is_said(tmp_path: Path) -> None:
    rows = [row(LOW, "a", commit=HERE, solver_code="one"), row(HIGH, "a", commit=HERE, solver_code="two")]
    rows += [row(LOW, "b", commit=HERE, solver_code="three")]
    assert said(tmp_path, *rows) == ["The tables mix rows of different code of a."]
    text = write(tmp_path).read_text("utf-8")
    assert re.search(r"\| a +\| 1.0 +\| one and two +\|", text)


def test_rows_of_two_problems_of_one_name_are_said(tmp_path: Path) -> None:
    keys = {LOW: ("old", "new"), HIGH: ("same", "same"), "6112/0100": ("", "unlike those that do not say")}
    pairs = [(scene, of, key) for scene, both in keys.items() for of, key in zip("ab", both, strict=True)]
    rows = [row(scene, of, commit=HERE, scene_key=key) for scene, of, key in pairs]
    (doubt,) = said(tmp_path, *rows)
    assert doubt.startswith(f"Rows of {LOW} are of several problems of that name")


def test_a_report_of_the_same_code_is_the_same_bytes(tmp_path: Path) -> None:
    directory = write_rows(tmp_path, [row(LOW, "a", commit=OTHER), row(HIGH, "a", commit=OTHER)])
    first = write(directory).read_bytes()
    assert write(directory).read_bytes() == first


def test_several_versions_and_other_threads_than_those_asked_for_are_said(tmp_path: Path) -> None:
    rows = [row(LOW, "a", solver_version="1.0"), row(HIGH, "a", solver_version="1.1", threads=1)]
    _, versions, threads = said(tmp_path, *rows)
    assert versions == "a was run in several versions: 1.0 and 1.1."
    assert threads.startswith("In 1 row (a) the number of threads in effect was not the requested one")


# What is missing.


def unfinished(directory: Path, suite: str, *rows: dict[str, Any]) -> list[str]:
    directory.mkdir()
    (directory / "suite.toml").write_text(f'scenes = ["{LOW}", "{HIGH}"]\n{suite}', "utf-8")
    return [doubt for doubt in said(directory, *rows) if "not finished" in doubt]


def test_rows_that_the_suite_does_not_plan_finish_no_run(tmp_path: Path) -> None:
    """Of other solvers, or of runs that a trace stopped."""
    suite = '[[solver]]\nname = "a"\nvariant = "v"\nwith = ["a==2.0"]\nforms = ["dual"]\n'
    there = row(LOW, "a", variant="v 2.0")
    others = [row(LOW, "b"), row(HIGH, "b"), row(HIGH, "a", variant="v 2.0 stopped at 4", iteration_limit=4)]
    (doubt,) = unfinished(tmp_path / "other", suite, there, *others)
    assert "1 of 2 combinations" in doubt
    assert unfinished(tmp_path / "whole", suite, there, there | {"scene": HIGH}) == []


def test_a_row_that_a_glob_of_the_suite_plans_is_missed(tmp_path: Path) -> None:
    for k, globs in enumerate(('["4386/*"]', '["4386/[0-1]*"]', '["*", "6112/*"]')):
        suite = f'[[solver]]\nname = "a"\nscenes = {globs}\n'
        (doubt,) = unfinished(tmp_path / f"lacks {k}", suite, row(LOW, "a"))
        assert "1 of 2 combinations" in doubt
        assert unfinished(tmp_path / f"has {k}", suite, row(LOW, "a"), row(HIGH, "a")) == []


def test_a_file_is_the_scene_that_its_rows_name(tmp_path: Path) -> None:
    suite = '[[solver]]\nname = "a"\nscenes = ["4386/*"]\n'
    rows = [row(LOW, "a", source=LOW), row(HIGH, "a", source="/x/high.toml")]
    assert unfinished(tmp_path / "name", suite, *rows) == []
    (tmp_path / "name" / "suite.toml").write_text(f'scenes = ["{LOW}", "/x/high.toml"]\n{suite}', "utf-8")
    assert not any("not finished" in doubt for doubt in warnings(read(tmp_path / "name")))


def test_forms_that_are_slow_are_left_out_of_libraries_alone(tmp_path: Path) -> None:
    suite = '[[solver]]\nname = "{}"\nforms = ["dual", "primal"]\n'
    rows = [row(LOW, "piqp"), row(LOW, "piqp", "primal"), row(HIGH, "piqp")]
    assert unfinished(tmp_path / "library", "times_best_form = 3\n" + suite.format("piqp"), *rows) == []
    ours = [each | {"solver": "gi", "owner": "ours"} for each in rows]
    assert len(unfinished(tmp_path / "ours", "times_best_form = 3\n" + suite.format("gi"), *ours)) == 1
