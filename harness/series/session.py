"""Where load cases are solved: the assembly open, the solver prepared, the last answers for warm starts."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
import threadpoolctl
from numpy.typing import NDArray

from harness.measurement.solver_session import SolverSession
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.verification.batched.bound import Bound
from harness.verification.batched.vouch import Vouched, vouch
from harness.verification.judge import judge
from harness.verification.reference import refined_active_set
from problems.build import prepared
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.load_cases.base import LoadCases
from problems.model.scene import Scene
from solvers.base import Answer, Form, Solver, failed
from solvers.registry import make_solver

Gaps = NDArray[np.float32]

BLOCK = 64  # cases that share a pass over K and Q
AT_ONCE_S = 5.0  # a block is closed after so long, so that slow cases are not lost with it
STARTS = 32  # answers kept for warm starts: memory does not grow with the number of cases


@dataclass(frozen=True)
class Job:
    """What a series solves, and how.

    check : every so many cases are compared with the reference; 0: none. threads : None: as they are.
    """

    scene: Scene
    cases: LoadCases
    solver: str
    form: Form
    tolerance: float
    limit_mm: float
    check: int
    threads: int | None
    options: dict[str, Any] = field(default_factory=dict)
    plugin: Path | None = None
    key: str = field(default_factory=lambda: uuid4().hex)


@dataclass(frozen=True)
class Result:
    """The row of a case and the gap that is left, (m,) mm; None where there is no answer."""

    row: Row
    gap: Gaps | None


@dataclass(frozen=True)
class _Tried:
    case: int
    load: LoadCase
    row: Row
    answer: Answer


class SeriesSession:
    """A job being done in this process. solver : made by the caller; else by its name."""

    def __init__(self, job: Job, solver: Solver | None = None) -> None:
        threadpoolctl.threadpool_limits(job.threads)
        self.job = job
        self.code = provenance()
        self.data: Prepared = prepared(job.scene)
        self.bound = Bound.of(self.data)
        self.problem = in_form(self.data, job.form)
        solver = solver or make_solver(job.solver, job.options, job.plugin)
        self.row: Row = {}  # of the case being solved
        self.session = SolverSession(solver, self.problem, job.tolerance, self._lap, STARTS)
        self.session.open(batched=True)

    @contextmanager
    def _lap(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.row[name] = time.perf_counter() - start

    def solve(self, numbers: Sequence[int]) -> Iterator[list[Result]]:
        """The cases, some at a time, each list as soon as it is done."""
        for start in range(0, len(numbers), BLOCK):
            some = numbers[start : start + BLOCK]
            loads = list(zip(some, self.problem.loads([self.job.cases.load(k) for k in some]), strict=True))
            if self.session.batch is not None:
                yield self._finished(self._try_batch(loads))
                continue
            begun, tried = time.monotonic(), []
            for case, load in loads:
                tried.append(self._try(case, load))
                if time.monotonic() - begun > AT_ONCE_S:
                    yield self._finished(tried)
                    begun, tried = time.monotonic(), []
            if tried:
                yield self._finished(tried)

    def _try_batch(self, loads: list[tuple[int, LoadCase]]) -> list[_Tried]:
        """Solve them all at once; where that raises, one after another, so that it is known which does."""
        start = time.perf_counter()
        try:
            answers = self.session.solve_batch([load for _, load in loads])
        except Exception:
            return [self._try(case, load) for case, load in loads]
        share = (time.perf_counter() - start) / len(loads)
        return [
            _Tried(case, load, self._begun(case) | {"solve_s": share}, answer)
            for (case, load), answer in zip(loads, answers, strict=True)
        ]

    def _begun(self, case: int) -> Row:
        return {"case": case, **self.job.cases.parameters(case), "warm_from": None}

    def _try(self, case: int, load: LoadCase) -> _Tried:
        """Solve one; what the solver raises becomes its status."""
        self.row = self._begun(case)
        near = self.session.nearest(load)
        if near is not None:
            self.row["warm_from"] = near.case
        try:
            answer = self.session.next(load, near, case)
        except Exception as error:
            self.session.forget()
            answer = failed(f"{type(error).__name__}: {error}"[:500])
        return _Tried(case, load, self.row, answer)

    def _finished(self, tried: list[_Tried]) -> list[Result]:
        """Rows, with what is known of the answers."""
        start = time.perf_counter()
        known = self._vouched(tried)
        if self.session.batch is not None:
            self._try_again(tried, known)
        share = (time.perf_counter() - start) / len(tried)
        return [self._result(each, known.get(each.case), share) for each in tried]

    def _try_again(self, tried: list[_Tried], known: dict[int, Vouched]) -> None:
        """What is not proven to be within the limit, with the p for which Qλ − p is the gap that was found.

        So the answers lose what Q and p have lost in rounding. The better of the two stays.
        """
        places = {each.case: k for k, each in enumerate(tried)}
        far = [tried[places[case]] for case, about in known.items() if about.bound_mm > self.job.limit_mm]
        if not far:
            return
        lams = np.column_stack([each.answer.lam for each in far if each.answer.lam is not None])
        p = self.data.Q @ lams - np.column_stack([known[each.case].gap for each in far])
        loads = [(each.case, replace(each.load, p=column)) for each, column in zip(far, p.T, strict=True)]
        new = self._try_batch(loads)
        for case, about in self._vouched(new).items():
            if about.bound_mm < known[case].bound_mm:
                known[case] = about
                old, better = tried[places[case]], next(each for each in new if each.case == case)
                count = (old.answer.iterations or 0) + (better.answer.iterations or 0)
                tried[places[case]] = replace(old, answer=replace(better.answer, iterations=count))

    def _vouched(self, tried: list[_Tried]) -> dict[int, Vouched]:
        needs = self.problem.needs
        answered = [each for each in tried if all(getattr(each.answer, v) is not None for v in needs)]
        if not answered:
            return {}
        lams = [np.asarray(each.answer.lam, dtype=float) for each in answered]
        own = [each.answer.x if "x" in needs else None for each in answered]
        found = vouch(self.bound, [each.load for each in answered], lams, own)
        return {each.case: about for each, about in zip(answered, found, strict=True)}

    def _result(self, tried: _Tried, about: Vouched | None, vouch_s: float) -> Result:
        answer, job = tried.answer, self.job
        row = tried.row | {
            "status": answer.status,
            "message": answer.details.get("cause"),
            "iterations": answer.iterations,
            "inner_iterations": answer.inner_iterations,
            "form_s": vouch_s,
            "verdict": "no_answer",
            "limit_mm": job.limit_mm,
            **self.code,
        }
        if about is None:
            return Result(row, None)
        row |= {
            "active": about.active,
            "bound_mm": about.bound_mm,
            **{name: getattr(about, name) for name in ("primal_residual", "dual_residual", "duality_gap")},
            "min_gap_mm": float(about.gap.min()),
            "mean_gap_mm": float(about.gap.mean()),
            "max_gap_mm": float(about.gap.max()),
            "verdict": "within" if about.bound_mm <= job.limit_mm else "cannot_be_judged",
        }
        if job.check and tried.case % job.check == 0:
            row |= self._compared(tried, about.x)
        return Result(row, about.gap.astype(np.float32))

    def _compared(self, tried: _Tried, x: Vector) -> Row:
        """The distance to the certified reference, which outweighs the bound."""
        known = refined_active_set(self.data, tried.load)
        lam = np.asarray(tried.answer.lam, dtype=float)
        judged = judge(self.data, tried.load, known, x, lam, self.job.limit_mm)
        names = ("displacement_error_mm", "reference_bound_mm", "contact_mismatch")
        found: Row = {name: getattr(judged, name) for name in names}
        return found if judged.verdict == "cannot_be_judged" else found | {"verdict": judged.verdict}
