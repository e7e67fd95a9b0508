"""One measurement, whatever its solver does: a status, and no process left."""

import os
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny_joint
from suite_runs import all_end

from harness.measurement import child_process
from harness.measurement.solver_descriptions import Description
from harness.measurement.task import Task, run_task
from harness.measurement.worker import FinishedReport, measure
from harness.planning.plan import Measurement
from harness.planning.suite import SolverEntry, Suite
from problems.errors import InputError
from problems.scene_files import read_scene
from solvers.base import Form

pytestmark = pytest.mark.slow
starts = pytest.mark.starts

MIB = 300  # enough for a process that has started, not for one that the tests have forked


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("measure")
    tiny_joint.write_problem(folder / "tiny.npz")
    (folder / "faulty.py").write_text(tiny_joint.FAULTY)
    (folder / "exact.py").write_text(tiny_joint.EXACT)
    return folder


@pytest.fixture(autouse=True)
def _cache(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(folder / "cache"))


def measurement(
    folder: Path, name: str = "gi", plugin: bool = False, memory_limit_mib: int = 8192, **changes: Any
) -> Measurement:
    """Of a solver on the tiny scene; a plug-in is its file in the folder."""
    options = {"fault": fault} if (fault := changes.pop("fault", None)) else {}
    entry = SolverEntry(name=name, options=options)
    file = str(folder / f"{name}.py") if plugin else None
    suite = Suite(name="s", scenes=["tiny"], memory_limit_mib=memory_limit_mib, plugin=file, solver=[entry])
    asked = {"scene": "tiny", "source": str(folder / "tiny.npz"), "form": "dual", "time_limit_s": 20.0}
    return Measurement(suite, entry, tolerance=1e-9, threads=1, repeat=0, **asked | changes)


def outcome(
    folder: Path, fault: str | None = None, to: str = "answer.npz", plugin: bool = True, **changes: Any
) -> FinishedReport:
    """The row of a measurement, which leaves no process, not even one whose parent is gone."""
    name = changes.pop("solver", "faulty" if fault else "exact")
    (row,) = measure([measurement(folder, name, plugin, fault=fault, **changes)], [folder / to])
    assert all_end(folder / "cache")
    return row


