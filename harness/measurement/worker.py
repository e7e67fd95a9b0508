"""The process that measures: one solver on one load case, or on those of a series; nothing else in it.

`python -m harness.measurement.worker`, with a job as the first line of stdin; events go back as JSON lines
on the file descriptor that the job names. Every event is a piece of the row: the driver merges them, so that
what is known of a killed worker is kept. An event with `phase` (start, solve, save) starts the clock of
another limit, the one with `status` ends the measurement, or the case of a series that is due, and with
`ended` those after it too; then the worker waits to be ended.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import threadpoolctl

from harness.results.records import Row, to_line
from problems.forms.assembly import LoadCase, Prepared, Vector
from problems.prepare import load_case, prepared
from problems.scene import Scene, read_scene
from solvers.base import Answer, Problem, Solver, Together
from solvers.registry import make_solver

from .answers import Refused, checked, figures, save
from .loads import loads_of, recovered
from .machine import resident_mib
from .warm_starts import WarmStarts
from .yardstick import yardstick

LARGEST_EVENT = 2**16  # bytes; a solver's details beyond it are dropped
PAGE = 4096

T = TypeVar("T")


class Unsupported(Exception):
    """The solver does not take the job; the text says what it takes."""


def main() -> None:
    job = json.loads(sys.stdin.readline())
    end_with_the_driver()
    faulthandler.enable()
    run = Run(job)
    try:
        for end in run.ends():
            run.tell(**end)
        end = {}
    except MemoryError as error:
        end = {"status": "memory_limit", "message": f"the solver ran out of memory: {error}"}
    except Refused as error:
        end = {"status": "failed", "message": str(error)}
    except Unsupported as error:
        end = {"status": "unsupported", "message": str(error)}
    except BaseException as error:
        end = {"status": "failed", "message": f"{type(error).__name__}: {error}"[:2000]}
    if end:
        run.tell(**end, answer=None, ended=True)
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

    def ends(self) -> Iterator[Row]:
        """Solve the job's load cases; how each ended."""
        job = self.job
        solver = make_solver(job["solver"], job["options"], Path(job["plugin"]) if job["plugin"] else None)
        if job["form"] not in solver.forms:
            raise Unsupported(f"takes {' and '.join(solver.forms)} only")
        with self.lap("load_s"):
            scene = read_scene(job["source"])
            data = prepared(scene)
            cases = list(load_cases(scene, data, job))
            touch(data, job["form"])
        series = Series(solver, Problem(data, job["form"]), job["tolerance"])
        files, at_once = list(map(Path, job["answers"])), job["together"]
        if at_once is None:
            for case, file in zip(cases, files, strict=True):
                yield self.solved(series, case, file)
            return
        for start in range(0, len(cases), at_once):
            some = slice(start, start + at_once)
            yield from self.solved_together(series, cases[some], files[some])

    def solved(self, series: Series, case: LoadCase, answer_file: Path) -> Row:
        """Solve one load case and save its answer; how that ended."""
        data, form, tolerance = series.problem.prepared, series.problem.form, series.tolerance
        start = time.perf_counter()
        (load,) = loads_of([case], data)
        form_s = time.perf_counter() - start
        near = series.starts.nearest(load)

        self.begin(series)
        solver = series.solver
        set_up = partial(solver.setup, series.state, load, tolerance)
        if near is not None:
            set_up = partial(solver.update, series.state, series.ready, load, tolerance, near[1])
        series.ready = self.timed("setup_s", set_up)
        answer = self.timed("solve_s", lambda: solver.solve(series.ready, load, tolerance))
        said = figures(checked(answer, data, form))
        x = answer.x
        if form == "dual" and answer.lam is not None:
            with self.lap("form_s", form_s):
                x = data.recover(np.asarray(answer.lam, dtype=float), case)
        end = self.saved(answer, x, answer_file, data, said | {"warm": near is not None})
        series.starts.keep(load, answer)
        return end

    def solved_together(
        self, series: Series, cases: Sequence[LoadCase], answer_files: Sequence[Path]
    ) -> Iterator[Row]:
        """The same for load cases solved at once; each has an equal share of the seconds."""
        data, form, tolerance = series.problem.prepared, series.problem.form, series.tolerance
        start = time.perf_counter()
        loads = loads_of(cases, data)
        form_s = time.perf_counter() - start

        warm = series.begun
        self.begin(series)
        if series.together is None:
            raise Unsupported("takes one load case at a time")
        start = time.perf_counter()
        answers = series.together(loads, tolerance)
        solve_s = time.perf_counter() - start
        if len(answers) != len(loads):
            raise Refused(f"{len(answers)} answers to {len(loads)} load cases")
        said = [figures(checked(answer, data, form)) for answer in answers]
        found = [answer.x for answer in answers]
        if form == "dual":
            start = time.perf_counter()
            found = recovered([answer.lam for answer in answers], cases, data)
            form_s += time.perf_counter() - start
        k = len(cases)
        shares: Row = {"together": k, "warm": warm, "solve_s": solve_s / k, "form_s": form_s / k}
        for answer, x, file, facts in zip(answers, found, answer_files, said, strict=True):
            yield self.saved(answer, x, file, data, facts | shares)

    def begin(self, series: Series) -> None:
        """The clock of the solver starts; before the first load case it converts and prepares."""
        if series.begun:
            self.tell(phase="solve")
            return
        self.tell(phase="solve", data_mib=resident_mib("VmRSS"))
        solver = series.solver
        converted = self.timed("convert_s", lambda: solver.convert(series.problem))
        with self.lap("prepare_s"):
            series.state = solver.prepare(converted)
            if self.job["together"] is not None:
                series.together = solver.together(series.state)
        series.begun = True

    def saved(self, answer: Answer, x: Vector | None, file: Path, data: Prepared, said: Row) -> Row:
        """Tell what the solver said, and save its answer; how the case ended."""
        self.tell(phase="save", **said, **threads_in_effect(), peak_rss_mib=resident_mib("VmHWM"))
        if self.job["yardstick"]:
            self.tell(**yardstick(data.Q))
        if x is None:
            return {"status": answer.status, "answer": None}
        try:
            save(file, x, answer.lam, data.assembly.m)
        except OSError as error:
            return {"status": "failed", "answer": None, "cannot_save": f"{file}: {error}"}
        return {"status": answer.status, "answer": f"answers/{file.name}"}


class Series:
    """A solver on load case after load case: what it keeps between them, and the answers to start from."""

    def __init__(self, solver: Solver, problem: Problem, tolerance: float) -> None:
        self.solver, self.problem, self.tolerance = solver, problem, tolerance
        self.state: Any = None
        self.ready: Any = None
        self.together: Together | None = None
        self.starts = WarmStarts(problem)
        self.begun = False


def load_cases(scene: Scene, data: Prepared, job: Row) -> Iterator[LoadCase]:
    """The scene's own load case, or those of a series."""
    if job["series"] is None:
        yield load_case(scene, data)
        return
    from problems.load_cases.random_gaps import random_gaps

    cases = random_gaps(scene, data, **job["series"])
    for case in job["cases"]:
        yield cases.load(case, data)


def touch(data: Prepared, form: str) -> None:
    """Read a byte of every page that this form needs, so that no solver pays for a cold file cache."""
    arrays = [*data.assembly.blocks, *data.factors, *([data.Q] if form == "dual" else [])]
    for array in arrays:
        array.ravel(order="K")[:: PAGE // array.itemsize].sum()


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
