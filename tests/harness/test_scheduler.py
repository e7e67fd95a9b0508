"""Work on other processes: through a plain executor, and through Dask where it is installed."""

import importlib.util
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import tiny_joint
from rich.console import Console
from strip_scene import write_strip
from suite_runs import is_alive, rows_of, said_by, series_rows, wait_for

from harness.measurement import scheduler
from harness.measurement.monitored_call import TRIM, environment
from harness.measurement.scheduler import TASKS_PER_WORKER, done_as_completed, versions, workers
from harness.measurement.suite_run import run as run_suite
from harness.results import series_file
from harness.results.comparison import Incomparable
from harness.series.executors import on_workers, solve_on_worker
from harness.series.run import run
from harness.series.session import Job
from problems.errors import Fault, InputError
from problems.load_cases.measured_gaps import measured_gaps
from problems.load_cases.random_gaps import random_gaps
from problems.scene_files import read_scene

pytestmark = pytest.mark.slow

CASES = 24
ROOT = Path(__file__).parents[2]
VERSIONS = versions()
QUIET = Console(quiet=True)
needs_dask = pytest.mark.skipif(not importlib.util.find_spec("distributed"), reason="needs Dask")


@pytest.fixture
def job(tmp_path: Path) -> Job:
    scene = read_scene(str(write_strip(tmp_path)))
    return Job(scene=scene, cases=random_gaps(scene, CASES, 0), form="dual", check=0, threads=1)


def pids(cluster: Any) -> list[int]:
    import distributed

    with distributed.Client(cluster) as client:
        client.wait_for_workers(2)
        return list(client.run(os.getpid).values())


@contextmanager
def once(happened: Callable[[], bool], then: Callable[[], None]) -> Iterator[None]:
    """While the body runs, `then` is called as soon as something has happened; it must happen."""

    def watch() -> None:
        while not happened():
            time.sleep(0.02)
        then()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    yield
    thread.join(timeout=10)
    assert not thread.is_alive()


def double(k: int) -> int:
    if k == 13:
        raise ValueError("unlucky")
    return 2 * k


def test_every_task_comes_back_once_and_few_are_handed_out() -> None:
    drawn = 0

    def tasks() -> Any:
        nonlocal drawn
        for k in range(40):
            drawn += 1
            yield k

    seen = {}
    with ProcessPoolExecutor(2) as executor:
        tagged = ((str(k), k) for k in tasks())
        for done, (name, outcome) in enumerate(done_as_completed(executor, 2, double, tagged), start=1):
            k = int(name)
            assert drawn <= done + 2 * TASKS_PER_WORKER + 2
            assert k not in seen
            seen[k] = outcome
    assert isinstance(seen.pop(13), ValueError)
    assert seen == {k: 2 * k for k in range(40) if k != 13}


@pytest.mark.parametrize("kind", [InputError, Incomparable])
def test_an_error_of_input_travels_from_a_worker(kind: type[InputError]) -> None:
    error = kind([Fault("a.toml", "key", [1.0], "2"), Fault("b.toml", "key", None, "3")])
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), again.faults, str(again)) == (kind, error.faults, str(error))


def test_a_worker_with_other_matrices_is_refused(tmp_path: Path) -> None:
    """Its copy of the file is older: its answers would be to another problem."""
    path = tiny_joint.write_problem(tmp_path / "own.npz")
    scene = read_scene(str(path))
    np.save(tmp_path / "gaps.npy", np.full((1, 10), 0.25))
    cases = measured_gaps(scene, tmp_path / "gaps.npy")
    job = Job(scene=scene, cases=cases, form="dual", check=0, scene_key=scene.key)
    assert len(solve_on_worker((job, [0]))) == 1
    with np.load(path) as saved:
        arrays = dict(saved)
    np.savez(path, **arrays | {"K": 2 * arrays["K"]})
    with pytest.raises(InputError, match="or are others on this worker"):
        solve_on_worker((replace(job, key="another"), [0]))


def test_wrong_input_ends_a_series_on_workers_as_in_one_process(job: Job) -> None:
    wrong = replace(job, scene_key="another")
    with ThreadPoolExecutor(1) as executor, pytest.raises(InputError, match="or are others on this worker"):
        list(on_workers(wrong, [0], executor, 1, QUIET))


def test_without_dask_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)  # as if it were not there
    with (
        pytest.raises(InputError, match=r"pip install 'rivetbench\[distributed\]'"),
        workers("local:2", QUIET),
    ):
        pass


@needs_dask
@pytest.mark.parametrize("wrong", ["local:0", "local:x", "local:-1"])
def test_a_number_of_workers_that_cannot_be(wrong: str) -> None:
    with pytest.raises(InputError, match="local:N"), workers(wrong, QUIET):
        pass


@pytest.mark.parametrize(
    ("where", "each"), [("local:2", 4), ("local:3", 2), ("local:9", 1), ("tcp://a:1", None), (None, None)]
)
def test_workers_share_cores(where: str | None, each: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "usable_cores", lambda: 8)
    assert scheduler.threads_per_worker(where) == each


