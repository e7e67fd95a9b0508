"""Does tasks on Dask workers: `local:N`, or those of a scheduler. Dask is imported only if they are used.

Each worker takes one task at a time, so that a measurement has its worker to itself. The tasks of a lost
worker are done by others; a task that keeps killing workers fails alone. Only the driver writes results.
"""

import logging
import platform
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import ExitStack, contextmanager, suppress
from queue import SimpleQueue
from typing import Any, TypeVar

from rich.console import Console

from harness.measurement.monitored_call import TRIM
from harness.results.provenance import PACKAGES, installed_version, usable_cores
from problems.errors import Fault, InputError
from problems.storage import ROOT, fingerprint
from report.document.numbers import counted

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")

CONNECT_TIMEOUT = "20s"
RETRIES = 2  # of a task that raises
CODE = ("problems", "solvers", "harness")
TASKS_PER_WORKER = 2  # one running, one waiting
ENVIRONMENT = "distributed.nanny.pre-spawn-environ"  # of a local worker


@contextmanager
def workers(scheduler: str, console: Console) -> Iterator[tuple[Executor, int]]:
    """An executor on the workers, and their number.

    Raises InputError if Dask is not installed, the scheduler does not answer or has no worker, or a worker
    has more than one thread or other versions than this process.
    """
    try:
        from dask import config
        from distributed import Client, LocalCluster
    except ImportError as error:
        allowed = "needs Dask: pip install 'rivetbench[distributed]'"
        raise InputError.one("--scheduler", "scheduler", scheduler, f"{allowed} ({error})") from error
    if client := _open_client(scheduler):
        yield _connected(client, scheduler, console)
        return
    with ExitStack() as stack:
        stack.callback(logging.disable, logging.root.manager.disable)
        if count := local_workers(scheduler):
            environment = {name: value for name, value in config.get(ENVIRONMENT).items() if name != TRIM}
            with config.set({ENVIRONMENT: environment}), _uninterrupted():
                cluster = LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    memory_limit=None,
                    dashboard_address=":0",
                    silence_logs=logging.ERROR,
                )
            client = stack.enter_context(Client(stack.enter_context(cluster)))
        else:
            try:
                client = stack.enter_context(Client(scheduler, timeout=CONNECT_TIMEOUT))
            except (OSError, TimeoutError, ValueError) as error:
                allowed = f"does not answer: {error}"
                raise InputError.one("--scheduler", "scheduler", scheduler, allowed) from error
        stack.enter_context(_silent_if_interrupted(client, own_workers=count is not None))
        yield _connected(client, scheduler, console)


def _open_client(scheduler: str) -> Any:
    """The client of this process if it is that of this scheduler (`shared`), else None."""
    from distributed import default_client

    with suppress(ValueError):  # there is none
        client = default_client()
        return client if client.scheduler.address == scheduler else None


