"""The gate held to an earlier run, and its findings as JSON and JUnit XML."""

import json
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pandas as pd
import pytest
from commands import harness
from suite_runs import changed, moved, rows_of, said_by
from synthetic_results import row
from typer.testing import Result

from harness.results import records
from harness.results.comparison import Incomparable, Side, measurement
from harness.results.records import Row
from harness.verification.findings import Baseline, Finding, read_baseline, write_junit
from harness.verification.gate import GateOutcome, append_summary, show
from harness.verification.judge import Judgement
from harness.verification.slowdown import slowdowns
from problems.errors import InputError

pytestmark = pytest.mark.slow


def gate(directory: Path, *words: object) -> Result:
    return harness("gate", directory, *words)


def answers(directory: Path) -> list[Path]:
    return [directory / row["answer"] for row in rows_of(directory)]


@pytest.mark.parametrize(
    ("shift", "margin", "code"), [(0.0, 10, 0), (9e-8, 10, 1), (9e-8, 1e7, 0), (5e-13, 10, 0), (2e-7, 1e9, 1)]
)
def test_lost_digits_are_reported(finished: Path, copy: Path, shift: float, margin: float, code: int) -> None:
    """The solver's own error is some 1e-15 mm: what counts below 1e-13 mm, the floor, is the floor."""
    moved(answers(copy)[0], shift)
    assert gate(copy).exit_code == (1 if shift > 1e-7 else 0)
    done = gate(copy, "--baseline", finished, "--margin", margin)
    assert done.exit_code == code, done.output
    if not code:
        assert "Errors compared: 2 of 2 gated rows" in done.stdout


