"""Plug-ins that misbehave in a series: it ends, what was solved is kept, and the same command goes on."""

import signal
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from commands import harness, succeeds
from plugin_commands import LESS_MEMORY, MORE_MEMORY, interrupt, write
from strip_scene import write_strip

from harness import InputError
from harness.results import series_file
from harness.series.executors import solve_isolated
from harness.series.session import Job
from problems.load_cases.random_gaps import random_gaps
from problems.scene_files import read_scene
from solvers.registry import solver_version

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_report", "own_cache")]

COUNTED = "self.count = getattr(self, 'count', 0) + 1\n        if self.count == 3: "


def series(folder: Path, at_import: str = "", in_solve: str = "pass") -> list[object]:
    """The command for five cases with the plug-in."""
    write_strip(folder)
    plugin = write(folder, at_import, in_solve)
    words = ["series", folder / "strip.toml", "--plugin", plugin, "--solver", "mine", "--cases", 5]
    return [*words, "--check", 0, "--threads", 1, "--out", folder / "out"]


@pytest.mark.parametrize(
    ("fault", "limit", "status", "said"),
    [
        ("os.kill(os.getpid(), 11)", (), "crashed", "killed by SIGSEGV"),
        pytest.param(MORE_MEMORY, LESS_MEMORY, "memory_limit", "more than 700 MiB", marks=pytest.mark.starts),
        ("os.remove(problem.Q.filename)", (), "failed", "the solver wrote into the cache"),
    ],
)
def test_the_case_that_ends_the_process_is_a_row(
    tmp_path: Path, fault: str, limit: tuple[object, ...], status: str, said: str
) -> None:
    going = [*series(tmp_path, in_solve=COUNTED + fault), *limit]
    done = harness(*going)
    assert done.exit_code == 1
    assert f"case 2: {status}, no_answer" in done.output
    assert said in done.output
    assert status == "failed" or "Not solved: 2. Run the same command again." in done.output
    kept = list(series_file.rows(tmp_path / "out"))
    assert [row["verdict"] for row in kept] == ["within", "within", "no_answer"]
    if status != "crashed":
        return
    done = harness(*going)
    assert done.exit_code == 1  # for the one without an answer
    rows = list(series_file.rows(tmp_path / "out"))
    assert rows[:3] == kept
    assert [(row["case"], row["verdict"]) for row in rows[3:]] == [(3, "within"), (4, "within")]
    assert "4 within, 1 no answer" in done.output


def test_a_preparation_that_hangs_ends(tmp_path: Path) -> None:
    going = series(tmp_path)
    plugin = tmp_path / "mine.py"
    plugin.write_text(plugin.read_text() + "\n    def prepare(self, given):\n        time.sleep(60)\n")
    done = harness(*going, "--time-limit", 0.2)
    assert done.exit_code == 1
    assert "case 0: time_limit, no_answer: solve took more than 0.2 s" in done.output


def test_on_workers_too(tmp_path: Path, cluster: Any) -> None:
    going = series(tmp_path, in_solve="os._exit(7)")
    done = harness(*going, "--cases", 2, "--scheduler", cluster.scheduler_address)
    assert done.exit_code == 1
    assert "ended with exit code 7" in done.output
    assert "2 no answer" in done.output
    assert not any(psutil.Process(nanny.pid).children() for nanny in cluster.workers.values())


def test_a_rung_of_a_ladder_is_solved(tmp_path: Path) -> None:
    """The process of the plug-in makes it from its name."""
    np.save(tmp_path / "gaps.npy", np.array([[0.0], [1e-3]]))
    words = ["series", "hard/parts/two-nodes", "--gaps", tmp_path / "gaps.npy", "--out", tmp_path / "out"]
    succeeds(*words, "--plugin", write(tmp_path), "--solver", "mine", "--check", 0, "--threads", 1)
    assert [row["verdict"] for row in series_file.rows(tmp_path / "out")] == ["within", "within"]


@pytest.mark.parametrize("described", ["sha256:of another numpy=={numpy}", "{files} numpy==0.1"])
def test_another_plug_in_than_the_one_described_is_refused(tmp_path: Path, described: str) -> None:
    """It was edited meanwhile, or is older on a worker, as its library may be: a series is of one solver."""
    scene, path = read_scene(str(write_strip(tmp_path))), write(tmp_path)
    path.write_text(path.read_text() + '\n    distribution = "numpy"\n')
    version = described.format(files=solver_version("mine", path), numpy=np.__version__)
    plugin: Any = {"solver": "mine", "plugin": path, "plugin_version": version}
    job = Job(**plugin, scene=scene, cases=random_gaps(scene, 2, 0), form="dual", check=0, threads=1)
    with pytest.raises(InputError, match=rf"mine\.py: version = .*: {version}, as at the beginning"):
        list(solve_isolated(job, [0, 1]))


def test_a_series_with_a_plug_in_that_adds_a_folder_of_code_is_solved(tmp_path: Path) -> None:
    """What it imports from there is part of its version."""
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "added_code.py").touch()
    done = harness(*series(tmp_path, f"sys.path.insert(0, {str(tmp_path / 'more')!r}); import added_code"))
    assert done.exit_code == 0, done.output


def test_answers_are_proven_on_the_loads_as_they_were(tmp_path: Path) -> None:
    """Compiled code writes into arrays whatever their flags say: the bound was of the changed load case."""
    write_by_force = "load.g.flags.writeable = True; load.g[:] += 1.0"
    succeeds(*series(tmp_path, in_solve=write_by_force))
    verdicts = [row["verdict"] for row in series_file.rows(tmp_path / "out")]
    assert verdicts == ["within"] * 5


def test_a_signal_ends_what_sleeps(tmp_path: Path) -> None:
    go = tmp_path / "begun"
    going = series(tmp_path, in_solve=f"open({str(go)!r}, 'w'); time.sleep(60)")
    interrupt(going, go, signal.SIGTERM)
