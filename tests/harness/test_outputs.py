"""What a command may not write is said before its work, in one line that names the option and the path."""

import os
from pathlib import Path

import pytest
from commands import harness, wrong_usage
from strip_scene import write_strip

from harness.results.records import PLANS
from harness.results.schema import SERIES
from harness.scene.solve import OUTPUTS
from report.writers.answer_report import CAPTIONS

pytestmark = pytest.mark.usefixtures("without_pictures")
COMMANDS = [
    "solve gallery/sheet-over-former --out OUT",
    "export gallery/sheet-over-former --format npz --out OUT/scene.npz",
    "import K.mtx --out OUT/own.npz",
    "init OUT/joint.toml",
    "gate . --junit OUT/gate.xml",
    "gate . --json OUT/gate.json",
]


@pytest.mark.parametrize(
    "command",
    [
        "compare RUN RUN --out RUN/measurements.jsonl",
        "series gallery/sheet-over-former --gaps g.csv --out g.csv",
        "solve gallery/sheet-over-former --out /",
    ],
)
def test_no_input_is_written_to(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("RUN").mkdir()
    Path("RUN/measurements.jsonl").touch()
    Path("g.csv").write_text("0.1\n")
    done = harness(*command.split())
    assert done.exit_code == 2
    assert done.stderr.startswith("--out: path = ")
    assert len(done.stderr.splitlines()) == 1


def test_an_answer_replaces_no_file_that_its_scene_names(tmp_path: Path) -> None:
    matrices, scene = tmp_path / "out/solution.npz", tmp_path / "scene.toml"
    assert not harness("export", "gallery/sheet-over-former", "--format", "npz", "--out", matrices).exit_code
    scene.write_text('[matrices]\nproblem = "out/solution.npz"\n')
    content = matrices.read_bytes()
    assert "is one of the files that are read" in wrong_usage("solve", scene, "--out", tmp_path / "out")
    assert matrices.read_bytes() == content


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("series strip.toml --cases 1", "report/scan.csv"),
        ("series strip.toml --cases 1", "allowed-gap.csv"),
        ("place strip.toml --count 1 --cases 2 --share 1", "report/scan.csv"),
        ("place strip.toml --count 1 --cases 2 --share 1", "plan/scan.csv"),
        ("tolerance strip.toml --key initial_gap.mean --range 0.1:0.2 --allow-gap 1", "shares.csv"),
        ("solve strip.toml", "nodes.csv"),
        ("solve strip.toml", "exceeding.csv"),
        ("solve strip.toml", "gap.png"),
        ("solve strip.toml strip.toml", "contacts.csv"),
        ("solve strip.toml strip.toml", "gaps.png"),
        ("compare a b", "index.html"),
        ("compare a b", "solvers.csv"),
        ("export strip.toml --form dual", "P.mtx"),
        ("run gate --solver gi --scene gallery/three-part-stack", "report/scan.csv"),
        ("run gate --solver gi --scene gallery/three-part-stack", "suite.toml"),
    ],
)
def test_a_file_that_no_command_wrote_is_left_alone(
    command: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Said before the work: nothing is written into the folder."""
    monkeypatch.chdir(tmp_path)
    write_strip(tmp_path)
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    told = wrong_usage(*command.split(), "--out", ".")
    assert f"has {Path(name).parts[0]} of another command: name another directory" in told
    assert sorted(tmp_path.rglob("*")) == before
    assert file.read_text() == "mine"


def test_every_picture_of_an_answer_is_among_its_outputs() -> None:
    assert {f"{name}.png" for name in CAPTIONS} < {*OUTPUTS}


@pytest.mark.parametrize("command", ["series strip.toml --cases 1", "place strip.toml --count 1 --cases 2"])
def test_a_scan_among_the_files_of_a_report_is_left_alone(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the command has a report already, as its journal says."""
    monkeypatch.chdir(tmp_path)
    write_strip(tmp_path)
    Path("report").mkdir()
    Path("report/worst-case.csv").write_text("x,y,gap\n")
    for journal in (SERIES, PLANS):
        Path(journal).touch()
    told = wrong_usage(*command.split(), "--around", "report/worst-case.csv", "--out", ".")
    assert "report/worst-case.csv': is one of the files that are read" in told


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("out", ["file/out", "locked/out"])
def test_refused_before_work(command: str, out: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("locked").mkdir()
    monkeypatch.setattr(os, "access", lambda path, _: Path(path).name != "locked")  # root may write anywhere
    monkeypatch.setattr("harness.scene.solution.solve", None)  # not called
    done = harness(*command.replace("OUT", out).split())
    assert done.exit_code == 2
    assert "cannot be written" in done.stderr
    assert out in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "locked"]


@pytest.mark.parametrize("option", ["--json", "--junit"])
def test_a_folder_is_no_file_of_findings(option: str, tmp_path: Path) -> None:
    assert "cannot be written: it is a folder" in wrong_usage("gate", tmp_path, option, tmp_path)
