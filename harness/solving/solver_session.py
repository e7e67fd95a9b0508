"""Takes a solver through its steps on one problem; tries the in-house methods in turn.

No other code calls the steps of solvers.base.
"""

import os
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms import Form, default_form
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import Problem, in_form, read_only
from problems.forms.solver_units import Units
from problems.reporter import SILENT, Reporter
from solvers.base import Answer, Batch, Solver, WarmStart

from .solver_answer import GivenArrays, InvalidAnswer, checked

NO_ANSWER = "gave no answer; try another solver or form"
NO_CONTACT = "no contact closes"
#: The in-house methods whose answers may become a reference, in the order in which they are tried.
DENSE = ("newton", "ipm-fast", "ipm", "gi")
SPARSE = ("newton", "mprgp")
TOLERANCE_MM = 1e-11  # of these methods
#: Attributes of solvers.base.Solver that a run sets.
SET_BY_RUNS = ("time_limit_s", "iteration_limit", "prints")
OTHER_NAME = "Choose another name: a run replaces it. self.most(LIMIT) has its limit on iterations and yours"


@dataclass(frozen=True)
class SolvedCase:
    """A solved load case, from which the next one may start. case : its number in a series."""

    case: int | None
    load: LoadCase
    lam: Vector
    x: Vector | None


