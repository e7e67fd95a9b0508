"""The gate held to an earlier run, and its findings as JSON and JUnit XML."""

import json
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from commands import harness
from suite_runs import changed, moved, rows_of
from typer.testing import Result

from harness.results import records
from harness.results.comparison import measurement
from harness.verification.findings import Baseline, Finding, read_baseline, write_junit
from harness.verification.judge import Judgement

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
        assert "2 of them are in" in done.stdout


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