def test_no_scene_is_opened_without_kept_answers(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.rmtree(copy / "answers")
    monkeypatch.setattr("harness.verification.gate.measurable", None)
    done = gate(copy)
    assert done.exit_code == 3, done.output
    assert "Nothing could be judged" in done.output


@pytest.mark.parametrize("errors", [(3e-9, 2e-9, 1e-9), (1e-9, 2e-9, 3e-9)])
def test_the_largest_error_of_repeats_counts(finished: Path, copy: Path, errors: tuple[float, ...]) -> None:
    first = rows_of(copy)[0]
    rows = [first | {"repeat": k, "displacement_error_mm": error} for k, error in enumerate(errors)]
    records.rewrite(copy / records.MEASUREMENTS, rows)
    found = read_baseline(copy, 10.0, "now", rows_of(finished))
    assert found.errors[measurement(first)][0] == 3e-9


def test_a_baseline_has_the_error_of_the_tolerance_that_a_search_keeps(finished: Path, copy: Path) -> None:
    loose, tight = (row | {"searched": True} for row in rows_of(finished))
    tight |= {"displacement_error_mm": 5e-9}
    records.rewrite(copy / records.MEASUREMENTS, [tight, loose | {"displacement_error_mm": 3e-9}])
    found = read_baseline(copy, 10.0, "now", [loose])
    assert {name: error for name, (error, _) in found.errors.items()} == {measurement(loose): 3e-9}


@pytest.mark.parametrize(("bound", "then"), [(1e-9, 1e-13), (1e-13, 1e-9)])
@pytest.mark.parametrize(("error", "exceeded"), [(0.9e-8, False), (1.1e-8, True)])
def test_none_below_bounds(finished: Path, bound: float, then: float, error: float, exceeded: bool) -> None:
    """The margin is 10, the error was 1e-12 mm."""
    row = rows_of(finished)[0]
    baseline = Baseline("then", 10.0, {measurement(row): (1e-12, then)})
    now = Judgement("within", reference_bound_mm=bound, displacement_error_mm=error)
    assert baseline.compared(row, Finding("now", now, 1e-7)).passed is not exceeded


@pytest.mark.parametrize(
    "figures", [{"verdict": "outside"}, *({"displacement_error_mm": error} for error in (None, float("nan")))]
)
def test_a_baseline_without_errors_compares_nothing(finished: Path, tmp_path: Path, figures: Any) -> None:
    """Nor one outside its limit."""
    done = gate(finished, "--baseline", changed(Path(shutil.copytree(finished, tmp_path / "old")), **figures))
    assert done.exit_code == 3
    assert "Nothing could be compared" in done.stdout


@pytest.mark.parametrize(
    "words",
    [
        ("--json", "RUN/suite.toml"),
        ("--junit", "RUN/measurements.jsonl"),
        ("--json", "RUN/answers/../measurements.jsonl"),
        ("--json", "RUN/link.json"),
        ("--json", "BEFORE/hard", "--junit", "BEFORE/harder"),
        ("--json", "RUN/x", "--junit", "RUN/answers/../x"),
        ("--baseline", "BEFORE", "--json", "BEFORE/suite.toml"),
    ],
)
def test_outputs_replace_no_file(finished: Path, copy: Path, words: tuple[str, ...], tmp_path: Path) -> None:
    (copy / "link.json").symlink_to(copy / "suite.toml")
    (copy / "hard").touch()
    (copy / "harder").hardlink_to(copy / "hard")
    contents = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    done = gate(copy, *(word.replace("RUN", str(copy)).replace("BEFORE", str(copy)) for word in words))
    assert done.exit_code == 2
    assert "name another" in done.stderr
    assert {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()} == contents


@pytest.mark.parametrize(
    ("figures", "message"),
    [
        ({"scene": "another", "suite": "other"}, "suite other"),
        ({"scene_key": "another"}, "another problem"),
        ({"limit_mm": 1e-3}, "another limit"),
    ],
)
def test_other_baseline_is_refused(finished: Path, copy: Path, figures: dict[str, Any], message: str) -> None:
    done = gate(finished, "--baseline", changed(copy, **figures))
    assert done.exit_code == 5
    assert message in done.stderr
    assert gate(finished, "--baseline", copy / "none").exit_code == 2


def test_a_message_of_any_characters_is_xml(tmp_path: Path) -> None:
    """XML has no control characters, no lone surrogates and no U+FFFE."""
    why = "".join(map(chr, [*range(0x20), 0xD800, 0xFFFE, 0xFFFF, 0xFDD0])) + '<&"é'
    write_junit(tmp_path / "gate.xml", [Finding("a b", Judgement("no_answer"), 1e-7, why)])
    (error,) = ElementTree.parse(tmp_path / "gate.xml").getroot().iter("error")
    assert str(error.get("message")).endswith('<&"é')


def test_the_findings_are_files_for_a_ci(finished: Path, copy: Path, tmp_path: Path) -> None:
    moved(answers(copy)[0], 9e-8)
    answers(copy)[1].unlink()
    files = ["--json", tmp_path / "new" / "gate.json", "--junit", tmp_path / "new" / "gate.xml"]
    assert gate(copy, "--baseline", finished, *files).exit_code == 1
    content = json.loads((tmp_path / "new" / "gate.json").read_text())
    assert (content["passed"], content["exit_code"]) == (False, 1)
    first, second = content["measurements"]
    assert (first["verdict"], first["passed"]) == ("within", False)
    assert first["why"].startswith("more than 10 times the baseline's")
    assert first["displacement_error_mm"] == pytest.approx(9e-8, rel=1e-3)
    assert 0 <= first["baseline_mm"] < 1e-12
    assert (second["key"], second["verdict"]) == (rows_of(copy)[1]["key"], "no_answer")
    root = ElementTree.parse(tmp_path / "new" / "gate.xml").getroot()
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("2", "1", "1")
    assert [child.tag for case in root.iter("testcase") for child in case] == ["failure", "error"]
    assert {case.get("classname") for case in root.iter("testcase")} == {"tiny"}
    assert gate(finished, *files).exit_code == 0
    root = ElementTree.parse(tmp_path / "new" / "gate.xml").getroot()
    assert (root.get("failures"), root.get("errors")) == ("0", "0")


def timed(first: Row, times: list[float], others: list[float]) -> list[Row]:
    """A row in repeats of these seconds, and of another solver, which is not gated, on its scene."""
    words = first["key"].replace("repeat=0", "repeat={}").replace("exact", "{}")
    return [
        first
        | {"solver": solver, "gated": solver == "exact", "key": words.format(solver, k)}
        | {"repeat": k, "setup_s": 0.0, "solve_s": t, "form_s": None}
        for solver, seconds in {"exact": times, "other": others}.items()
        for k, t in enumerate(seconds)
    ]


#: A gated row, which `timed` repeats.
FIRST = row("4386/0052", "exact", key="4386/0052 exact repeat=0")
BEFORE = [1.0, 1.1, 1.2], [2.0, 2.1, 2.2]


@pytest.mark.parametrize(
    ("times", "others", "slowdown"),
    [
        (*BEFORE, None),
        ([9.0, 9.9, 9.6], [20.0, 21.0, 22.0], None),  # another machine, ten times as slow
        ([2.0, 2.2, 2.4], [2.0, 2.1, 2.2], 2.0),
        ([0.2, 0.22, 0.24], [0.2, 0.21, 0.22], 2.0),  # a machine that is ten times as fast
        ([1.15, 2.2, 2.4], [2.0, 2.1, 2.2], None),  # within the noise of its repeats
        ([2.0, 2.2, 2.4], [2.0, 2.1, 8.0], None),  # within that of the other solver
        ([1.5, 1.54, 1.6], [2.0, 2.1, 2.2], None),  # 1.4, and 1.5 is allowed
    ],
)
def test_times_are_compared_beside_other_solvers(
    times: list[float], others: list[float], slowdown: float | None
) -> None:
    old, new = Side("old", timed(FIRST, *BEFORE)), Side("new", timed(FIRST, times, others))
    found = slowdowns(old, new, 1.5)
    slower = {name: ratio for name, ratio in found.items() if ratio is not None}
    assert slower == ({} if slowdown is None else {measurement(FIRST): pytest.approx(slowdown)})
    assert measurement(FIRST) in found


def test_no_pair_of_a_scenes_measurements_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """The load cases of a series are measurements of one scene: their square filled the memory."""
    monkeypatch.setattr(pd.DataFrame, "merge", None)
    cases = [timed(FIRST | {"case": k}, [1.0 + k, 1.1 + k, 1.2 + k], [2.0, 2.1, 2.2]) for k in range(3)]
    old = [row for case in cases for row in case]
    slower = [row | {"solve_s": row["solve_s"] * (3 if row["solver"] == "exact" else 1)} for row in old]
    found = slowdowns(Side("old", old), Side("new", slower), 1.5)
    ratios = [round(ratio, 9) for ratio in found.values() if ratio is not None]
    assert (ratios, len(found)) == ([3.0] * 3, 6)


def test_single_runs_tell_nothing_of_times() -> None:
    with pytest.raises(InputError, match="3 repeats of two solvers"):
        slowdowns(Side("old", timed(FIRST, [1.0], [2.0])), Side("new", timed(FIRST, [9.0], [2.0])), 1.5)


@pytest.mark.parametrize("mixed", ["old", "new"])
def test_no_median_is_of_two_machines(mixed: str) -> None:
    """One of the three repeats is of another, on one of the sides."""
    sides = {name: Side(name, timed(FIRST, *BEFORE)) for name in ("old", "new")}
    sides[mixed].rows[-1]["machine"] = "another"
    with pytest.raises(Incomparable, match=rf"{mixed}: machine = .*another.*one machine") as raised:
        slowdowns(**sides, limit=1.5)
    assert "Made-up CPU" in str(raised.value)


def test_a_slower_solver_does_not_pass(copy: Path, tmp_path: Path) -> None:
    """Although its answers are right, and the baseline is of another machine."""
    old = Path(shutil.copytree(copy, tmp_path / "old"))
    first = rows_of(copy)[0]
    records.rewrite(copy / records.MEASUREMENTS, timed(first, [2.0, 2.2, 2.4], [2.0, 2.1, 2.2]))
    records.rewrite(old / records.MEASUREMENTS, timed(first | {"machine": "another"}, *BEFORE))
    suite = (copy / "suite.toml").read_text().replace("[1e-06, 1e-08]", "[1e-06]")
    (copy / "suite.toml").write_text(suite.replace("repeats = 1", "repeats = 3"))
    assert gate(copy, "--baseline", old).exit_code == 0
    assert "Times compared: 3 of 3" in gate(copy, "--baseline", copy, "--max-slowdown", 1.5).stdout
    done = gate(copy, "--baseline", old, "--max-slowdown", 1.5, "--json", tmp_path / "gate.json")
    assert done.exit_code == 1
    assert "Slower: 3 of 3 gated rows." in done.stdout
    assert "2.00 times the baseline's time" in done.stdout
    assert json.loads((tmp_path / "gate.json").read_text())["measurements"][0]["slowdown"] == pytest.approx(2)


def test_a_time_that_cannot_be_compared_does_not_pass(copy: Path, tmp_path: Path) -> None:
    """One of two measurements has a single run on each side."""
    repeated, single = rows_of(copy)
    records.rewrite(copy / records.MEASUREMENTS, [*timed(repeated, *BEFORE), single])
    old = shutil.copytree(copy, tmp_path / "old")
    assert gate(copy, "--baseline", old).exit_code == 0
    done = gate(copy, "--baseline", old, "--max-slowdown", 1.5, "--junit", tmp_path / "gate.xml")
    assert done.exit_code == 3
    assert "Times compared: 3 of 4 gated rows." in done.stdout
    (error,) = ElementTree.parse(tmp_path / "gate.xml").getroot().iter("error")
    assert "cannot be compared" in str(error.get("message"))


def test_times_without_repeats_or_another_solver_tell_nothing(copy: Path, finished: Path) -> None:
    for words in (["--baseline", finished], []):
        done = gate(copy, *words, "--max-slowdown", 1.5)
        assert done.exit_code == 2
        assert ("in both runs: --repeat 3" if words else "needs --baseline DIR") in done.stderr


@pytest.mark.parametrize("option", ["--margin", "--max-slowdown"])
def test_a_factor_that_is_no_number_passes_nothing(option: str, finished: Path) -> None:
    """Nothing is larger than NaN: every measurement passed."""
    done = gate(finished, "--baseline", finished, option, "nan")
    assert done.exit_code == 2
    assert option in done.stderr


def test_the_outcome_is_said_also_if_the_page_cannot_be_written(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path))  # a folder
    done = gate(finished)
    assert done.exit_code == 2
    assert "Passed: all 2 gated rows" in done.stdout