class SolverSession:
    """Convert and prepare once, then solve load cases one by one; answers are kept for warm starts.

    The solver is given the problem in the units of problems/forms/solver_units.py, chosen anew by `cold`.

    Parameters
    ----------
    reporter : its steps are those of the solver: convert_s, prepare_s, setup_s, solve_s.
    most : answers kept for warm starts; all by default.

    Raises what the solver raises, and InvalidAnswer if an answer is invalid.
    """

    def __init__(
        self,
        solver: Solver,
        problem: Problem,
        tolerance: float,
        reporter: Reporter = SILENT,
        most: int | None = None,
    ) -> None:
        self.solver, self.problem, self.tolerance, self.reporter = solver, problem, tolerance, reporter
        self.solved: deque[SolvedCase] = deque(maxlen=most)
        self.opened = False
        self.state: Any = None
        self.ready: Any = None
        self.batch: Batch | None = None

    def open(self, batched: bool = False) -> None:
        """Convert and prepare. batched : also ask for the solver's way to solve several at once."""
        protect(self.problem)
        with self._step("convert_s"):
            self.units = Units.of(self.problem)
            scaled = self.units.scaled()
            protect(scaled)
            converted = self.solver.convert(scaled)
        with self._step("prepare_s"):
            self.state = self.solver.prepare(converted)
            if batched and (batch := self.solver.batched(self.state)) is not None:
                self.batch = self._in_units(batch)
        self.opened = True

    def nearest(self, load: LoadCase) -> SolvedCase | None:
        """The solved case to start from; None before the first case and after a failure."""
        if self.ready is None:
            return None
        return min(self.solved, key=lambda other: self.problem.distance(other.load, load), default=None)

    def cold(self, load: LoadCase) -> Answer:
        """Set up and solve."""
        self.units = self.units.of_loads([load])
        with self._step("setup_s"):
            scaled = self.units.load(load), self.tolerance / self.units.length
            self.ready = self.solver.setup(self.state, *scaled)
        return self._solve(*scaled)

    def warm(self, load: LoadCase, start: WarmStart) -> Answer:
        """Update for the next load case, and solve."""
        self.units = self.units.followed_by(load)
        with self._step("setup_s"):
            scaled = self.units.load(load), self.tolerance / self.units.length
            near = WarmStart(self.units.load(start.load), *self.units.start(start.lam, start.gap, start.x))
            self.ready = self.solver.update(self.state, self.ready, *scaled, near)
        return self._solve(*scaled)

    def next(self, load: LoadCase, near: SolvedCase | None, case: int | None = None) -> Answer:
        """Solve, from the nearest answer if there is one; the answer is checked and kept."""
        if near is None:
            answer = checked(self.cold(load), self.problem)
        else:
            gap = self.problem.gap(near.load, near.lam, near.x)
            start = WarmStart(near.load, near.lam, gap, near.x)
            answer = checked(self.warm(load, start), self.problem)
        if answer.lam is not None:
            x = answer.x if "x" in self.problem.needs else None
            self.solved.append(SolvedCase(case, load, answer.lam, x))
        return answer

    def solve_batch(self, loads: Sequence[LoadCase]) -> list[Answer]:
        """An answer to each load case, validated."""
        assert self.batch is not None
        with self.in_one_process():
            answers = list(self.batch(loads, self.tolerance))
        if len(answers) != len(loads):
            raise InvalidAnswer(f"{len(answers)} answers to {len(loads)} load cases")
        return [checked(answer, self.problem) for answer in answers]

    def forget(self) -> None:
        """Set up the next case from the start, as after a failure."""
        self.ready = None

    @contextmanager
    def in_one_process(self) -> Iterator[None]:
        """A fork that the solver makes meanwhile ends if it comes back."""
        process = os.getpid()
        try:
            yield
        finally:
            if os.getpid() != process:
                os._exit(0)

    @contextmanager
    def _step(self, name: str) -> Iterator[None]:
        with self.reporter.step(name), self.in_one_process():
            yield

    def _solve(self, load: LoadCase, tolerance: float) -> Answer:
        with self._step("solve_s"):
            answer = self.solver.solve(self.ready, load, tolerance)
        return _in_own_units(answer, self.units)

    def _in_units(self, batch: Batch) -> Batch:
        def scaled(loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
            units = self.units.of_loads(loads)
            answers = batch([units.load(load) for load in loads], tolerance / units.length)
            return [_in_own_units(answer, units) for answer in answers]

        return scaled


def _in_own_units(answer: Answer, units: Units) -> Answer:
    """The answer with λ and x in the problem's units; what is no Answer stays, to be refused."""
    if units.unchanged or not isinstance(answer, Answer):
        return answer
    lam, x = units.answer(answer.lam, answer.x)
    return replace(answer, lam=lam, x=x)


def replaced(solver: Solver) -> list[str]:
    """The attributes of a solver to which it has given values of its own, and a run gives others."""
    return [name for name in SET_BY_RUNS if getattr(solver, name) != getattr(Solver, name)]


def copied(load: LoadCase) -> LoadCase:
    """A read-only copy for a solver: what compiled code writes into it changes no other load case."""
    arrays: dict[str, Any] = {
        name: value.copy() for name, value in vars(load).items() if isinstance(value, np.ndarray)
    }
    return read_only(replace(load, **arrays))


def given_arrays(problem: Problem, *loads: LoadCase) -> GivenArrays:
    """The arrays that a solver is given; those of the problem are made read-only."""
    protect(problem)
    A = problem.assembly.A
    of_loads = [v for load in loads for v in vars(load).values() if isinstance(v, np.ndarray)]
    return GivenArrays([*problem.arrays, A.data, A.indices, A.indptr, *of_loads])


def protect(problem: Problem) -> None:
    """Make the arrays that the solver is given read-only."""
    assembly = problem.assembly
    factors = assembly.K.factors if assembly.K.factored else ()
    made = [*assembly.K.arrays, *factors, problem.prepared.Q_if_made, assembly.A, assembly.nodes]
    for matrix in made:
        if sp.issparse(matrix) and matrix.data.flags.writeable:
            matrix.sum_duplicates()  # as scipy would in place, when it is first asked for |A|
        parts = (matrix.data, matrix.indices, matrix.indptr) if sp.issparse(matrix) else (matrix,)
        for array in parts:
            if array is not None:
                array.flags.writeable = False


def form_of(name: str, taken: Sequence[Form], form: Form | None = None) -> Form:
    """The form asked for, else the usual one of those taken. Raises InputError if it is not taken."""
    form = form or default_form(taken)
    if form not in taken:
        raise InputError.one(f"solver {name}", "form", form, f"it takes {' and '.join(taken)}")
    return form


def answer_of(
    name: str, solver: Solver, data: Prepared, form: Form, case: LoadCase, tolerance: float
) -> Answer:
    """The solver's answer with x (n,) in mm, recovered where the form has none.

    lam is None if the solver gives no forces. Raises InputError if there are no displacements.
    """
    problem = in_form(data, form)
    answer = forces_of(name, solver, problem, case, tolerance)
    (x,) = problem.recover([answer.lam], [answer.x], [case])
    if x is None:
        raise no_answer(name, answer)
    return replace(answer, x=x)


def forces_of(name: str, solver: Solver, problem: Problem, case: LoadCase, tolerance: float) -> Answer:
    """The solver's own answer. Raises InputError if it is invalid, or has no forces and displacements."""
    session = SolverSession(solver, problem, tolerance)
    session.open()
    (load,) = problem.loads([case])
    try:
        answer = session.next(load, None)
    except InvalidAnswer as error:
        raise InputError.one(f"solver {name}", "answer", str(error), NO_ANSWER) from error
    if answer.lam is None and answer.x is None:
        raise no_answer(name, answer)
    return answer


def no_answer(name: str, answer: Answer) -> InputError:
    """The error for a solver that gives neither forces nor displacements."""
    status = ": ".join(filter(None, (answer.status, answer.cause)))
    return InputError.one(f"solver {name}", "status", status, NO_ANSWER)


def candidate_forces(prepared: Prepared, load: LoadCase) -> Iterator[tuple[str, Vector]]:
    """Names and λ (m,) N of the in-house methods; each is run when its answer is asked for.

    None is run where no contact overlaps.
    """
    if not (prepared.overlap(load) > 0).any():
        yield NO_CONTACT, np.zeros(prepared.assembly.m)
        return
    from solvers.registry import make_solver  # slow to import

    problem = in_form(prepared, prepared.form)
    for name in SPARSE if prepared.form == "sparse" else DENSE:
        try:
            answer = forces_of(name, make_solver(name, {}), problem, load, TOLERANCE_MM)
        except (InputError, ArithmeticError, np.linalg.LinAlgError, RuntimeError):
            continue  # it gave no answer
        if answer.lam is not None:
            yield f"{name}, refined", answer.lam
