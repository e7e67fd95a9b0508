"""The process that measures: one solver on one load case, or on those of a series; nothing else in it.

`python -m harness.worker`, with a job as the first line of stdin; events go back as JSON lines on the
file descriptor that the job names. Every event is a piece of the row: the driver merges them, so that
what is known of a killed worker is kept. An event with `phase` (start, solve, save) starts the clock of
another limit, the one with `status` ends the measurement, or the case of a series that is due; after the
last one the worker waits to be ended.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np
import threadpoolctl

from problems.assembly import LoadCase, Prepared, Vector
from problems.prepare import load_case, prepared
from problems.scene import Scene, read_scene
from solvers.base import Answer, Load, Problem, Solver, Status
from solvers.registry import make_solver

from .machine import resident_mib
from .records import to_line
from .warm_starts import WarmStarts
from .yardstick import yardstick

LARGEST_EVENT = 2**16  # bytes; a solver's details beyond it are dropped
PAGE = 4096

Row = dict[str, Any]
T = TypeVar("T")


class Refused(Exception):
    """The answer cannot be taken; the text says why."""


def main() -> None:
    job = json.loads(sys.stdin.readline())
    end_with_the_driver()
    faulthandler.enable()
    run = Run(job)
    try:
        end = run.measured()
    except MemoryError as error:
        end = {"status": "memory_limit", "message": f"the solver ran out of memory: {error}"}
    except Refused as error:
        end = {"status": "failed", "message": str(error)}
    except BaseException as error:
        end = {"status": "failed", "message": f"{type(error).__name__}: {error}"[:2000]}
    run.tell(**{"answer": None, **end})
    sys.stdin.read()
    os._exit(0)


def end_with_the_driver() -> None:
    """Linux: die when the driver dies, and keep hold of grandchildren whose parent is gone."""
    if sys.platform == "linux":
        set_death_signal, set_child_subreaper = 1, 36
        prctl = ctypes.CDLL(None).prctl
        prctl(set_death_signal, signal.SIGKILL)
        prctl(set_child_subreaper, 1)


class Run:
    """One measurement in the making."""

    def __init__(self, job: Row) -> None:
        self.job = job
        self.process = os.getpid()

    def tell(self, **event: Any) -> None:
        if os.getpid() != self.process:  # a child that the solver forked and let run on
            os._exit(0)
        line = to_line(event)
        if len(line) > LARGEST_EVENT:
            line = to_line(event | {"details": {"dropped": f"{len(line)} bytes"}})
        os.write(self.job["events"], line.encode() + b"\n")

    @contextmanager
    def lap(self, name: str, before: float = 0.0) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.tell(**{name: before + time.perf_counter() - start})

    def timed(self, name: str, call: Callable[[], T]) -> T:
        with self.lap(name):
            return call()

    def measured(self) -> Row:
        """Solve the job's load cases. How the last one ended is returned; of the others it is told here."""
        job = self.job
        solver = make_solver(job["solver"], job["options"], Path(job["plugin"]) if job["plugin"] else None)
        if job["form"] not in solver.forms:
            return {"status": "unsupported", "message": f"takes {' and '.join(solver.forms)} only"}
        with self.lap("load_s"):
            scene = read_scene(job["source"])
            data = prepared(scene)
            cases = list(load_cases(scene, data, job))
            touch(data, job["form"])
        series = Series(solver, Problem(data, job["form"]), job["tolerance"])
        *others, last = zip(cases, job["answers"], strict=True)
        for case, answer in others:
            self.tell(**self.solved(series, case, Path(answer)))
        return self.solved(series, last[0], Path(last[1]))

    def solved(self, series: Series, case: LoadCase, answer_file: Path) -> Row:
        """Solve one load case and save its answer; how that ended."""
        data, form, tolerance = series.problem.prepared, series.problem.form, series.tolerance
        start = time.perf_counter()
        load = Load(case.f, case.g, data.dual_load(case))
        form_s = time.perf_counter() - start
        for array in (load.f, load.g, load.p):
            array.flags.writeable = False
        near = series.starts.nearest(load)

        self.tell(phase="solve", **({} if series.begun else {"data_mib": resident_mib("VmRSS")}))
        solver = series.solver
        if not series.begun:
            converted = self.timed("convert_s", lambda: solver.convert(series.problem))
            series.state = self.timed("prepare_s", lambda: solver.prepare(converted))
            series.begun = True
        set_up = partial(solver.setup, series.state, load, tolerance)
        if near is not None:
            set_up = partial(solver.update, series.state, series.ready, load, tolerance, near[1])
        series.ready = self.timed("setup_s", set_up)
        answer = self.timed("solve_s", lambda: solver.solve(series.ready, load, tolerance))
        said = checked(answer, data, form)
        x, lam = answer.x, answer.lam
        if form == "dual" and lam is not None:
            with self.lap("form_s", form_s):
                x = data.recover(np.asarray(lam, dtype=float), case)
        self.tell(phase="save", **said, **threads_in_effect(), peak_rss_mib=resident_mib("VmHWM"))
        if self.job["yardstick"]:
            self.tell(**yardstick(data.Q))
        series.starts.keep(load, answer)
        if x is None:
            return {"status": answer.status, "answer": None}
        try:
            save(answer_file, x, lam, data.assembly.m)
        except OSError as error:
            return {"status": "failed", "cannot_save": f"{answer_file}: {error}"}
        return {"status": answer.status, "answer": f"answers/{answer_file.name}"}