@starts
def test_a_worker_that_dies_before_it_has_its_job(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The job cannot be handed over, neither when it is written nor when the pipe is closed."""
    popen = subprocess.Popen

    def stillborn(*arguments: Any, **options: Any) -> Any:
        process = popen(*arguments, **options)
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # dead, but not yet waited for
        return process

    monkeypatch.setattr(subprocess, "Popen", stillborn)
    row = outcome(folder)
    assert row["status"] == "crashed"
    assert "SIGKILL" in row["message"]


@starts
def test_an_answer_with_its_times_and_threads(folder: Path) -> None:
    row = outcome(folder, memory_limit_mib=MIB)
    assert row["status"] == "solved"
    assert row["answer"] == "answers/answer.npz"
    assert row["threads"] == 1
    assert row["kernels"]
    assert row["iterations"] == 1
    assert 10 < row["peak_rss_mib"] < MIB
    assert all(row[name] > 0 for name in ("load_s", "convert_s", "prepare_s", "setup_s", "solve_s", "form_s"))
    with np.load(folder / "answer.npz") as saved, np.load(folder / "tiny.npz") as given:
        x, lam, K, A = saved["x"], saved["lam"], given["K"], given["A"]
        gap = given["g"] - A.T @ x
        assert np.abs(K @ x - given["f"] + A @ lam).max() < 1e-12
        assert lam.min() >= 0
        assert gap.min() > -1e-14
        assert np.abs(lam * gap).max() < 1e-13
        assert 0 < np.count_nonzero(lam) < 10


@pytest.mark.parametrize(
    ("solver", "form", "stages"),
    [("newton", "sparse", "K"), ("piqp", "primal", "K"), ("gi", "primal", "K factors Q")],
)
def test_what_an_answer_needed_from_the_scene_on(folder: Path, solver: str, form: str, stages: str) -> None:
    """In the sparse form the process makes the model; in a dense one it opens the stages it needs."""
    scene = dict.fromkeys(("scene", "source"), "gallery/heavy-sheet-on-tool")
    row = outcome(folder, **scene, solver=solver, form=form, plugin=False)
    assert row["status"] == "solved"
    assert row["stages"] == stages
    if form == "sparse":
        assert 0 < row["model_s"] < row["load_s"]
    else:
        assert "model_s" not in row


@pytest.mark.parametrize(
    ("fault", "status", "message"),
    [
        ("signal", "crashed", "killed by SIGSEGV"),
        ("leave", "crashed", "exit code 7"),
        pytest.param("close_everything", "crashed", "before its answer", marks=starts),
        ("system_exit", "failed", "SystemExit: enough"),
        ("raises", "failed", "ValueError: no step"),
        ("recurse", "failed", "RecursionError"),
        ("nan", "failed", "lam has NaN or infinity"),
        pytest.param("eat", "memory_limit", f"more than {MIB} MiB", marks=starts),
        pytest.param("children_eat", "memory_limit", f"more than {MIB} MiB", marks=starts),
        ("out_of_memory", "memory_limit", "as numpy does"),
        ("hang", "time_limit", "solve took more than 0.3 s"),
        ("stop_itself", "time_limit", "solve took more than 0.3 s"),
        pytest.param("fork_on_and_on", "time_limit", "solve took more than 0.3 s", marks=starts),
        ("write_everywhere", "iteration_limit", ""),
        ("gives_up", "iteration_limit", ""),
    ],
)
def test_a_fault_is_a_status_with_a_reason(folder: Path, fault: str, status: str, message: str) -> None:
    memory_limit_mib = MIB if status == "memory_limit" and "than" in message else 8192
    time_limit_s = 0.3 if status == "time_limit" else 20.0
    row = outcome(folder, fault, memory_limit_mib=memory_limit_mib, time_limit_s=time_limit_s)
    assert row["status"] == status
    assert message in (row.get("message") or "")
    assert row.get("answer") is None
    assert row["prepare_s"] > 0  # what was known before is kept
    assert row.get("iterations") == (5 if fault == "gives_up" else None)


@starts
def test_the_start_does_not_count_against_the_time_limit(folder: Path) -> None:
    slow = folder / "slow.py"
    slow.write_text("import time\ntime.sleep(1)\n" + tiny_joint.EXACT)
    row = outcome(folder, solver="slow", time_limit_s=0.5)
    assert row["status"] == "solved"


def test_what_a_solver_printed_survives_its_end(folder: Path) -> None:
    """Lines of Python and of C, which are not in their buffers when the process is killed."""
    row = outcome(folder, "says")
    assert (row["status"], row["printed"]) == ("crashed", "one\ntwo\n")


def test_a_file_of_the_project_is_told_by_its_path_within_it(folder: Path) -> None:
    """Logs and rows of two machines are the same, wherever it is installed."""
    row = outcome(folder, "names_a_file")
    assert row["stderr"] == "solvers/base.py"
    assert row["printed"] == "solvers/base.py\n"


def test_floods_of_output_are_dropped_but_for_a_tail(folder: Path) -> None:
    row = outcome(folder, "chatter")
    assert row["status"] == "solved"
    assert set(row["stderr"]) == {"e"}
    assert len(row["stderr"]) <= 2000
    start, left_out, end = re.split(r"\n\[(\d+) bytes left out\]\n", row["printed"])
    assert (len(start), len(end)) == (2**16, 2**16)
    assert len(start + end) + int(left_out) == 300 * (2**20 + 2**16)
    assert outcome(folder, "big_details")["details"].keys() == {"dropped"}


@starts
@pytest.mark.parametrize("fault", ["fork_and_go_on", "orphan"])
def test_a_child_that_runs_on_does_not_answer_twice(folder: Path, fault: str) -> None:
    assert outcome(folder, fault)["status"] == "solved"


def test_an_orphan_that_is_in_no_list_yet_is_killed_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A child that forks and dies before it is killed: what it forked is in the next list."""
    lists, killed = iter([[11], [11, 12], [11, 12]]), []
    monkeypatch.setattr(child_process, "_children", lambda pid: next(lists))
    monkeypatch.setattr(child_process, "_is_alive", lambda pid: False)
    monkeypatch.setattr(os, "kill", lambda pid, sent: killed.append(pid))
    child_process.end_children(1)
    assert killed == [11, 12]


def task_of(m: Measurement, form: Form = "dual", version: str = "1") -> Task:
    return Task([m], Description([form], version, "code"), read_scene(m.source).key)


def test_a_scene_that_changes_before_its_process_reads_it_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Right answers would be judged as wrong ones; that of a worker may be another from the beginning."""

    def changing(*of: Any) -> list[FinishedReport]:
        tiny_joint.write_problem(tmp_path / "tiny.npz", shift=1.0)
        return [{"status": "solved"}]

    tiny_joint.write_problem(tmp_path / "tiny.npz")
    task = task_of(measurement(tmp_path))
    monkeypatch.setattr("harness.measurement.task.measure", changing)
    with pytest.raises(InputError, match="it has changed since, or is another on this worker"):
        run_task(task, tmp_path)


def test_a_scene_without_files_is_not_made_again_to_be_compared(folder: Path) -> None:
    """The key of a rung takes all its matrices."""
    rung = replace(measurement(folder), source="hard/pivoting/fathi-008")
    task = replace(task_of(rung, "primal"), scene_key="not compared")
    assert run_task(task, folder).reports[0]["status"] == "unsupported"


def test_another_plug_in_than_the_one_described_is_refused(folder: Path) -> None:
    """It was edited meanwhile, or is older on a worker: its row would have the version of the other."""
    task = task_of(measurement(folder, "exact", plugin=True), version="sha256:of another")
    with pytest.raises(InputError, match=r"exact\.py: version = 'sha256:\w+': sha256:of another, as at"):
        run_task(task, folder)


def test_another_version_of_a_solver_than_the_one_described_is_refused(folder: Path) -> None:
    """A worker has another one installed: its row would have the version of the driver's."""
    task = task_of(measurement(folder), version="0.0.1")
    with pytest.raises(InputError, match=r"solver gi: version = '.+': 0\.0\.1, as at the beginning"):
        run_task(task, folder)


def test_a_full_disk_is_not_the_solvers_fault(folder: Path) -> None:
    failed = outcome(folder, to="missing/answer.npz")
    assert str(folder / "missing" / "answer.npz") in failed["cannot_save"]
