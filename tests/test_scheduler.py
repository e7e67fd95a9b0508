"""Work on other processes: through a plain executor, and through Dask where it is installed."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import time
from concurrent.futures import ProcessPoolExecutor
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny
from rich.console import Console
from strip import write_strip

from harness.scheduler import AHEAD, done_as_completed, other_versions, versions, workers
from harness.series import store
from harness.series.desk import Job, solve_on_worker
from harness.series.run import on_workers, run
from problems.errors import InputError
from problems.prepare import prepared
from problems.random_gaps import random_gaps
from problems.scene import read_scene

CASES = 60


@pytest.fixture
def job(tmp_path: Path) -> Job:
    scene = read_scene(str(write_strip(tmp_path)))
    return Job(scene, random_gaps(scene, prepared(scene), CASES, 0), "newton", "dual", 1e-11, 1e-7, 0, 1)


def quiet() -> Console:
    return Console(file=StringIO(), width=200)


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
        for done, (k, outcome) in enumerate(done_as_completed(executor, 2, double, tasks()), start=1):
            assert drawn <= done + 2 * AHEAD + 2
            assert k not in seen
            seen[k] = outcome
    assert isinstance(seen.pop(13), ValueError)
    assert seen == {k: 2 * k for k in range(40) if k != 13}


def test_a_series_on_other_processes_is_the_series_on_this_one(job: Job) -> None:
    alone = {result.row["case"]: result for result in solve_on_worker(job, range(CASES))}
    with ProcessPoolExecutor(2) as executor:
        results = [r for some in on_workers(job, list(range(CASES)), executor, 2, quiet()) for r in some]
    assert sorted(result.row["case"] for result in results) == list(range(CASES))
    for result in results:
        np.testing.assert_allclose(result.gap, alone[result.row["case"]].gap, atol=1e-9)
        assert result.row["verdict"] == "within"


def test_versions_that_differ_are_named() -> None:
    here = versions()
    assert other_versions("tcp://a", here, here) == []
    (fault,) = other_versions("tcp://a", here, here | {"numpy": "1.0"})
    assert "worker tcp://a: numpy = '1.0'" in str(fault)
    assert here["numpy"] in str(fault)


@pytest.mark.skipif(importlib.util.find_spec("distributed") is not None, reason="Dask is installed")
def test_without_dask_it_says_what_to_install() -> None:
    with pytest.raises(InputError, match=r"pip install 'rivetbench\[distributed\]'"), workers("local:2"):
        pass


def test_a_scheduler_that_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    for wrong in ("local:0", "local:x"):
        with pytest.raises(InputError, match="local:N"), workers(wrong):
            pass
    monkeypatch.setattr("harness.scheduler.ANSWERS_WITHIN", "1s")
    with pytest.raises(InputError, match="does not answer"), workers("tcp://127.0.0.1:9"):
        pass


def test_a_worker_that_is_killed_costs_no_row(job: Job, tmp_path: Path) -> None:
    """A real LocalCluster, one of whose two workers dies in the middle."""
    distributed = pytest.importorskip("distributed")
    slow = tmp_path / "slow.py"
    slow.write_text(tiny.EXACT.replace("L = sla", "__import__('time').sleep(0.05); L = sla"))
    job = Job(job.scene, job.cases, "slow", "dual", 1e-11, 1e-7, 0, 1, {}, slow)
    out = tmp_path / "out"
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            victim = next(iter(client.run(os.getpid).values()))

        def kill() -> None:
            while not (out / store.CASES).exists():
                time.sleep(0.05)
            os.kill(victim, signal.SIGKILL)

        from threading import Thread

        thread = Thread(target=kill)
        thread.start()
        assert run(job, {}, out, quiet(), cluster.scheduler_address) == 0
        thread.join()
    rows = [json.loads(line) for line in (out / store.CASES).read_text().splitlines()]
    assert sorted(row["case"] for row in rows) == list(range(CASES))
