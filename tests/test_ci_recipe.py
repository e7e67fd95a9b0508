"""The CI recipe: the action names what exists, and its script gates a plug-in of another project."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import tiny
from synthetic_results import row, write_rows

ROOT = Path(__file__).parents[1]
ACTION = (ROOT / "action.yml").read_text("utf-8")
PAGE = (ROOT / "docs" / "ci.md").read_text("utf-8")


def test_the_action_uses_the_inputs_that_it_declares() -> None:
    head, _, steps = ACTION.partition("runs:")
    declared = set(re.findall(r"^  (\w[\w-]*):$", head, re.MULTILINE))
    assert set(re.findall(r"inputs\.([\w-]+)", steps)) == declared
    for path in re.findall(r"\$GITHUB_ACTION_PATH/([\w./-]+)", steps):
        assert (ROOT / path).is_file(), path
    rows = re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE)
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == declared


def test_the_workflow_of_the_page_has_ten_lines() -> None:
    workflow = re.search(r"```yaml\n# [^\n]*\n(.*?)```", PAGE, re.DOTALL)
    assert workflow is not None
    assert len(workflow[1].splitlines()) == 10


@pytest.mark.slow
def test_the_script_gates_a_plugin_beside_folders_of_the_same_names(tmp_path: Path) -> None:
    """The project has a package `solvers` of its own, which breaks whoever imports it."""
    tiny.write_suite(tmp_path)
    for name in ("solvers", "harness"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError\n")
    before = row("20/3", "exact", threads_asked=1, displacement_error_mm=1e-12)
    write_rows(tmp_path / "baseline", [before | {"scene": "tiny"}])
    paths = {"PYTHONPATH": str(ROOT), "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", str(ROOT / ".ci" / "gate-plugin"), "exact.py", "out", "--threads", "1"],
        cwd=tmp_path,
        env=os.environ | paths | {"SUITE": "small.toml", "BASELINE": "baseline"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 of them are in baseline" in done.stdout
    assert (tmp_path / "out" / "gate.json").is_file()
    assert (tmp_path / "out" / "gate.xml").is_file()
