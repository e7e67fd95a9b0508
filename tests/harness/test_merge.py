"""`merge`: rows of two machines in one directory; nothing is compared across them."""

import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

import pytest
from commands import harness
from synthetic_results import results, row, write_rows

from harness.results import records
from report.analysis.time_to_solution import stage_seconds
from report.results.reader import read

pytestmark = pytest.mark.usefixtures("blank_pictures")

FAST, SLOW = "A fast CPU, 64 cores", "A slow CPU, 1 core"
LOW, HIGH = "4386/0052", "4386/1074"
SHARED = {"key": f"{LOW} shared", "solver": "gi"}


def machine(folder: Path, name: str, seconds: float, *rows: dict[str, Any]) -> Path:
    """A run of rows that all take so many seconds, as each of its matrices does."""
    times = {"machine": name, "solve_s": seconds, "setup_s": 0.0, "form_s": 0.0, "answer": "answers/a.npz"}
    folder.mkdir()
    write_rows(folder, [each | times for each in (row(**SHARED), *rows)])
    build = {step: seconds for step in ("condensation", "cholesky", "Q")}
    problem = {"scene": LOW, "title": "A scene", "n": 4386, "m": 2193, "build_s": build}
    (folder / "problems.jsonl").write_text(json.dumps(problem) + "\n")
    (folder / "machine.json").write_text(json.dumps({"machine": name, "cores": 1}))
    (folder / "suite.toml").write_text('name = "two"\nscenes = ["4386/0107"]\nsolver = [{ name = "gi" }]\n')
    return folder


@pytest.fixture
def both(tmp_path: Path) -> tuple[Path, Path]:
    sparse = {"form": "sparse", "model_s": 0.0}
    own = [row(LOW, "fast", key="fast"), row(LOW, "fast", key="fast sparse", **sparse)]
    others = [row(LOW, "slow", key="slow"), row(LOW, "slow", key="slow sparse", **sparse)]
    return machine(tmp_path / "fast", FAST, 2.0, *own), machine(tmp_path / "slow", SLOW, 1446.0, *others)


def test_no_ratio_is_of_two_machines(both: tuple[Path, Path], tmp_path: Path) -> None:
    """One machine takes 723 times as long for everything: no table or page says so."""
    out = tmp_path / "both"
    done = harness("merge", *both, "--out", out)
    assert done.exit_code == 0, done.output
    rows = records.read(out / records.MEASUREMENTS)
    assert [each["machine"] for each in rows] == [FAST] * 3 + [SLOW] * 3
    assert {each["answer"] for each in rows} == {None}
    assert {json.loads(path.read_text())["machine"] for path in out.glob("machine*.json")} == {FAST, SLOW}
    text = (out / "report" / "report.md").read_text("utf-8")
    tables = text + "".join(path.read_text("utf-8") for path in (out / "report").glob("*.csv"))
    numbers = {float(number) for number in re.findall(r"(?<![\w.-])\d+(?:\.\d+)?(?![\w.])", tables)}
    assert {1.0, 2.0, 1446.0} <= numbers
    assert not any(723 * 0.99 < each < 723 * 1.01 or 0 < abs(each - 1 / 723) < 1e-5 for each in numbers)
    assert f"Summary: {FAST}" in text
    assert f"Summary: {SLOW}" in text
    links = map(parse_qs, re.findall(r"\]\(index\.html#([^)]+)\)", text))
    assert [link["machine"] for link in links if link["row"] == [SHARED["key"]]] == [[FAST], [SLOW]]
    for part in read(out).by_machine():
        seconds = 2.0 if part.rows["machine"].iloc[0] == FAST else 1446.0
        assert set(part.cells["load_case_s"]) == {seconds}
        assert set(part.problems["machine"]) == set(part.rows["machine"])
        dense = stage_seconds(part)[lambda lines: lines["form"] == "dual"]
        assert set(dense["K_s"]) == {seconds}


@pytest.mark.parametrize("made_by", [SLOW, None])
def test_no_condensation_of_another_machine_is_added(tmp_path: Path, made_by: str | None) -> None:
    """As where workers measure what is opened here, or where an older version did not say whose it is."""
    rows = [row(LOW, form=form, machine=FAST, model_s=1.0) for form in ("dual", "sparse")]
    rows += [each | {"machine": SLOW} for each in rows] if made_by is None else []
    build = {step: 1446.0 for step in ("condensation", "cholesky", "Q")}
    problem = {"scene": LOW, "title": "A scene", "machine": made_by, "build_s": build}
    for part in results(tmp_path, rows, problem).by_machine():
        assert part.problems["title"].tolist() == ["A scene"]
        dense = stage_seconds(part)[lambda lines: lines["form"] == "dual"]
        assert dense[["K_s", "total_1_s"]].isna().all(axis=None)


