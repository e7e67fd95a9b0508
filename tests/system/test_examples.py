"""Each example prints the number that it is expected to; the solver template is a solver."""

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from commands import harness

from solvers.base import Solver
from solvers.plugin import load_plugin
from solvers.registry import modules

EXAMPLES = Path(__file__).parents[2] / "examples"
TEMPLATE = EXAMPLES / "my_solver.py"
PRINTED = {
    "accelerated_gradient": 45.282118,
    "judge_an_answer": 1.820476e-05,
    "own_matrices": 0.914625,
    "scene_in_python": 229.700842,
    "series_of_gaps": 0.127499,
    "will_it_close": 0.011875,
}


def test_every_example_is_tested() -> None:
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == sorted([*PRINTED, TEMPLATE.stem])


START = subprocess.run


def run_here(words: list[str], **options: Any) -> Any:
    """A command of the project that an example starts, in this process."""
    if words[:3] != [sys.executable, "-m", "harness"]:
        return START(words, **options)
    assert harness(*words[3:]).exit_code == 0
    return None


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("name", PRINTED)
def test_the_number(name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", [name])  # else a word of pytest's names its file
    monkeypatch.setattr(subprocess, "run", run_here)
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    (line,) = capsys.readouterr().out.splitlines()
    assert float(line) == pytest.approx(PRINTED[name], rel=2e-6)


def test_the_template_has_every_step() -> None:
    """That it has no faults: test_docs.py."""
    template = load_plugin(TEMPLATE)
    told = {"time_limit_s", "iteration_limit", "prints", "most"}  # of limits: no steps
    own = {name for name in vars(Solver) if not name.startswith("_")} - told
    assert own <= set(vars(template))
    assert all(getattr(template, name).__doc__ for name in own - {"forms", "distribution"})
    assert "my-solver" not in modules()