@contextmanager
def shared(scheduler: str | None, console: Console) -> Iterator[str | None]:
    """The address of workers that several series use; those of `local:N` begin and end here."""
    if not local_workers(scheduler):
        yield scheduler
        return
    with workers(str(scheduler), console):
        from distributed import default_client

        yield default_client().scheduler.address


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Processes that begin within ignore Ctrl-C: this process ends them."""
    if threading.current_thread() is not threading.main_thread():  # only that one can
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


@contextmanager
def _silent_if_interrupted(client: Any, own_workers: bool) -> Iterator[None]:
    """Silence Dask after an interrupt: it would log each task that was cut off, also after its end."""
    try:
        yield
    except KeyboardInterrupt:
        logging.disable()
        logging.getLogger("tornado.application").addFilter(_is_of_an_open_connection)
        if own_workers:
            with suppress(OSError):  # they have ended
                client.run(logging.disable, on_error="ignore")
        raise


def _is_of_an_open_connection(record: logging.LogRecord) -> bool:
    from distributed.comm.core import CommClosedError

    return not (record.exc_info and isinstance(record.exc_info[1], CommClosedError))


def local_workers(scheduler: str | None) -> int | None:
    """N of `local:N`, else None. Raises InputError if N is no positive number."""
    kind, _, count = (scheduler or "").partition(":")
    if kind != "local":
        return None
    if not (count.isdecimal() and int(count) > 0):
        raise InputError.one("--scheduler", "scheduler", scheduler, "local:N with N ≥ 1, or an address")
    return int(count)


def threads_per_worker(scheduler: str | None) -> int | None:
    """The threads for linear algebra of each of N local workers: cores / N, at least one."""
    count = local_workers(scheduler)
    return None if count is None else max(usable_cores() // count, 1)


def _connected(client: Any, scheduler: str, console: Console) -> tuple[Executor, int]:
    threads = client.nthreads()
    faults = [
        Fault(f"worker {address}", "nthreads", n, "start it with --nthreads 1: a measurement needs it alone")
        for address, n in threads.items()
        if n != 1
    ]
    if not threads:
        faults.append(Fault("--scheduler", "scheduler", scheduler, "has no worker; start one: dask worker"))
    faults += _other_versions(client)
    if faults:
        raise InputError(faults)
    console.print(f"{counted(len(threads), 'worker')} at {scheduler}")
    return client.get_executor(pure=False, retries=RETRIES), len(threads)


def _other_versions(client: Any) -> list[Fault]:
    """A fault for each package that a worker has in another version. Raises InputError if one lacks these."""
    here = versions()
    try:
        of_workers = client.run(versions)
    except Exception as error:  # an import failed there
        allowed = "install rivetbench for the scheduler and its workers, or start them with PYTHONPATH"
        raise InputError.one("--scheduler", "import", str(error), allowed) from error
    return [
        Fault(f"worker {address}", name, there.get(name), f"the driver has {version}: install the same")
        for address, there in of_workers.items()
        for name, version in here.items()
        if there.get(name) != version
    ]


def versions() -> dict[str, str]:
    """The versions of Python and of what an answer can depend on, and the fingerprint of this code."""
    code = fingerprint(file for folder in CODE for file in (ROOT / folder).rglob("*.py"))
    packages = {name: installed_version(name) for name in PACKAGES}
    return {"python": platform.python_version(), **packages, "code": code}


def refuse_lost_workers(ended: BaseException) -> None:
    """Raise InputError if a task ended so because workers did: killed, as for their memory, or cut off."""
    distributed = sys.modules.get("distributed")  # there if its workers are used
    if isinstance(ended, CancelledError) or (distributed and isinstance(ended, distributed.KilledWorker)):
        allowed = "workers that keep running: they were killed, as for memory, or the scheduler ended. "
        allowed += "Take fewer, and run the same command again: what was answered is kept"
        raise InputError.one("--scheduler", "workers", type(ended).__name__, allowed) from ended


def done_as_completed(
    executor: Executor, count: int, work: Callable[[S], R], tasks: Iterable[tuple[T, S] | None]
) -> Iterator[tuple[T, R | BaseException]]:
    """Each task with its result, or with its exception, as they end; only a few are submitted at a time.

    tasks : pairs of an object that stays here, to identify the task, and the argument of `work`; None where
    the next one depends on one that is being done.
    """
    remaining = iter(tasks)
    running: dict[Future[R], T] = {}
    ended: SimpleQueue[Future[R]] = SimpleQueue()  # Ctrl-C within `wait` would leave futures locked
    while True:
        for pair in remaining:
            if pair is None:
                break
            task, sent = pair
            future = executor.submit(work, sent)
            running[future] = task
            future.add_done_callback(ended.put)
            if len(running) >= TASKS_PER_WORKER * count:
                break
        if not running:
            return
        future = ended.get()
        task = running.pop(future)
        raised = CancelledError() if future.cancelled() else future.exception()
        outcome = future.result() if raised is None else raised
        del future  # a future that is kept is computed again if its worker is lost
        yield task, outcome
