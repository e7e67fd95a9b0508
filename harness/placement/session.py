"""The largest gap that plans leave in each load case after the last stage, computed in one process.

A plan is a set of items, fasteners or shims. An item z adds f_z to the forces f₀ of the scene without any,
g_z to its gaps, and u_z = AᵀK⁻¹f_z − g_z to its overlap p₀, in each stage that has the items. The approaches
a that earlier stages have locked add to both by springs of directions T and stiffnesses k:

    f = f₀ + Σ f_z + T(k a),   g = g₀ + Σ g_z,   p = p₀ + Σ u_z + AᵀK⁻¹T(k a),

so that a plan costs no more than its contact problems: that of the last stage, and those of the stages in
which fasteners lock what they find. Active-set Newton solves each from the answer of another plan in the same
stage and load case: most contacts have the same state.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from typing import Any
from uuid import uuid4

import numpy as np
import scipy.sparse as sp
import threadpoolctl

from harness.placement.candidates import MovableFasteners, Place, Plan, without_fasteners
from harness.results.provenance import installed_version
from harness.scene.stress import sensitivities
from harness.series.session import BLOCK, BLOCK_BYTES
from harness.series.staged import OpenStage, OpenStages, StageCases
from harness.series.stiffness_session import StiffnessSession
from harness.solving.call_lock import in_turn
from harness.verification.assess import Assessment, assess
from harness.verification.judge import LIMIT_MM
from problems.build import load_case
from problems.effects.fasteners import Fasteners
from problems.forms import Form
from problems.forms.assembly import DualLoadCase, Matrix, Vector
from problems.load_cases import LoadCases
from problems.model.effect import Effect, code_of
from problems.model.scene import JointScene
from problems.model.stage_answers import Elongations, locked, through
from problems.storage import fingerprint
from solvers.algorithms.newton_sweeps import Case

TOLERANCE_MM, ESTIMATE_MM = 1e-9, 1e-5  # of estimates: gaps agree to a nanometre
ENOUGH_MM = LIMIT_MM / 2  # a bound that needs no further refinement
THREADS = 1  # of linear algebra: two workers gain more than two threads
LOADS_BYTES = 2**29  # of load cases kept for other questions
POWER = 8  # of the mean of gaps that stands for the largest one where that does not change


@dataclass(frozen=True)
class Study(ABC):
    """A scene, its last stage without the items of a plan, and its load cases."""

    scene: JointScene
    bare: JointScene
    cases: LoadCases
    form: Form
    key: str = field(default_factory=lambda: uuid4().hex, kw_only=True)

    @property
    def identity(self) -> dict[str, Any]:
        """The facts that decide the outcome of a plan."""
        return {
            "scene_key": self.scene.key,
            "effects_code": fingerprint(code_of(self.scene.effects)),
            "cases_key": self.cases.content_key,
            "cases": self.cases.count,
            "form": self.form,
            "rivetbench_version": installed_version("rivetbench"),
        }

    def bare_stage(self, part: JointScene, plan: Plan) -> tuple[JointScene, Plan]:
        """The scene of a stage without items, and the items that act in it."""
        return part, plan

    @abstractmethod
    def effect(self, item: Place) -> Effect:
        """The effect of an item."""

    def further(self, answer: "CaseAnswer") -> tuple[float, ...]:
        """More figures of a case."""
        return ()


@dataclass(frozen=True)
class FastenerStudy(Study):
    """Some stages have the fasteners."""

    fastener: Fasteners

    @classmethod
    def of(cls, movable: MovableFasteners, cases: LoadCases, form: Form) -> "FastenerStudy":
        return cls(movable.scene, movable.bare, cases, form, movable.fastener)

    def bare_stage(self, part: JointScene, plan: Plan) -> tuple[JointScene, Plan]:
        return without_fasteners(part), plan if any(part.effects_of(Fasteners)) else ()

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

    def answered(self, session: "PlanSession") -> list["Outcome"]:
        """The outcome of each plan."""
        return session.answer(self)


@dataclass(frozen=True)
class Outcome:
    """The gaps y of a plan, one entry per case.

    largest : the largest gap, mm; of a proven answer an upper bound on it. contact : where it is. mean :
    (Σ y⁸ / m)^⅛, mm. further : see `Study.further`. plan : that of a question which searches for one.
    """

    largest: tuple[float, ...]
    contact: tuple[int, ...]
    mean: tuple[float, ...]
    further: tuple[tuple[float, ...], ...] = ()
    plan: Plan = ()


class ItemSession(StiffnessSession):
    """Stages with the same K, and what items and springs change in them. scene : one of these stages."""

    def __init__(self, study: Study, scene: JointScene) -> None:
        super().__init__(scene, study.form)
        self.study = study
        self.columns: dict[Place, tuple[Vector, Vector, Vector]] = {}
        self.of_springs: dict[bytes, tuple[Matrix, Matrix]] = {}

    @cached_property
    def sensitivities(self) -> list[Vector]:
        """The sensitivities of superelement stresses; see `harness.scene.stress.sensitivities`."""
        return sensitivities(self.study.bare, self.proof)

    def column(self, item: Place) -> tuple[Vector, Vector, Vector]:
        """f_z (n,) N, g_z and u_z (m,) mm."""
        if item not in self.columns:
            load = load_case(self.scene, self.study.form, [self.study.effect(item)])
            self.columns[item] = load.f, load.g, self.data.overlap(load) if load.f.any() else -load.g
        return self.columns[item]

    def springs(self, T: sp.csc_array) -> tuple[Matrix, Matrix]:
        """K⁻¹T (n, r) and AᵀK⁻¹T (m, r), mm/N, of directions at the junction."""
        key = T.indices.tobytes() + T.data.tobytes()
        if key not in self.of_springs:
            x = self.data.assembly.K.solve(self.data.assembly.from_junction(T.toarray()))
            self.of_springs[key] = x, self.data.assembly.A.T @ x
        return self.of_springs[key]


@dataclass(eq=False)
class StageAnswers:
    """The answers to load cases of one stage, made when they are needed.

    approaches : of its springs, (r, k) mm. tolerance : TOLERANCE_MM if these are to be proven. near : those
    of another plan in each case, from which these are estimated. locks : whether fasteners have locked what
    these have reached.
    """

    session: ItemSession
    loads: list[DualLoadCase]
    approaches: Matrix
    tolerance: float
    near: "StageAnswers | None" = None
    locks: bool = False

    @cached_property
    def cases(self) -> list[Case]:
        starts = self.near.cases * (len(self.loads) // len(self.near.cases)) if self.near else ()
        return self.session.sweeps.together(self.loads, self.tolerance, starts)

    @cached_property
    def vectors(self) -> tuple[Matrix, Matrix]:
        """λ (m, k) N and the gaps (m, k) mm."""
        lams, gaps = zip(*map(self.session.sweeps.vectors, self.cases), strict=True)
        return np.column_stack(lams), np.column_stack(gaps)

    @cached_property
    def proven(self) -> list[Assessment]:
        lams = list(self.vectors[0].T)
        return assess(self.session.proof, self.loads, lams, [None] * len(lams), ENOUGH_MM)

    def elongations(self, T: sp.csc_array) -> Matrix:
        """Tᵀx (r, k) mm: of the proven answers x, or estimated as (K⁻¹T)ᵀf − (AᵀK⁻¹T)ᵀλ, which rounding moves
        as far as K is ill-conditioned.
        """
        self.locks = True
        if self.tolerance <= TOLERANCE_MM:
            proven = np.column_stack([answer.x for answer in self.proven])
            return np.asarray(T.T @ self.session.data.assembly.at_junction(proven))
        x, overlap = self.session.springs(T)
        return x.T @ np.column_stack([load.f for load in self.loads]) - overlap.T @ self.vectors[0]


@dataclass(frozen=True)
class CaseAnswer:
    """The answer to a case after the last stage.

    number : of the case. approaches : locked by the springs of the last stage, (r,) mm. lam : (m,) N. gap :
    (m,) mm, no less than it can be. x : makes (n,) mm. bound_mm : proven error of x, 0 of an estimate.
    """

    session: ItemSession
    number: int
    approaches: Vector
    load: DualLoadCase
    lam: Vector
    gap: Vector
    x: Callable[[], Vector]
    bound_mm: float

    @property
    def scene(self) -> JointScene:
        """The scene of this case without items and stages."""
        study = self.session.study
        part = locked(study.bare, self.approaches)
        return study.cases.scene_of(self.number, part) or part


class PlanSession:
    """Answers questions of one study; its matrices are made once. last : of the last stage. cases : those of
    the study, or of the question.
    """

    def __init__(self, study: Study) -> None:
        threadpoolctl.threadpool_limits(THREADS)
        self.study, self.cases = study, study.cases
        self.stages = OpenStages(study.bare, study.form, partial(ItemSession, study))
        self.last, self.scene = self.stages.of(study.bare).session, study.cases.staged(study.scene)
        self.loads: dict[tuple[OpenStage[ItemSession], int], DualLoadCase] = {}
        self.starts = lru_cache(4)(lambda plan, numbers: self.answers([plan], numbers, ESTIMATE_MM))
        self.block = min(BLOCK, max(BLOCK_BYTES // (8 * self.last.data.assembly.n), 1))

    def answer(self, question: Question) -> list[Outcome]:
        """The outcome of each plan, the same to the last bit whatever was answered before."""
        plans, cases = question.plans, question.cases
        starts = [] if question.base is None else self.starts(question.base, cases)
        size = max(self.block // len(cases), 1)
        blocks = (self._outcomes(plans[k : k + size], cases, starts) for k in range(0, len(plans), size))
        return [outcome for block in blocks for outcome in block]

    def largest_gap(self, numbers: Sequence[int]) -> Vector:
        """An estimate of the largest gap in any of some cases without items, (m,) mm."""
        blocks = (numbers[k : k + self.block] for k in range(0, len(numbers), self.block))
        gaps = (self.answers([()], block, ESTIMATE_MM)[-1].vectors[1] for block in blocks)
        return np.array([gap.max(axis=1) for gap in gaps]).max(axis=0)

    def _outcomes(
        self, plans: Sequence[Plan], numbers: tuple[int, ...], starts: list[StageAnswers]
    ) -> Iterator[Outcome]:
        """starts : one for each stage of estimates; none: they are proven."""
        stages = self.answers(plans, numbers, ESTIMATE_MM if starts else TOLERANCE_MM, starts)
        last, data, errors = stages[-1], self.last.data, np.zeros(len(plans) * len(numbers))
        lams, gaps = last.vectors
        if starts:
            xs = [partial(data.recover, *pair) for pair in zip(lams.T, last.loads, strict=True)]
            bounds = [0.0] * len(xs)
        else:
            errors = self._errors(stages)
            xs = [partial(np.asarray, answer.x) for answer in last.proven]
            gaps, bounds = np.column_stack([a.gap for a in last.proven]), [a.bound_mm for a in last.proven]
        largest, at = (gaps.max(axis=0) + errors).tolist(), gaps.argmax(axis=0).tolist()
        mean = ((np.maximum(gaps, 0.0) ** POWER).mean(axis=0) ** (1 / POWER)).tolist()
        shared = numbers * len(plans), last.approaches.T, last.loads, lams.T, (gaps + errors).T, xs, bounds
        answers = (CaseAnswer(last.session, *of_case) for of_case in zip(*shared, strict=True))
        further = list(map(self.study.further, answers))
        for start in range(0, len(largest), len(numbers)):
            own = slice(start, start + len(numbers))
            figures = tuple(largest[own]), tuple(at[own]), tuple(mean[own])
            yield Outcome(*figures, tuple(filter(None, further[own])))

    @staticmethod
    def _errors(stages: list[StageAnswers]) -> Vector:
        """(k,) how far the largest gap of the last stage may be off, mm: infinitely if a stage in which
        fasteners lock is not proven to within the limit.
        """
        last = stages[-1]
        pairs = zip(last.loads, last.proven, strict=True)
        errors = [last.session.gap_error(b.g, a.x, a.bound_mm).max(initial=0.0) for b, a in pairs]
        bounds = [[answer.bound_mm for answer in one.proven] for one in stages if one.locks]
        return np.where((np.array(bounds).reshape(-1, len(errors)) > LIMIT_MM).any(axis=0), np.inf, errors)

    def answers(
        self,
        plans: Sequence[Plan],
        numbers: Sequence[int],
        tolerance: float,
        starts: Sequence[StageAnswers] = (),
    ) -> list[StageAnswers]:
        """The answers in each problem of `through`, all cases of the first plan, all of the second, …; the
        last ones are those of the last stage.
        """
        made: list[StageAnswers] = []

        def solve(part: JointScene, approaches: Matrix) -> tuple[Elongations, None]:
            session, loads = self._loads(part, plans, numbers, approaches)
            near = starts[len(made)] if starts else None
            made.append(StageAnswers(session, loads, approaches, tolerance, near))
            return made[-1].elongations, None

        for _ in through(self.scene, solve, len(plans) * len(numbers)):
            pass
        return made

    def _loads(
        self, part: JointScene, plans: Sequence[Plan], numbers: Sequence[int], approaches: Matrix
    ) -> tuple[ItemSession, list[DualLoadCase]]:
        """The load cases in a stage, a scene whose springs have approaches (r, k) mm, and the session."""
        bares, items = zip(*(self.study.bare_stage(part, plan) for plan in plans), strict=True)
        stage = self.stages.of(bares[0])
        session, K = stage.session, stage.session.data.assembly
        if new := [k for k in numbers if (stage, k) not in self.loads]:
            of_stage = StageCases(self.cases, stage)
            made = session.data.with_p([of_stage.load(k) for k in new])
            self.loads |= {(stage, k): load for k, load in zip(new, made, strict=True)}
            self._forget(set(numbers))
        locking, overlap = stage.locking(K, approaches), np.zeros((K.m, approaches.shape[1]))
        if stage.springs:
            overlap = session.springs(stage.springs.T)[1] @ (stage.springs.k[:, None] * approaches)
        loads, columns = list[DualLoadCase](), zip(locking.T, overlap.T, strict=True)
        for some in items:
            f, (g, u) = np.zeros(K.n), np.zeros((2, K.m))
            for item in some:
                force, gap, change = session.column(item)
                f, g, u = f + force, g + gap, u + change
            for k, (of_springs, p) in zip(numbers, columns, strict=False):
                load = self.loads[stage, k]
                loads.append(DualLoadCase(load.f + f + of_springs, load.g + g, load.p + (u + p)))
        return session, loads

    def _forget(self, needed: set[int]) -> None:
        """Drop load cases beyond LOADS_BYTES, the oldest first, but none of these numbers."""
        counted, size = set[int](), 0  # cases may share f
        for (stage, k), load in [*reversed(self.loads.items())]:
            new = [array for array in (load.f, load.g, load.p) if id(array) not in counted]
            counted.update(map(id, new))
            size += sum(array.nbytes for array in new)
            if size > LOADS_BYTES and k not in needed:
                del self.loads[stage, k]


_sessions: dict[str, PlanSession] = {}  # the only one of this process, so that it opens the assembly once


@in_turn
def answer(task: tuple[Study, Question]) -> list[Outcome]:
    """Answer a question in the session that this process keeps for its study."""
    study, question = task
    if study.key not in _sessions:
        _sessions.clear()
        _sessions[study.key] = PlanSession(study)
    session = _sessions[study.key]
    session.cases = study.cases  # those of this question
    return question.answered(session)
