"""The sections on versions of a library, side by side and over time."""

import json
from pathlib import Path
from typing import Any

import pytest
from synthetic_results import no_answer, results, row, shown

from report.analysis.checks import warnings
from report.document.blocks import Section, Table, Text
from report.results.reader import read
from report.sections import history, versions

LOW, HIGH = "4386/0052", "4386/1074"


def told(directory: Path, rows: list[dict[str, Any]]) -> Section | None:
    return versions.section(results(directory, rows))


def of(version: str, scene: str = LOW, solver: str = "piqp", **more: Any) -> dict[str, Any]:
    """A row measured with --with."""
    named = {"variant": version, "solver_version": version}
    return row(scene, solver, **named | {"setup_s": 0.0, "form_s": 0.0} | more)


def test_what_became_worse_from_version_to_version(tmp_path: Path) -> None:
    outside: dict[str, Any] = {"verdict": "outside", "displacement_error_mm": 2e-6}
    failed = no_answer("failed") | {"message": "raised TypeError: setup()\nmore"}
    rows = [
        *(of("0.10.0", solve_s=0.5), of("0.9.0"), of("0.8.0", **failed)),
        *(of("0.9.0", HIGH), of("0.10.0", HIGH, **outside)),
        *(of("1.0", solver="osqp"), of("1.1", solver="osqp", displacement_error_mm=2e-8)),
        *(row(LOW, "clarabel"), of("3.0", HIGH, "clarabel")),  # on no scene two versions
    ]
    _, osqp, piqp, reasons = told(tmp_path, rows).blocks
    assert shown(piqp)[1:] == [
        [LOW, "dual", "0.8.0", "failed", "–", "–", "no answer", "–"],
        [LOW, "dual", "0.9.0", "1.00", "20", "1.0e-9", "within", "no answer → within"],
        [LOW, "dual", "0.10.0", "0.500", "20", "1.0e-9", "within", "2.00 times as fast"],
        [HIGH, "dual", "0.9.0", "1.00", "20", "1.0e-9", "within", "–"],
        [HIGH, "dual", "0.10.0", "1.00 (outside)", "20", "2.0e-6", "outside", "worse: within → outside"],
    ]
    assert piqp.caption.startswith(
        "*piqp*: 1 of 3 measurements became worse, 1 measurement without an answer."
    )
    assert isinstance(reasons, Text)
    assert reasons.markdown == "- piqp 0.8.0: raised TypeError: setup()"
    assert shown(osqp)[-1][-1] == "worse: 1.3 digits lost"
    assert not any("several versions" in warning for warning in warnings(read(tmp_path)))


@pytest.mark.parametrize(("seconds", "said"), [(1.05, "–"), (1.2, "worse: 1.20 times as long")])
def test_a_slowdown_counts_beyond_the_spread(tmp_path: Path, seconds: float, said: str) -> None:
    rows = [of(v, repeat=k, solve_s=s) for v, s in (("1", 1.0), ("2", seconds)) for k in range(3)]
    _, table = told(tmp_path, rows).blocks
    assert shown(table)[-1][-1] == said


def test_variants_tolerances_and_the_installed_version_are_told_apart(tmp_path: Path) -> None:
    rows = [row(LOW, "proxqp", solver_version="0.8.0", variant=base) for base in ("", "sparse")]
    for base in ("", "sparse "):
        named = {"variant": f"{base}proxsuite==0.7.2", "solver_version": "proxsuite==0.7.2"}
        rows += [row(LOW, "proxqp", tolerance=tol, **named) for tol in (1e-9, 1e-6)]
    _, table = told(tmp_path, rows).blocks
    assert [line[1:3] for line in shown(table)[1:]] == [
        *(["dual 1e-9", "proxsuite==0.7.2"], ["dual 1e-9", "0.8.0"]),
        *(["dual sparse 1e-9", "proxsuite==0.7.2"], ["dual sparse 1e-9", "0.8.0"]),
    ]
    searched = [of("1", searched=True, tolerance=1e-6), of("2", searched=True, tolerance=1e-8)]
    _, table = told(tmp_path / "searched", searched).blocks
    assert [line[1:3] for line in shown(table)[1:]] == [["dual", "1"], ["dual", "2"]]
    options = [of(version, options={"k": k}) for k in (1, 2) for version in "12"]
    _, table = told(tmp_path / "options", options).blocks
    assert [line[1:3] for line in shown(table)[1:]] == [[f"dual k = {k}", v] for k in (1, 2) for v in "12"]
    assert told(tmp_path / "one", [of("1.0"), of("1.0", HIGH), of("2.0", solver="osqp")]) is None


def test_versions_over_time_are_compared_on_the_same_problem(tmp_path: Path) -> None:
    """A scene that has changed since is another one, whatever its name."""
    began = "2025-01-01T00:00:00+00:00"
    textbook = [row(scene, "nnls", owner="textbook", round=began) for scene in (LOW, HIGH)]
    new = [row(scene, "piqp", solver_version="2", beside_round=began, scene_key="k") for scene in (LOW, HIGH)]
    results(tmp_path, [*textbook, *new])
    old = [each | {"solver_version": "1", "solve_s": 9.0} for each in new]
    old[0] |= {"scene_key": "as it was"}
    (tmp_path / "measurements.outdated.jsonl").write_text("".join(json.dumps(each) + "\n" for each in old))
    section = history.section(read(tmp_path))
    assert section is not None
    (lines,) = (shown(block)[1:] for block in section.blocks if isinstance(block, Table))
    assert [line[1:2] + line[3:6] for line in lines] == [["1", "1", "1", "9.35"], ["2", "1", "1", "1.35"]]