class Series:
    """A solver on load case after load case: what it keeps between them, and the answers to start from."""

    def __init__(self, solver: Solver, problem: Problem, tolerance: float) -> None:
        self.solver, self.problem, self.tolerance = solver, problem, tolerance
        self.state: Any = None
        self.ready: Any = None
        self.starts = WarmStarts(problem)
        self.begun = False


def load_cases(scene: Scene, data: Prepared, job: Row) -> Iterator[LoadCase]:
    """The scene's own load case, or those of a series."""
    if job["series"] is None:
        yield load_case(scene, data)
        return
    from problems.random_gaps import random_gaps

    cases = random_gaps(scene, data, **job["series"])
    for case in job["cases"]:
        yield cases.load(case, data)


def touch(data: Prepared, form: str) -> None:
    """Read a byte of every page that this form needs, so that no solver pays for a cold file cache."""
    arrays = [*data.assembly.blocks, *data.factors, *([data.Q] if form == "dual" else [])]
    for array in arrays:
        array.ravel(order="K")[:: PAGE // array.itemsize].sum()


def checked(answer: Answer, data: Prepared, form: str) -> Row:
    """The solver's own figures; Refused where what it returned is no answer."""
    if not isinstance(answer, Answer):
        raise Refused(f"solve returned {type(answer).__name__}, not solvers.base.Answer")
    if answer.status not in get_args(Status):
        raise Refused(f"status {answer.status!r}; allowed: {', '.join(get_args(Status))}")
    if answer.status == "solved" and (answer.lam if form == "dual" else answer.x) is None:
        raise Refused(f"says solved, and gives no {'lam' if form == 'dual' else 'x'}")
    for name, value, size in (("lam", answer.lam, data.assembly.m), ("x", answer.x, data.assembly.n)):
        if value is None:
            continue
        if np.shape(value) != (size,):
            raise Refused(f"{name} has shape {np.shape(value)}; wanted ({size},)")
        if not np.isfinite(np.asarray(value, dtype=float)).all():
            raise Refused(f"{name} has NaN or infinity")
    return {
        "iterations": answer.iterations,
        "inner_iterations": answer.inner_iterations,
        "solver_reported_s": answer.reported_s,
        "details": answer.details,
    }


def save(path: Path, x: Vector, lam: Vector | None, m: int) -> None:
    """x (n,) in mm and lam (m,) in N, NaN where the solver gives none; the file appears whole."""
    new = path.with_name(path.name + ".new")
    with new.open("wb") as file:
        np.savez(file, x=x, lam=np.full(m, np.nan) if lam is None else lam)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)


def threads_in_effect() -> Row:
    """BLAS kernels and thread count of the libraries that are loaded by now."""
    pools = threadpoolctl.threadpool_info()
    blas = [pool for pool in pools if pool["user_api"] == "blas"]
    names = ("internal_api", "version", "architecture")
    kernels = {" ".join(str(pool[name]) for name in names if pool.get(name)) for pool in blas}
    return {
        "kernels": ", ".join(sorted(kernels)) or None,
        "threads": max((pool["num_threads"] for pool in blas or pools), default=None),
    }


if __name__ == "__main__":
    main()
