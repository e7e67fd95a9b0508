"""The CI recipe: the action names what exists, and its script gates a plug-in of another project."""

import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
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


STUB = """#!/bin/sh
echo "$PYTHONSAFEPATH $*" >> calls
case "$3" in run) exit $RUN ;; gate) exit $GATE ;; esac
"""


@pytest.mark.parametrize(
    ("run", "gate", "code"), [(0, 0, 0), (0, 1, 1), (1, 1, 1), (3, 3, 3), (2, 0, 2), (130, 0, 130), (0, 5, 5)]
)
def test_the_script_ends_as_the_gate_does(run: int, gate: int, code: int, tmp_path: Path) -> None:
    """What `run` could not measure is for the gate to say; its wrong usage, or its end by Ctrl-C, is not."""
    stub = tmp_path / "python"
    stub.write_text(STUB)
    stub.chmod(0o755)
    paths = {"PATH": f"{tmp_path}:{os.environ['PATH']}", "BASELINE": "before", "SUITE": "mine.toml"}
    done = subprocess.run(
        ["bash", str(ROOT / ".ci" / "gate-plugin"), "ci/exact.py", "out", "--threads", "1"],
        cwd=tmp_path,
        env=os.environ | paths | {"RUN": str(run), "GATE": str(gate)},
    )
    assert done.returncode == code
    calls = (tmp_path / "calls").read_text().splitlines()
    assert calls[0] == "1 -m harness check --plugin ci/exact.py"
    assert calls[1] == "1 -m harness run mine.toml --plugin ci/exact.py --solver exact --out out --threads 1"
    judged = "1 -m harness gate out --json out/gate.json --junit out/gate.xml --baseline before --margin 10"
    assert calls[2:] == ([judged] if run in (0, 1, 3) else [])


def test_the_name_of_the_artifact_has_no_slash(tmp_path: Path) -> None:
    """GitHub takes none, but the directory may lie in another."""
    (command,) = re.findall(r"run: (.* >> \"\$GITHUB_OUTPUT\")$", ACTION, re.MULTILINE)
    said = tmp_path / "output"
    names = {"OUT": "results/my gate_1.0", "GITHUB_OUTPUT": str(said)}
    subprocess.run(["bash", "-c", command], env=os.environ | names, check=True)
    assert said.read_text() == "name=results-my-gate_1.0\n"