def test_the_page_of_a_job_has_the_outcome(
    copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "summary.md"
    page.write_text("# Before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    moved(answers(copy)[1], 2e-7)
    assert gate(copy).exit_code == 1
    _, heading, _, sentence, _, headings, _, first, second, *_ = page.read_text().splitlines()
    assert (heading, sentence) == ("## The accuracy gate", "Accuracy lost: 1 of 2 gated rows.")
    assert [cell.strip() for cell in headings.split("|")[1:-1]][:2] == ["measurement", "error mm"]
    assert "outside" in first
    assert "within" in second
    assert rows_of(copy)[0]["key"] in second


def test_the_page_of_a_job_is_no_longer_than_github_takes(tmp_path: Path) -> None:
    """It drops a page of more than 1 MiB; a solver may say much of each failure."""
    failed = Finding("k" * 300, Judgement("no_answer"), 1e-7, "*" * 60_000)
    append_summary(tmp_path / "page.md", GateOutcome([failed] * 5000, 1, ("Accuracy lost.",)))
    page = (tmp_path / "page.md").read_text("utf-8")
    assert len(page.encode()) < 2**20
    assert page.rstrip().endswith("… and 4800 more")


def test_names_are_no_markup_on_the_page_of_a_job(tmp_path: Path) -> None:
    good = Finding("tiny exact", Judgement("within", displacement_error_mm=1e-9), 1e-7)
    append_summary(tmp_path / "page.md", GateOutcome([good], 0, ("None exceeds its error in <b>/*old*.",)))
    assert r"in &lt;b&gt;/\*old\*." in (tmp_path / "page.md").read_text("utf-8")


def test_an_error_has_the_digits_that_show_it_on_its_side_of_the_limit() -> None:
    lost = Finding("tiny exact", Judgement("outside", displacement_error_mm=1.000004e-7), 1e-7)
    _, text = said_by(show, GateOutcome([lost], 1, ("Accuracy lost.",)))
    assert "1.000004e-07" in text
