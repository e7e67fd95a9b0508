"""The interface of a solver: up to five steps from the problem's data to an answer.

    convert(problem)             once per assembly    data into the library's own format
    prepare(data)                once per assembly    factorisations
    setup(state, load, tol)      once per load case   the library's own set-up
    solve(ready, load, tol)      once per load case   the answer

In a series of load cases on one assembly, all but the first are set up by

    update(state, ready, load, tol, start)          instead of setup: a warm start, or the library's own
                                                    update of the data

or solved several at a time by the function that `batched(state)` returns, if a solver has it.

Only `solve` must be written: by default, the other steps pass on their argument, and `update` calls `setup`.
The harness calls and times the steps; a solver never reads a clock, judges its answer or handles limits.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any, ClassVar, Literal

from problems.forms import DENSE_FORMS as DENSE_FORMS
from problems.forms import FORMS as FORMS
from problems.forms import Form as Form
from problems.forms.assembly import DualLoadCase as DualLoadCase
from problems.forms.assembly import LoadCase as LoadCase
from problems.forms.assembly import Vector
from problems.forms.problem import Problem as Problem

#: A solver's report on its own answer.
Status = Literal["solved", "inaccurate", "iteration_limit", "failed"]


@dataclass(frozen=True)
class Answer:
    """The answer of a solver to one load case.

    Parameters
    ----------
    status : {"solved", "inaccurate", "iteration_limit", "failed"}
        The solver's report on its own answer; the harness judges the answer itself.
    lam : ndarray of shape (m,), optional
        Contact forces λ ≥ 0 in N, the multipliers of Aᵀx ≤ g. None if there is no answer.
    x : ndarray of shape (n,), optional
        Displacements in mm. None in the dual form, where x = K⁻¹(f − Aλ) is recovered.
    iterations : int, optional
        Outer iterations; in an active-set method, changes of the set.
    inner_iterations : int, optional
        Inner iterations, for example of conjugate gradients.
    reported_s : float, optional
        Seconds by the solver's own clock, if it has one.
    details : dict
        All else to record, as JSON types. `products`: products with Q; `cause`: why it is not solved;
        `device`: what it computes on, if that is not the CPU.
    """

    status: Status
    lam: Vector | None = None
    x: Vector | None = None
    iterations: int | None = None
    inner_iterations: int | None = None
    reported_s: float | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def cause(self) -> str | None:
        """The reason why it is not solved, in the words of the method or of its library, if they say one."""
        texts = [self.details.get(name) for name in ("cause", "message", "status")]
        return None if self.status == "solved" else next((str(text) for text in texts if text), None)


def failed(cause: str, iterations: int | None = None) -> Answer:
    """An answer without forces, and its cause."""
    return Answer("failed", iterations=iterations, details={"cause": cause})


#: (load cases of one assembly, tolerance) → an answer to each, in their order.
Batch = Callable[[Sequence[Any], float], list[Answer]]


@dataclass(frozen=True)
class WarmStart:
    """The answer to the solved load case that is nearest to the next one.

    Parameters
    ----------
    load : LoadCase
        The solved load case.
    lam : ndarray of shape (m,)
        Its contact forces λ in N.
    gap : ndarray of shape (m,)
        Its gaps y = g − Aᵀx = Qλ − p in mm.
    x : ndarray of shape (n,), optional
        Its displacements in mm; None in the dual form.
    """

    load: LoadCase
    lam: Vector
    gap: Vector
    x: Vector | None = None


@dataclass(frozen=True)
class DualStart(WarmStart):
    """A warm start whose load case has p."""

    load: DualLoadCase


class Solver(ABC):
    """Base of all solvers. Options are keyword arguments of the constructor, which checks them.

    Attributes
    ----------
    forms : tuple of {"primal", "dual", "sparse"}
        The forms that the solver takes. In the sparse one, blocks and G are SciPy's sparse arrays.
    distribution : str, optional
        The distribution of the library, if it has another name than the solver.
    time_limit_s : float
        Seconds after which a library with a limit of its own is to stop and give its last iterate; set by
        the harness.
    iteration_limit : int, optional
        Iterations after which to stop, with the point reached; None: the method's own limit alone. Set by the
        harness.
    prints : bool
        Whether to print a log, which `run` keeps beside the answer; set by the harness.

    Notes
    -----
    The problem is min ½xᵀKx − fᵀx, Aᵀx ≤ g with K (n, n) in N/mm, A (n, m) and loads f (n,) in N,
    g (m,) in mm. Its dual is min ½λᵀQλ − pᵀλ, λ ≥ 0 with Q = AᵀK⁻¹A in mm/N and p = AᵀK⁻¹f − g in mm.
    All arrays are read-only and shared. A solver sees lengths and forces multiplied by powers of two, by
    which those of a joint in mm and N hardly change (problems/forms/solver_units.py). The tolerance is scaled
    with them: a solver that stops at max|min(λ, y)| or at max|y| ≤ tolerance compares it with gaps in mm.

    Examples
    --------
    The primal–dual active set, which starts from the contacts that overlap without forces:

    >>> import numpy as np
    >>> from rivetbench import solve
    >>> from solvers.base import Answer, Solver
    >>> class ActiveSet(Solver):
    ...     forms = ("dual",)
    ...
    ...     def solve(self, ready, load, tolerance):
    ...         Q, p, C = ready.Q, load.p, load.p > 0
    ...         for k in range(100):
    ...             lam = np.zeros_like(p)
    ...             lam[C] = np.linalg.solve(Q[np.ix_(C, C)], p[C])
    ...             wrong = np.where(C, lam < 0, Q @ lam < p)
    ...             if not wrong.any():
    ...                 return Answer("solved", lam, iterations=k)
    ...             C = C ^ wrong
    ...         return Answer("iteration_limit", lam)
    >>> solve("gallery/three-part-stack", ActiveSet()).judgement.verdict
    'within'
    """

    forms: tuple[Form, ...] = DENSE_FORMS
    distribution: ClassVar[str | None] = None
    time_limit_s: float = inf
    iteration_limit: int | None = None
    prints: bool = False

    def most(self, usual: int) -> int:
        """The limit on iterations: the usual one, or `iteration_limit` if that is less."""
        return usual if self.iteration_limit is None else min(usual, self.iteration_limit)

    def convert(self, problem: Problem) -> Any:
        """Bring the data of an assembly into the library's own format; once per assembly.

        Parameters
        ----------
        problem : Problem
            The quadratic program in one of `forms`: its `assembly` (K, A), and `Q` or P as `blocks`.

        Returns
        -------
        object
            The argument of `prepare`; by default the problem itself.
        """
        return problem

    def prepare(self, data: Any) -> Any:
        """Factor and compute all that load cases share; once per assembly.

        Parameters
        ----------
        data : object
            The result of `convert`.

        Returns
        -------
        object
            The state for `setup`, `update` and `batched`, which do not change it; by default `data`.
        """
        return data

    def setup(self, state: Any, load: Any, tolerance: float) -> Any:
        """Set up the first load case of a series, or one that is solved by itself.

        Parameters
        ----------
        state : object
            The result of `prepare`.
        load : LoadCase or DualLoadCase
            f (n,) in N, g (m,) in mm, and p (m,) in mm in the dual form.
        tolerance : float
            The largest violation of the optimality conditions, in the sense of the solver's own test.

        Returns
        -------
        object
            The argument `ready` of `solve`; by default `state`.
        """
        return state

    def update(self, state: Any, ready: Any, load: Any, tolerance: float, start: WarmStart) -> Any:
        """Set up a further load case of the same assembly; by default by `setup`.

        Parameters
        ----------
        state : object
            The result of `prepare`.
        ready : object
            The result of `setup` or `update` for the case solved before; may be changed and returned.
        load : LoadCase
            The next load case.
        tolerance : float
            That of this load case: in other units than the one before, it is another number.
        start : WarmStart
            A solved case from which to start, not necessarily the one before.

        Returns
        -------
        object
            The argument `ready` of `solve`.
        """
        return self.setup(state, load, tolerance)

    def batched(self, state: Any) -> Batch | None:
        """Return a function that solves several load cases of the assembly at once.

        Parameters
        ----------
        state : object
            The result of `prepare`.

        Returns
        -------
        callable or None
            (load cases, tolerance) → their answers in the same order. None if there is no such function.
        """
        return None

    @abstractmethod
    def solve(self, ready: Any, load: Any, tolerance: float) -> Answer:
        """Solve a load case.

        Parameters
        ----------
        ready : object
            The result of `setup` or `update`.
        load : LoadCase
            The same load case.
        tolerance : float
            The largest violation of the optimality conditions, in the sense of the solver's own test.

        Returns
        -------
        Answer
            λ, in the primal and the sparse form x as well, and the status.
        """