def test_rounds_and_older_versions_stay_with_their_machine(tmp_path: Path) -> None:
    """What was measured beside others of its hour is compared on each machine, as before."""
    began, sides = "2026-01-01T00:00:00+00:00", []
    for name, seconds in ((FAST, 2.0), (SLOW, 1446.0)):
        beside = row(LOW, "textbook", key="beside", owner="textbook", round=began)
        sides.append(machine(tmp_path / name.split()[1], name, seconds, beside))
        records.append(sides[-1] / records.OUTDATED, row(LOW, "gi", machine=name, solver_version="0.9"))
    assert harness("merge", *sides, "--out", tmp_path / "both").exit_code == 0
    parts = read(tmp_path / "both").by_machine()
    assert [set(part.rows["machine"]) for part in parts] == [{FAST}, {SLOW}]
    for part in parts:
        for table in (part.rounds, part.outdated):
            assert table["machine"].tolist() == part.rows["machine"].tolist()
    assert [part.rounds["solve_s"].tolist() for part in parts] == [[2.0], [1446.0]]


def test_a_merged_run_is_merged_with_another(
    both: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each scene's facts stay with the machine that made them."""
    monkeypatch.setattr("harness.commands.merged_runs.report", lambda out: out)
    third = machine(tmp_path / "third", "A third", 3.0)
    assert harness("merge", *both, "--out", tmp_path / "two").exit_code == 0
    assert harness("merge", tmp_path / "two", third, "--out", tmp_path / "three").exit_code == 0
    problems = records.read(tmp_path / "three" / "problems.jsonl")
    made = [(each["machine"], each["build_s"]["Q"]) for each in problems]
    assert made == [(FAST, 2.0), (SLOW, 1446.0), ("A third", 3.0)]


def test_a_merge_that_is_interrupted_says_what_to_do_with_its_rows(
    both: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its report takes much longer than all the rest."""

    def interrupted(out: Path) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr("harness.commands.merged_runs.report", interrupted)
    done = harness("merge", *both, "--out", tmp_path / "out")
    assert done.exit_code == 130
    assert (tmp_path / "out" / records.MEASUREMENTS).exists()
    assert "nothing was written" not in done.output
    assert "`report` takes the merged rows" in done.output


@pytest.mark.parametrize("name", ["machine.json", "problems.jsonl", "suite.toml"])
@pytest.mark.parametrize("content", [b"\xff{", b"[1]\n"])
def test_a_damaged_file_is_named_before_anything_is_written(
    both: tuple[Path, Path], tmp_path: Path, name: str, content: bytes
) -> None:
    (both[1] / name).write_bytes(content)
    done = harness("merge", *both, "--out", tmp_path / "out")
    assert (done.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert str(both[1] / name) in done.output


def test_a_machine_without_a_name_is_refused(both: tuple[Path, Path], tmp_path: Path) -> None:
    (both[1] / "machine.json").write_text("{}")
    done = harness("merge", *both, "--out", tmp_path / "out")
    assert (done.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert f"{both[1] / 'machine.json'}: machine = None" in done.output


def test_runs_that_do_not_belong_together_are_refused(both: tuple[Path, Path], tmp_path: Path) -> None:
    fast, slow = both
    out = tmp_path / "both"
    assert harness("merge", fast, fast, "--out", out).exit_code == 5
    other = machine(tmp_path / "other", "A third", 1.0)
    write_rows(other, [row(HIGH, "gi", key="other")])
    done = harness("merge", fast, other, "--out", out)
    assert (done.exit_code, out.exists()) == (5, False)
    write_rows(other, [row(**SHARED, limit_mm=1e-3)])
    assert "another limit" in harness("merge", fast, other, "--out", out).stderr
    assert harness("merge", fast, slow, "--out", fast).exit_code == 2
    assert harness("merge", fast, tmp_path / "none", "--out", out).exit_code == 2


def test_a_run_is_held_against_all_before_it(both: tuple[Path, Path], tmp_path: Path) -> None:
    """It shares with the second what the first does not have."""
    third = machine(tmp_path / "third", "A third", 1.0, row(LOW, "slow", key="slow", limit_mm=1e-3))
    done = harness("merge", *both, third, "--out", tmp_path / "out")
    assert (done.exit_code, (tmp_path / "out").exists()) == (5, False)
    assert f"another limit than in {both[0]} and {both[1]}: 1e-07 mm" in " ".join(done.stderr.split())
