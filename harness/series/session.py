"""Solves the cases of a series in one process: opens the assembly and prepares the solver once, and starts
each case from the nearest of the answers so far.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

import numpy as np
import threadpoolctl

from harness.results.provenance import provenance
from harness.results.records import Row
from harness.results.series_file import Gaps
from harness.solving.solver_session import SolverSession, copied, given_arrays
from harness.verification.assess import Assessment, GapError, assess
from harness.verification.judge import LIMIT_MM, judge
from harness.verification.reference import best_of_candidates, proof_of
from harness.verification.reference_problem import refuse_without_contacts
from problems.build import prepared
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.ladders import prefix_of, rung_names
from problems.load_cases import LoadCases
from problems.model.fastener_forces import fastener_forces, force_error
from problems.model.scene import JointScene, ManufacturedScene, Scene
from problems.model.springs import Springs
from problems.reporter import Reporter
from problems.scene_files import read_scene
from solvers.base import Answer, Form, Solver, failed
from solvers.registry import make_solver

ENOUGH = 0.5  # of the limit: an answer proven to within it needs no further refinement
BLOCK = 64  # cases that share a pass over K and Q
BLOCK_BYTES = 2**26  # of their f or x: some fifteen times as much is in use
BLOCK_TIME_S = 5.0  # after this time a block is written, so that few slow cases are lost
KEPT_ANSWERS = 32  # for warm starts: memory does not grow with the number of cases

ReportEvent = Callable[..., None]


@dataclass(frozen=True)
class SeriesOptions:
    """How the load cases of a series are solved.

    Parameters
    ----------
    solver : str
        Name of a solver, or of the one in the plug-in.
    form : str, optional
        "primal", "dual" or "sparse"; by default the cheaper one that the solver takes.
    tolerance : float
        Passed to the solver.
    limit_mm : float
        Limit on the displacement error, mm.
    check : int
        Every `check`-th case is compared with the certified reference; 0: none.
    threads : int, optional
        Threads for linear algebra; by default 2, in the sparse form 1.
    plugin : str or Path, optional
        A Python file with a solver. It runs in a process of its own, under the two limits below.
    time_limit_s : float
        Time limit per load case of a plug-in, s.
    memory_limit_mib : int
        Memory limit over all processes of a plug-in, MiB.

    Examples
    --------
    >>> from rivetbench import SeriesOptions
    >>> SeriesOptions(check=0).solver
    'newton'
    """

    solver: str = "newton"
    form: Form | None = None
    tolerance: float = 1e-11
    limit_mm: float = LIMIT_MM
    check: int = 100
    threads: int | None = None
    plugin: str | Path | None = None
    time_limit_s: float = 60.0
    memory_limit_mib: int = 8192


@dataclass(frozen=True, kw_only=True)
class Job(SeriesOptions):
    """The cases of a series, and how they are solved.

    threads : None: as they are. scene_key, plugin_version : those of the scene and of the plug-in at the
    beginning; "": not told.
    """

    scene: Scene
    cases: LoadCases
    form: Form
    plugin: Path | None = None
    plugin_version: str = ""
    solver_options: dict[str, Any] = field(default_factory=dict)
    key: str = field(default_factory=lambda: uuid4().hex)
    scene_key: str = ""

    def __getstate__(self) -> dict[str, Any]:
        """The fields for another process, which makes a rung of a ladder anew from its name."""
        return vars(self) | ({"scene": self.scene.name} if is_rung(self.scene) else {})

    def __setstate__(self, state: dict[str, Any]) -> None:
        scene = state["scene"]
        vars(self).update(state | {"scene": read_scene(scene) if isinstance(scene, str) else scene})


def is_rung(scene: Scene) -> bool:
    """Whether matrices in memory are those of a rung of a ladder, which its name makes in any process."""
    prefix = prefix_of(scene.name) if isinstance(scene, ManufacturedScene) else None
    return prefix is not None and scene.name in rung_names(prefix)


class Result(NamedTuple):
    """The row of a case and its final gap, (m,) mm; None if there is no answer."""

    row: Row
    gap: Gaps | None


@dataclass(frozen=True)
class Attempt:
    case: int
    load: LoadCase
    row: Row
    answer: Answer


class SeriesSession(Reporter):
    """A job in this process.

    solver : made by the caller, or else by its name. report : of a plug-in, which is given copies of the load
    cases, as compiled code may write into them; called with phase="solve" and `cases` where
    the solver begins, so that each case can have its time limit, and with phase="judging" where it ends; a
    case is then judged as soon as it is solved, unless several are solved at once. batched : whether a solver
    that can solve several at once does.
    """

    def __init__(
        self, job: Job, solver: Solver | None = None, report: ReportEvent | None = None, batched: bool = True
    ) -> None:
        threadpoolctl.threadpool_limits(job.threads)
        self.job = job
        self.report: ReportEvent = report or (lambda **event: None)
        self.block_time_s = 0.0 if report else BLOCK_TIME_S
        self.code = provenance()
        self.data: Prepared = prepared(job.scene, form=job.form)
        refuse_without_contacts(self.data, job.scene.source_of("A"))
        self.block = min(BLOCK, max(BLOCK_BYTES // (8 * self.data.assembly.n), 1))
        self.proof = proof_of(self.data)
        self.gap_error = GapError.of(self.data.assembly)
        self.springs = Springs.of(job.scene) if isinstance(job.scene, JointScene) else None
        self.problem = in_form(self.data, job.form)
        solver = solver or make_solver(job.solver, job.solver_options, job.plugin)
        self.row: Row = {}  # of the case being solved
        self.given = given_arrays(self.problem) if report else None
        self.session = SolverSession(solver, self.problem, job.tolerance, self, KEPT_ANSWERS)
        self.session.open(batched)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        if name == "convert_s":
            self.report(phase="solve")
        start = time.perf_counter()
        yield
        self.row[name] = time.perf_counter() - start

    def solve(self, numbers: Sequence[int]) -> Iterator[list[Result]]:
        """The results of the cases with these numbers, a block at a time."""
        for attempts in self.attempted(numbers):
            yield self.results(attempts, self.assessed(attempts))

    def attempted(self, numbers: Sequence[int]) -> Iterator[list[Attempt]]:
        """The answers to the cases with these numbers, a block at a time."""
        for start in range(0, len(numbers), self.block):
            block = numbers[start : start + self.block]
            loads = list(zip(block, self.problem.loads([self.job.cases.load(k) for k in block]), strict=True))
            if self.session.batch is not None:
                yield self._try_batch(loads)
                continue
            started, attempts = time.monotonic(), []
            for case, load in loads:
                attempts.append(self._try(case, load))
                if time.monotonic() - started > self.block_time_s:
                    yield attempts
                    started, attempts = time.monotonic(), []
            if attempts:
                yield attempts

    def _try_batch(self, loads: list[tuple[int, LoadCase]]) -> list[Attempt]:
        """Solve them all at once; if that raises, one after another, to find out which one does."""
        self.report(phase="solve", times=len(loads), cases=[case for case, _ in loads])
        start = time.perf_counter()
        try:
            answers = self.session.solve_batch([self._own(load) for _, load in loads])
        except Exception:
            return [self._try(case, load) for case, load in loads]
        share = (time.perf_counter() - start) / len(loads)
        return [
            Attempt(case, load, self._new_row(case) | {"solve_s": share}, answer)
            for (case, load), answer in zip(loads, answers, strict=True)
        ]

    def _new_row(self, case: int) -> Row:
        return {"case": case, **self.job.cases.parameters(case), "warm_from": None}

    def _own(self, load: LoadCase) -> LoadCase:
        """The load case for the solver: a copy for a plug-in."""
        return load if self.given is None else copied(load)

    def _try(self, case: int, load: LoadCase) -> Attempt:
        """Solve one; if the solver raises, its status is `failed`, or `memory_limit` if memory runs out."""
        self.report(phase="solve", cases=[case])
        self.row = self._new_row(case)
        near = self.session.nearest(load)
        if near is not None:
            self.row["warm_from"] = near.case
        try:
            answer = self.session.next(self._own(load), near, case)
        except Exception as error:
            self.session.forget()
            answer = failed(f"{type(error).__name__}: {error}"[:500])
            if isinstance(error, MemoryError):
                self.row["status"] = "memory_limit"
        return Attempt(case, load, self.row, answer)

    def results(self, attempts: list[Attempt], assessed: dict[int, Assessment]) -> list[Result]:
        """The rows and gaps of attempts, with what `assessed` says of them."""
        return [self._result(attempt, assessed.get(attempt.case)) for attempt in attempts]

    def assessed(self, attempts: list[Attempt]) -> dict[int, Assessment]:
        """The proven answers of those that are whole, by the number of the case."""
        self.report(phase="judging")
        if self.given is not None:
            self.given.check()
        start = time.perf_counter()
        needs = self.problem.needs
        answered = [one for one in attempts if all(getattr(one.answer, name) is not None for name in needs)]
        if not answered:
            return {}
        lams = [np.asarray(attempt.answer.lam, dtype=float) for attempt in answered]
        xs = [attempt.answer.x if "x" in needs else None for attempt in answered]
        loads = [attempt.load for attempt in answered]
        assessments = assess(self.proof, loads, lams, xs, ENOUGH * self.job.limit_mm)
        for attempt in attempts:
            attempt.row["form_s"] = (time.perf_counter() - start) / len(attempts)
        return {attempt.case: made for attempt, made in zip(answered, assessments, strict=True)}

    def _result(self, attempt: Attempt, assessment: Assessment | None) -> Result:
        answer, job = attempt.answer, self.job
        row = attempt.row | {
            "status": attempt.row.get("status", answer.status),
            "message": answer.cause,
            "iterations": answer.iterations,
            "inner_iterations": answer.inner_iterations,
            "form_s": attempt.row.get("form_s", 0.0),
            "verdict": "no_answer",
            "limit_mm": job.limit_mm,
            **self.code,
        }
        if assessment is None:
            return Result(row, None)
        gap_error = self.gap_error(attempt.load.g, assessment.x, assessment.bound_mm)
        row |= {
            "active": assessment.active,
            "bound_mm": assessment.bound_mm,
            "gap_error_mm": float(gap_error.max()),
            "primal_residual": assessment.primal_residual,
            "dual_residual": assessment.dual_residual,
            "duality_gap": assessment.duality_gap,
            "min_gap_mm": float(assessment.gap.min()),
            "mean_gap_mm": float(assessment.gap.mean()),
            "max_gap_mm": float(assessment.gap.max()),
            "verdict": "within" if assessment.bound_mm <= job.limit_mm else "cannot_be_judged",
        }
        if self.springs and (scene := job.cases.scene_of(attempt.case)):
            x = self.data.assembly.at_junction(assessment.x)
            row["fastener_forces_N"] = [fastener["force_N"] for fastener in fastener_forces(scene, x)]
            row["force_error_N"] = force_error(self.springs, scene, x, assessment.bound_mm)
        if job.check and attempt.case % job.check == 0:
            row |= self._against_reference(attempt, assessment.x)
        return Result(row, assessment.gap.astype(np.float32))

    def _against_reference(self, attempt: Attempt, x: Vector) -> Row:
        """The distance to the certified reference, which replaces the bound in the verdict."""
        known = best_of_candidates(self.data, attempt.load)
        lam = np.asarray(attempt.answer.lam, dtype=float)
        judged = judge(self.data, attempt.load, known, x, lam, self.job.limit_mm)
        names = ("displacement_error_mm", "reference_bound_mm", "contact_mismatch")
        found: Row = {name: getattr(judged, name) for name in names}
        return found if judged.verdict == "cannot_be_judged" else found | {"verdict": judged.verdict}