@needs_dask
def test_local_workers_keep_the_memory_of_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor has a measurement on a worker that Dask began the setting by which it would give it back."""
    with workers("local:1", QUIET) as (executor, _):
        assert executor.submit(os.environ.get, TRIM).result() is None
        assert executor.submit(os.environ.get, "OMP_NUM_THREADS").result() == "1"
    monkeypatch.setenv(TRIM, "65536")
    assert TRIM not in environment(1)


@needs_dask
def test_a_silent_scheduler_keeps_cases(job: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.measurement.scheduler.CONNECT_TIMEOUT", "0.3s")
    out = tmp_path / "out"
    assert run(job, {}, out, QUIET) == 0
    rows = list(series_file.rows(out))
    more = replace(job, cases=replace(job.cases, count=CASES + 5))  # type: ignore[type-var]
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:9.*does not answer"):
        run(more, {}, out, QUIET, "tcp://127.0.0.1:9")
    assert list(series_file.rows(out)) == rows


@needs_dask
def test_wrong_workers_are_named(cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The driver thinks that it has other packages than its workers; it says which, of each worker."""
    monkeypatch.setattr(scheduler, "installed_version", lambda name: (VERSIONS | {"scipy": "0.1"})[name])
    with pytest.raises(InputError) as raised, workers(cluster.scheduler_address, QUIET):
        pass
    assert [fault.where.split()[0] for fault in raised.value.faults] == ["worker", "worker"]
    for fault in raised.value.faults:
        assert f"scipy = '{VERSIONS['scipy']}': the driver has 0.1" in str(fault)


@needs_dask
def test_a_worker_with_threads_and_a_scheduler_without_workers() -> None:
    import distributed

    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0"
    ) as cluster:
        with (
            pytest.raises(InputError, match="nthreads = 2: start it with --nthreads 1"),
            workers(cluster.scheduler_address, QUIET),
        ):
            pass
        cluster.scale(0)
        while cluster.scheduler.workers:
            time.sleep(0.05)
        with pytest.raises(InputError, match="has no worker"), workers(cluster.scheduler_address, QUIET):
            pass


@needs_dask
def test_ctrl_c_in_a_terminal_ends_workers_without_a_word_of_theirs(tmp_path: Path) -> None:
    """The signal goes to the whole group of processes, and every one of them ends."""
    out = tmp_path / "out"
    command = ["series", write_strip(tmp_path), "--cases", 10_000, "--scheduler", "local:1", "--out", out]
    going = subprocess.Popen(
        [sys.executable, "-m", "harness", *map(str, command)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # as in a terminal
    )
    wait_for(lambda: series_rows(out))
    begun = psutil.Process(going.pid).children(recursive=True)
    os.killpg(going.pid, signal.SIGINT)
    said, _ = going.communicate(timeout=30)
    assert going.returncode == 130
    assert "Interrupted" in said
    assert "Traceback" not in said
    assert "distributed" not in said
    wait_for(lambda: not any(map(is_alive, begun)))


@needs_dask
def test_a_worker_that_is_killed_costs_no_row(job: Job, tmp_path: Path, cluster: Any) -> None:
    """One of two workers dies in the middle: each case has one row, and gaps as if nothing had been.

    A process of a plug-in starts for each case, which takes longer than all else.
    """
    (tmp_path / "exact.py").write_text(tiny_joint.EXACT)
    job = replace(job, cases=random_gaps(job.scene, 4, 0), solver="exact", plugin=tmp_path / "exact.py")
    out = tmp_path / "out"
    victim = pids(cluster)[0]
    with once(lambda: bool(series_rows(out)), lambda: os.kill(victim, signal.SIGKILL)):
        assert run(job, {}, out, QUIET, cluster.scheduler_address) == 0
    assert victim not in pids(cluster)
    assert [row["case"] for row in series_file.rows(out)] == list(range(4))
    gaps = series_file.StoredGaps(out, 45)[range(4)]
    for result in solve_on_worker((job, range(4))):
        np.testing.assert_allclose(gaps[result.row["case"]], result.gap, atol=1e-7)


@needs_dask
def test_a_table_is_solved_on_workers_a_case_each_row(cluster: Any, tmp_path: Path) -> None:
    """Each block is sent with its own rows of the table; a resumed series has blocks with gaps in them."""
    scene = read_scene(str(write_strip(tmp_path)))
    np.save(tmp_path / "gaps.npy", np.random.default_rng(0).uniform(0, 0.5, (30, 45)))
    table = measured_gaps(scene, tmp_path / "gaps.npy")
    job = Job(scene=scene, cases=table, form="dual", check=0, threads=1)
    alone, out = tmp_path / "alone", tmp_path / "out"
    assert run(job, {}, alone, QUIET) == 0
    assert run(job, {}, out, QUIET) == 0
    with series_file.connected(out) as connection:
        connection.execute("DELETE FROM cases WHERE number % 3 != 1")
    assert run(job, {}, out, QUIET, cluster.scheduler_address) == 0
    gaps, wanted = (series_file.StoredGaps(each, 45)[range(30)] for each in (out, alone))
    again = [k for k in range(30) if k % 3 != 1]
    np.testing.assert_allclose(gaps[again], wanted[again], atol=1e-7)


@needs_dask
def test_a_measurement_that_kills_its_workers_is_left_and_said(cluster: Any, tmp_path: Path) -> None:
    """Worker after worker dies of it (here: of a plugin that kills its parent); the others are measured, and
    their answers are brought here.
    """
    entries = '[[solver]]\nname = "newton"\n[[solver]]\nname = "exact"\n'
    suite = tiny_joint.suite(tmp_path, entries)
    killer = tiny_joint.EXACT.replace("L = sla", "import os; os.kill(os.getppid(), 9); L = sla")
    (tmp_path / "exact.py").write_text(killer)
    code, said = said_by(
        lambda console: run_suite(suite, tmp_path / "out", console, cluster.scheduler_address)
    )
    assert code == 1
    (row,) = rows_of(tmp_path / "out")
    assert (row["solver"], row["status"], row["verdict"]) == ("newton", "solved", "within")
    assert (tmp_path / "out" / row["answer"]).is_file()
    machine = json.loads((tmp_path / "out" / "machine.json").read_text())
    assert machine["machine"] == row["machine"]
    assert re.search("tiny exact dual .*: not measured: KilledWorker", said)
    assert "1 measurement could not be made; the same command tries again." in said
