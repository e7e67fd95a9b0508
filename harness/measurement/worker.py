"""The measuring process: one solver on one load case, or on those of a series, and nothing else.

Each event is part of the row: the driver merges them, so that the reports of a killed process are kept. An
event with `phase` (start, solve, save) starts the clock of another limit; one with `status` ends the
measurement, or the current case of a series.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import cast

import numpy as np
import threadpoolctl
from scipy.linalg import lapack

from harness.planning.plan import Measurement
from harness.results.provenance import blas_kernels, cpu_model, resident_mib
from harness.results.records import Row, replace_arrays
from harness.results.schema import Report
from harness.solving.solver_answer import InvalidAnswer, figures
from harness.solving.solver_session import SolverSession, copied, given_arrays
from harness.solving.solver_version import version_of
from problems.build import load_case, prepared
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.problem import Problem, in_form
from problems.model.scene import Scene
from problems.reporter import Reporter
from problems.scene_files import read_scene
from solvers.base import Answer
from solvers.registry import make_solver

from .child_process import Events
from .environments import interpreter
from .monitored_call import Monitored

START_S = 300.0  # for the imports and opening the data
SAVE_S = 60.0  # for saving the answer
PAGE = 4096
OWN_LIMIT = 0.97  # of the time limit, for a library that stops by itself
YARDSTICK_REPEATS = 3
#: The fields that are reported once for all the load cases of a series.
SHARED = ("load_s", "model_s", "convert_s", "prepare_s", "data_mib", "device")


class FinishedReport(Report, total=False):
    """A report at its end.

    cannot_save : why the answer's file cannot be written, which ends the run. With the first measurement of a
    process: printed, what it printed; version, that of the solver in that process.
    """

    cannot_save: str
    printed: str
    version: str


class Unsupported(InvalidAnswer):
    """The solver does not take this way of solving; the text says which it takes."""

    status = "unsupported"


def measure(measurements: Sequence[Measurement], answers: Sequence[Path]) -> list[FinishedReport]:
    """Run measurements in one process: one, or load cases of a series. Each answer is saved.

    Returns the process's part of each row: status, message, times, peak memory. If a load case ends the
    process, the following ones have its status.
    """
    first, finished, fields = measurements[0], list[FinishedReport](), Row()
    phases = {"start": START_S, "solve": first.time_limit_s * (first.entry.batched or 1), "save": SAVE_S}
    job = measurements, answers
    python = interpreter(first.entry.requirements or ())
    memory_limit_mib = first.suite.memory_limit_mib
    with Monitored(measure_here, job, first.threads, phases, memory_limit_mib, python) as process:
        for event in process:
            fields |= event
            if "status" in event:
                finished.append(cast(FinishedReport, fields))
                fields = {name: fields[name] for name in SHARED if name in fields}
            if len(finished) == len(measurements):
                break
        last = finished[-1]
        last["peak_rss_mib"] = max(last.get("peak_rss_mib") or 0.0, process.peak_mib) or None
        last["stderr"] = process.stderr_text
        if last["status"] == "time_limit" and "iterations" not in last:
            last["message"] = f"{last['message']}; iterations and error are unknown"
        finished[0]["printed"] = process.log
    ended = measurements[len(finished) - 1].key
    lost: FinishedReport = {"status": last["status"], "message": f"not run: {ended} ended the process"}
    return finished + [lost] * (len(measurements) - len(finished))


def measure_here(job: tuple[Sequence[Measurement], Sequence[Path]], events: Events) -> None:
    """Run the measurements, in the child process."""
    for outcome in Run(*job, events).outcomes():
        events.report(**outcome)


class Run(Reporter):
    """The measurements of one process."""

    def __init__(self, measurements: Sequence[Measurement], answers: Sequence[Path], events: Events) -> None:
        self.measurements, self.answers, self.first = measurements, answers, measurements[0]
        self.events = events

    @contextmanager
    def step(self, name: str, more_s: float = 0.0) -> Iterator[None]:
        """Report the seconds of a step, and some more, under its name."""
        start = time.perf_counter()
        yield
        self.events.report(**{name: more_s + time.perf_counter() - start})

    def outcomes(self) -> Iterator[FinishedReport]:
        """Solve the load cases; yields the last event of each row."""
        m, files = self.first, self.answers
        plugin = Path(m.suite.plugin) if m.suite.plugin else None
        solver = make_solver(m.solver, m.entry.options, plugin)
        self.events.report(version=version_of(m.solver, solver, plugin))
        own = {"time_limit_s": OWN_LIMIT * m.time_limit_s, "iteration_limit": m.iteration_limit}
        vars(solver).update(own, prints=True)  # it may be frozen
        with self.step("load_s"):
            scene = scene_to_measure(self.measurements)
            problem = in_form(prepared(scene, form=m.form), m.form)
            start = time.perf_counter()
            cases = list(load_cases(scene, self.measurements))
            if problem.prepared.model_s is not None:
                self.events.report(model_s=problem.prepared.model_s + time.perf_counter() - start)
            for array in problem.arrays:  # each page, so that no solver's time includes a cold file cache
                array.ravel(order="K")[:: PAGE // array.itemsize].sum()
        given = given_arrays(problem)
        session = SolverSession(solver, problem, m.tolerance, self)
        batched = m.entry.batched
        if batched is None:
            for case, file in zip(cases, files, strict=True):
                outcome = self.solved(session, case, file)
                given.check()
                yield outcome
            return
        for start in range(0, len(cases), batched):
            some = slice(start, start + batched)
            for outcome in self.solved_batch(session, cases[some], files[some]):
                given.check()
                yield outcome

    def solved(self, session: SolverSession, case: LoadCase, answer_file: Path) -> FinishedReport:
        """Solve one load case and save its answer; returns the last event of its row."""
        problem = session.problem
        start = time.perf_counter()
        (load,) = problem.loads([case])
        form_s = time.perf_counter() - start
        near = session.nearest(load)
        began = time.monotonic()
        self.begin(session)
        answer = session.next(copied(load), near)
        stopped = answer.status != "solved" and time.monotonic() - began >= session.solver.time_limit_s
        x = answer.x
        if "x" not in problem.needs and answer.lam is not None:
            with self.step("form_s", form_s):
                (x,) = problem.recover([answer.lam], [None], [case])
        outcome = self.saved(answer, x, answer_file, problem, figures(answer) | {"warm": near is not None})
        if stopped:
            last = f"stopped by itself after {session.solver.time_limit_s:g} s, with its last iterate"
            outcome |= {"status": "time_limit", "message": last}
        return outcome

    def solved_batch(
        self, session: SolverSession, cases: Sequence[LoadCase], answer_files: Sequence[Path]
    ) -> Iterator[FinishedReport]:
        """Solve load cases at once and save their answers; each has an equal share of the time."""
        problem = session.problem
        start = time.perf_counter()
        loads = problem.loads(cases)
        form_s = time.perf_counter() - start

        loads, warm = [copied(load) for load in loads], session.opened
        self.begin(session)
        if session.batch is None:
            raise Unsupported("takes one load case at a time")
        start = time.perf_counter()
        answers = session.solve_batch(loads)
        solve_s = time.perf_counter() - start
        start = time.perf_counter()
        lams, xs = [answer.lam for answer in answers], [answer.x for answer in answers]
        recovered = problem.recover(lams, xs, cases)
        form_s += time.perf_counter() - start
        k = len(cases)
        shares: Report = {"batched": k, "warm": warm, "solve_s": solve_s / k, "form_s": form_s / k}
        for answer, x, file in zip(answers, recovered, answer_files, strict=True):
            yield self.saved(answer, x, file, problem, figures(answer) | shares)

    def begin(self, session: SolverSession) -> None:
        """Start the clock of the solver; before the first load case, convert and prepare."""
        self.events.report(phase="solve")
        if not session.opened:
            self.events.report(data_mib=resident_mib("VmRSS"), device=cpu_model())
            session.open(batched=self.first.entry.batched is not None)

    def saved(
        self, answer: Answer, x: Vector | None, file: Path, problem: Problem, fields: Report
    ) -> FinishedReport:
        """Report the figures of an answer, and save it; returns the last event of its row."""
        stages = " ".join(problem.prepared.opened)
        peak = resident_mib("VmHWM")
        self.events.report(phase="save")
        self.events.report(**{**fields, **threads_in_effect(), "peak_rss_mib": peak, "stages": stages})
        if self.first.suite.yardstick and problem.yardstick is not None:
            self.events.report(**yardstick(problem.yardstick))
        if x is None:
            return {"status": answer.status, "answer": None}
        lam = np.full(problem.assembly.m, np.nan) if answer.lam is None else answer.lam
        try:
            replace_arrays(file, {"x": x, "lam": lam})
        except OSError as error:
            return {"status": "failed", "answer": None, "cannot_save": f"{file}: {error}"}
        return {"status": answer.status, "answer": f"answers/{file.name}"}


def scene_to_measure(measurements: Sequence[Measurement]) -> Scene:
    """The scene; of one with stages the last, but for a series, which takes no stages."""
    first = measurements[0]
    scene = read_scene(first.source)
    if first.series is None and scene.stages:
        from harness.verification.reference_problem import last_stage

        return last_stage(scene, first.suite.reference_limit_s)[0]
    return scene


def load_cases(scene: Scene, measurements: Sequence[Measurement]) -> Iterator[LoadCase]:
    """The scene's own load case, or those of a series."""
    first = measurements[0]
    if first.series is None:
        yield load_case(scene, first.form)
        return
    from problems.load_cases.stream import drawn_cases

    cases = drawn_cases(scene, first.form, **first.series.model_dump())
    for each in measurements:
        assert each.case is not None
        yield cases.load(each.case)


def threads_in_effect() -> Report:
    """BLAS kernels and thread count of the libraries loaded so far."""
    pools = threadpoolctl.threadpool_info()
    blas = [pool for pool in pools if pool["user_api"] == "blas"]
    return {
        "kernels": ", ".join(blas_kernels(pools)) or None,
        "threads": max((pool["num_threads"] for pool in blas or pools), default=None),
    }


def yardstick(Q: Matrix) -> Report:
    """The speed of the machine beside each solve: a Cholesky factorisation of Q and a product Qv, s.

    Each is the median of three: of m³/3 operations, and of one pass over 8m² bytes.
    """
    v = np.ones(len(Q))
    factor, product = [], []
    for _ in range(YARDSTICK_REPEATS):
        copy = np.array(Q, order="F")
        start = time.perf_counter()
        lapack.dpotrf(copy, clean=False, overwrite_a=True)
        factor.append(time.perf_counter() - start)
        start = time.perf_counter()
        Q @ v
        product.append(time.perf_counter() - start)
    return {"cholesky_s": median(factor), "product_s": median(product)}
