"""The largest gap that plans leave in each load case, computed in one process.

A plan is a set of items, fasteners or shims. An item z adds f_z to the forces f₀ of the scene without any,
g_z to its gaps, and u_z = AᵀK⁻¹f_z − g_z to its overlap p₀:

    f = f₀ + Σ f_z,   g = g₀ + Σ g_z,   p = p₀ + Σ u_z,

so that a plan costs no more than its contact problems. Active-set Newton solves each from the answer of
another plan in the same load case: most contacts have the same state.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from uuid import uuid4

import numpy as np
import threadpoolctl

from harness.placement.candidates import Place, Plan
from harness.solving.call_lock import in_turn
from harness.verification.assess import Assessment, GapError, assess
from harness.verification.judge import LIMIT_MM
from harness.verification.reference import proof_of
from problems.build import load_case, prepared
from problems.effects.fasteners import Fasteners
from problems.forms import Form
from problems.forms.assembly import Assembly, DualLoadCase, Matrix, Vector
from problems.load_cases import LoadCases
from problems.model.effect import Effect
from problems.model.scene import JointScene
from solvers.algorithms.newton_sweeps import Case, Sweeps

TOLERANCE_MM, ESTIMATE_MM = 1e-9, 1e-5  # of estimates: gaps agree to a nanometre
ENOUGH_MM = LIMIT_MM / 2  # a bound that needs no further refinement
THREADS = 1  # of linear algebra: two workers gain more than two threads
POWER = 8  # of the mean of gaps that stands for the largest one where that does not change


@dataclass(frozen=True)
class Study(ABC):
    """The scene without the items of a plan, and its load cases."""

    bare: JointScene
    cases: LoadCases
    form: Form
    key: str = field(default_factory=lambda: uuid4().hex, kw_only=True)

    @abstractmethod
    def effect(self, item: Place) -> Effect:
        """What an item adds to the scene."""

    def further(
        self, assembly: Assembly, gap: Vector, x: Callable[[], Vector], error_mm: float
    ) -> tuple[float, ...]:
        """More figures of a case, from its gaps (m,) mm, no less than they can be, and x (n,) ± error_mm."""
        return ()


@dataclass(frozen=True)
class FastenerStudy(Study):
    """fastener : one of those that are left out of the scene."""

    fastener: Fasteners

    def effect(self, item: Place) -> Fasteners:
        return self.fastener.model_copy(update={"points": (item,), "pattern": None})


@dataclass(frozen=True)
class Question:
    """Asks for the gaps of plans in some cases. base : the plan from whose answers they are estimated; None:
    they are proven.
    """

    plans: tuple[Plan, ...]
    cases: tuple[int, ...]
    base: Plan | None = None


@dataclass(frozen=True)
class Outcome:
    """The gaps y of a plan, one entry per case.

    largest : the largest gap, mm; of a proven answer an upper bound on it. contact : where it is. mean :
    (Σ y⁸ / m)^⅛, mm. further : see `Study.further`.
    """

    largest: tuple[float, ...]
    contact: tuple[int, ...]
    mean: tuple[float, ...]
    further: tuple[tuple[float, ...], ...] = ()


class PlanSession:
    """Answers questions of one study; its matrices are made once."""

    def __init__(self, study: Study) -> None:
        threadpoolctl.threadpool_limits(THREADS)
        self.study = study
        self.data = prepared(study.bare, form=study.form)
        self.sweeps = Sweeps(self.data)
        self.proof, self.gap_error = proof_of(self.data), GapError.of(self.data.assembly)
        self.loads: dict[int, DualLoadCase] = {}
        self.columns: dict[Place, tuple[Vector, Vector, Vector]] = {}
        self.starts = lru_cache(4)(lambda base, k: self.sweeps.together(self._loads(base, k), ESTIMATE_MM))

    def answer(self, question: Question) -> list[Outcome]:
        """The outcome of each plan, the same to the last bit whatever was answered before."""
        starts = [] if question.base is None else self.starts(question.base, question.cases)
        return [self._outcome(self._loads(plan, question.cases), starts) for plan in question.plans]

    def gaps(self, numbers: Sequence[int]) -> Matrix:
        """An estimate of the gaps (m, k) that no item leaves in some cases, mm."""
        cases = self.sweeps.together(self._loads((), numbers), ESTIMATE_MM)
        return np.column_stack([self.sweeps.vectors(case)[1] for case in cases])

    def _outcome(self, loads: list[DualLoadCase], starts: list[Case]) -> Outcome:
        """starts : one for each case of an estimate; none: it is proven."""
        if starts:
            cases = self.sweeps.together(loads, ESTIMATE_MM, starts)
            lams, ys = zip(*map(self.sweeps.vectors, cases), strict=True)
            xs = [partial(self.data.recover, *pair) for pair in zip(lams, loads, strict=True)]
            gaps, errors, bounds = np.column_stack(ys), np.zeros(len(loads)), [0.0] * len(loads)
        else:
            answers, errors = self._proven(loads, self.sweeps.together(loads, TOLERANCE_MM))
            xs = [partial(np.asarray, answer.x) for answer in answers]
            gaps, bounds = np.column_stack([a.gap for a in answers]), [a.bound_mm for a in answers]
        largest = gaps.max(axis=0) + errors
        mean = (np.maximum(gaps, 0.0) ** POWER).mean(axis=0) ** (1 / POWER)
        further = tuple(
            filter(None, map(partial(self.study.further, self.data.assembly), (gaps + errors).T, xs, bounds))
        )
        at = gaps.argmax(axis=0)
        return Outcome(tuple(largest.tolist()), tuple(at.tolist()), tuple(mean.tolist()), further)

    def _proven(self, loads: list[DualLoadCase], cases: list[Case]) -> tuple[list[Assessment], Vector]:
        """The answers, and how far the largest gap of each may be off (k,), mm."""
        lams = [self.sweeps.vectors(case)[0] for case in cases]
        assessed = assess(self.proof, loads, lams, [None] * len(loads), ENOUGH_MM)
        errors = [
            self.gap_error(load.g, answer.x, answer.bound_mm).max(initial=0.0)
            for load, answer in zip(loads, assessed, strict=True)
        ]
        return assessed, np.array(errors)

    def _loads(self, plan: Plan, numbers: Sequence[int]) -> list[DualLoadCase]:
        new = [k for k in numbers if k not in self.loads]
        if new:
            made = self.data.with_p([self.study.cases.load(k) for k in new])
            self.loads |= dict(zip(new, made, strict=True))
        f = self.loads[numbers[0]].f.copy()
        g, u = np.zeros((2, self.data.assembly.m))
        for item in plan:
            force, gap, overlap = self.column(item)
            f, g, u = f + force, g + gap, u + overlap
        return [DualLoadCase(f, self.loads[k].g + g, self.loads[k].p + u) for k in numbers]

    def column(self, item: Place) -> tuple[Vector, Vector, Vector]:
        """f_z (n,) N, g_z and u_z (m,) mm."""
        if item not in self.columns:
            load = load_case(self.study.bare, self.study.form, [self.study.effect(item)])
            self.columns[item] = load.f, load.g, self.data.overlap(load) if load.f.any() else -load.g
        return self.columns[item]


_sessions: dict[str, PlanSession] = {}  # the only one of this process, so that it opens the assembly once


@in_turn
def answer(task: tuple[Study, Question]) -> list[Outcome]:
    """Answer a question in the session that this process keeps for its study."""
    study, question = task
    if study.key not in _sessions:
        _sessions.clear()
        _sessions[study.key] = PlanSession(study)
    return _sessions[study.key].answer(question)
