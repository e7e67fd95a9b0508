"""The command line starts fast: help needs none of the libraries that compute or draw."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from commands import succeeds
from strip_scene import write_strip

from harness.cli.app import app
from harness.cli.series import series
from harness.terminal.docstrings import docstring
from problems import storage
from report.page import page_figures

SHOW = """
import sys
from harness.cli.app import main
try:
    main()
finally:
    print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr)
"""


ROOT = Path(__file__).parents[2]


def run(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    paths = {"PYTHONPATH": str(ROOT), "RIVETBENCH_CACHE": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | paths | environment,
    )
    assert "Traceback" not in done.stderr
    assert done.returncode == 0, done.stderr
    return done


def test_help_imports_nothing_that_is_slow(tmp_path: Path) -> None:
    done = run(tmp_path, "-c", SHOW, "--help")
    assert "Exit codes" in done.stdout
    slow = {"numpy", "scipy", "pandas", "matplotlib", "pydantic", "rich", "problems", "solvers", "report"}
    assert not slow & set(done.stderr.split())


def test_the_examples_of_a_help_stand_as_they_are_written() -> None:
    """Click takes them for paragraphs unless a backspace is before them."""
    for command in app.registered_commands:
        assert command.callback is not None
        for paragraph in (command.callback.__doc__ or "").split("\n\n"):
            example = "  python -m harness" in paragraph or "Exit codes:" in paragraph
            assert paragraph.lstrip(" ").startswith("\b\n") == example, paragraph


@pytest.mark.parametrize("words", [("validate", "gallery/three-part-stack"), ("--help",)])
def test_a_terminal_of_few_letters_ends_no_command(words: tuple[str, ...], tmp_path: Path) -> None:
    done = run(tmp_path, "-m", "harness", *words, LC_ALL="C", PYTHONUTF8="0", PYTHONIOENCODING="ascii")
    assert "?" in done.stdout or words == ("--help",)


#: A command that says something soon.
LIST = [sys.executable, "-m", "harness", "list", "formats"]


def test_a_closed_terminal_ends_no_command() -> None:
    done = subprocess.run(["sh", "-c", f"{' '.join(LIST)} >&-"], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_reader_that_goes_is_no_verdict() -> None:
    """`| head` closes the pipe; 1 would say that accuracy was lost."""
    with subprocess.Popen(LIST, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert (process.wait(), process.stderr and process.stderr.read()) == (141, b"")


#: Two commands in one process; the answer has no pictures.
HELP_AND_SOLVE = """
import runpy, sys
from report.writers import answer_report
answer_report.answer_figures = lambda *_: {}
for words in (["series", "--help"], ["solve", "strip.toml", "--out", "bare"]):
    sys.argv[1:] = words
    try:
        runpy.run_module("harness", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        if end.code:
            raise
    print("\\n---")
"""


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_optimised_python_writes_the_same_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a cache that has the page's map and scripts alone, which take Bokeh seconds."""

    def copied(key: str, make: Any) -> storage.Entry:
        entry = storage.load_or_make(key, make)
        shutil.copytree(storage.root() / key, tmp_path / "cache" / key)
        return entry

    monkeypatch.setattr(page_figures, "load_or_make", copied)
    succeeds("solve", write_strip(tmp_path), "--out", tmp_path / "plain")
    done = run(tmp_path, "-OO", "-c", HELP_AND_SOLVE, PYTHONDONTWRITEBYTECODE="")
    helped, *_ = done.stdout.split("\n---\n")
    assert " ".join(docstring(series).replace("\b", "").split()) in " ".join(helped.split())
    for name in ("contacts.csv", "nodes.csv"):
        assert (tmp_path / "bare" / name).read_bytes() == (tmp_path / "plain" / name).read_bytes()
    assert (tmp_path / "bare" / "index.html").is_file()
