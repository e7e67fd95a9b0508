"""What all tests share: a cache of their own, so that none reads or fills the user's; pictures of few pixels,
drawn in a quarter of the time; what is the same each time, made once: the command line, and what git and the
installed packages say, which each session, answer and report asks; garbage that is looked for less often;
quick tests first."""

import gc
import os
import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

DISTRIBUTED = "PYTEST_XDIST_WORKER" in os.environ
SHARED = ("chromium", "cluster")  # fixtures that take long to make
ON_WORKERS = ("harness.measurement.task", "harness.placement.session", "harness.series.executors")

gc.set_threshold(20_000, 20, 100)  # by default a tenth of the time, with all that the tests import

if DISTRIBUTED:  # a thread for each process; read when numpy is loaded, which these imports do
    os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")

from forked_processes import fork_measuring_processes  # noqa: E402

from harness.results import provenance  # noqa: E402

ASK_GIT, PROJECT = provenance._git, provenance.ROOT
ask_git_once = cache(ASK_GIT)


def _git(*arguments: str) -> str | None:
    """It is asked again only of the trees that tests make."""
    return (ask_git_once if provenance.ROOT == PROJECT else ASK_GIT)(*arguments)


@pytest.fixture(autouse=True, scope="session")
def _shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """One for all processes of pytest-xdist, so that an assembly is built once."""
    gc.freeze()  # what has been imported is no garbage
    folder = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIVETBENCH_CACHE", str((folder.parent if DISTRIBUTED else folder) / "cache"))
        patch.setattr("report.figures.style.DPI", 40)
        patch.setattr(provenance, "_git", _git)
        patch.setattr(provenance, "version", cache(provenance.version))
        patch.setattr(provenance, "_blas", cache(provenance._blas))
        patch.setattr("typer.testing._get_command", cache(get_command))
        yield


@pytest.fixture(autouse=True)
def _forked(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork measuring processes, unless the start of one is the point of a test."""
    if not request.node.get_closest_marker("starts"):
        fork_measuring_processes(monkeypatch)


@pytest.fixture
def blank_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures take longer than all the rest."""
    from matplotlib.image import imsave

    def blank(_: object, file: Path, **__: Any) -> None:
        imsave(file, [[(1.0, 1.0, 1.0)] * 40] * 30, format="png")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", blank)


@pytest.fixture
def without_pictures(blank_pictures: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Answers have none, all else a blank one."""
    monkeypatch.setattr("report.writers.answer_report.answer_figures", lambda *_: {})


@pytest.fixture
def without_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """A series writes its rows and gaps alone, a run its rows and answers, a search its plans."""
    for kind in ("series", "suite", "place", "shim"):
        monkeypatch.setattr(f"report.writers.{kind}_report.write", lambda directory: directory)


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the tiny joint, two rows of the plug-in `exact`, which nobody may change."""
    import tiny_joint
    from suite_runs import said_by

    from harness.measurement.suite_run import run

    folder = tmp_path_factory.mktemp("finished")
    suite = tiny_joint.suite(folder, tolerances=[1e-6, 1e-8])
    assert said_by(run, suite, folder / "finished")[0] == 0
    return folder / "finished"


@pytest.fixture(scope="session")
def cluster() -> Iterator[Any]:
    """Two workers of Dask; a task that kills two is left. Dask sets nothing in the environment here.

    They and those that follow them are forked from a process that has imported what they need.
    """
    dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")
    at_start = {"distributed.scheduler.allowed-failures": 1, "distributed.nanny.pre-spawn-environ": {}}
    with dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        distributed.utils.get_mp_context().set_forkserver_preload(["distributed", *ON_WORKERS])
        with dask.config.set(at_start):
            made = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0")
        with made:
            yield made


@pytest.fixture
def copy(finished: Path, tmp_path: Path) -> Path:
    """One that a test may change."""
    return Path(shutil.copytree(finished, tmp_path / "copy"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Quick tests first, then those with the browser and those with the cluster: one process starts it, as
    another one of pytest-xdist takes its work from the end.
    """

    def place(item: pytest.Item) -> list[bool]:
        fixtures = getattr(item, "fixturenames", ())
        return [item.get_closest_marker("slow") is not None, *(f not in fixtures for f in SHARED)]

    items.sort(key=place)
