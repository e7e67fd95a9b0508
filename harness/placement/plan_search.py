"""The base of searches for a plan: outcomes in all load cases or in some, proven plans, their worst cases."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar, Self, TypeAlias

import numpy as np

from harness.placement.candidates import Plan
from harness.placement.session import Outcome, Question
from problems.reporter import SILENT, Reporter
from report.document.numbers import beside, counted, raised

Ask: TypeAlias = Callable[[Sequence[Question]], list[list[Outcome]]]

TOGETHER, ESTIMATED = 50, 14  # most cases in two questions, proven and estimated
MORE_CASES = 8  # of an estimate, beyond twice those that may fail: with fewer, a plan's worst may be others
DIGITS = 6  # of mm: values closer than a nanometre are equal, whatever the rounding


@dataclass(frozen=True)
class Step:
    """A plan with its proven gap G, mm, and its outcome in each case. moved : how it came about."""

    plan: Plan
    gap_mm: float
    outcome: Outcome
    moved: str = ""

    def sort_key(self) -> tuple[float, Plan]:
        """The key by which plans are sorted: the least gap first."""
        return round(self.gap_mm, DIGITS), self.plan

    @property
    def worst(self) -> int:
        """The case with the largest gap."""
        return max(range(len(self.outcome.largest)), key=lambda k: self.outcome.largest[k])


@dataclass
class PlanSearch(ABC):
    """Searches among plans of some items.

    ask : answers questions. cases : K, the number of load cases. allowed : how many of them may fail.
    reporter : is told each plan that is kept.
    """

    item: ClassVar[str]  # its name
    ask: Ask
    cases: int
    allowed: int
    limit_mm: float
    reporter: Reporter = field(default=SILENT, kw_only=True)
    proven: Iterator[int] = field(default_factory=lambda: itertools.count(1), kw_only=True)

    @abstractmethod
    def once(self, current: Plan, count: int | None) -> tuple[list[Step], Step]:
        """All plans kept, and the best. current : the scene's own. count : of its items; None: the fewest."""

    def used(self, step: Step) -> str:
        """How much a plan needs of the limits, in words."""
        return f"{beside(self.limit_mm, raised)(step.gap_mm)} mm"

    def order_of(self, best: Step) -> list[Step]:
        """The plans in the order of setting their items, the best last; by default the best alone."""
        return [best]

    def gap(self, outcome: Outcome) -> float:
        """G, mm, in the cases of the outcome."""
        return sorted(outcome.largest, reverse=True)[self.allowed]

    def among(self, numbers: Sequence[int], allowed: int) -> Self:
        """The search among the load cases of these numbers, which are its cases 0, 1, …"""

        def ask(questions: Sequence[Question]) -> list[list[Outcome]]:
            return self.ask([replace(q, cases=tuple(numbers[k] for k in q.cases)) for q in questions])

        return replace(self, ask=ask, cases=len(numbers), allowed=allowed)

    def whole(self, plan: Plan, moved: str = "") -> Step:
        """A plan solved in all cases, and proven."""
        return self.wholes([plan], moved)[0]

    def wholes(self, plans: Sequence[Plan], moved: str = "") -> list[Step]:
        outcomes = self.outcomes(plans, range(self.cases))
        steps = [
            Step(p, self.gap(outcome), outcome, moved) for p, outcome in zip(plans, outcomes, strict=True)
        ]
        for step in steps:
            proven = counted(next(self.proven), "plan")
            words = f"{counted(len(step.plan), self.item)}, {step.moved}: {self.used(step)}"
            self.reporter.progress(f"{words} ({proven} proven)")
        return steps

    def outcomes(
        self, plans: Sequence[Plan], cases: Sequence[int], base: Plan | None = None
    ) -> list[Outcome]:
        """The outcome of each plan, proven, or estimated from the base.

        The cases are asked in an even number of parts, for two workers.
        """
        most = TOGETHER if base is None else ESTIMATED
        parts = [tuple(part.tolist()) for part in np.array_split(cases, 2 * -(-len(cases) // most))]
        answers = self.ask([Question(tuple(plans), part, base) for part in parts if part])
        names = [field.name for field in fields(Outcome)]
        return [
            Outcome(*(tuple(v for part in of_plan for v in getattr(part, name)) for name in names))
            for of_plan in zip(*answers, strict=True)
        ]

    def value(self, outcome: Outcome) -> tuple[float, float]:
        """φ: max(G, limit) and the mean over the cases, mm, rounded."""
        mean = float(np.mean(outcome.mean))
        return round(max(self.gap(outcome), self.limit_mm), DIGITS), round(mean, DIGITS)

    def deciding(self, step: Step) -> tuple[int, ...]:
        """The worst cases of a plan, by their numbers."""
        return tuple(sorted(self.worst_first(step)[: 2 * self.allowed + MORE_CASES]))

    def worst_first(self, step: Step) -> list[int]:
        """The numbers of all cases, that in which a plan leaves most first."""
        return sorted(range(self.cases), key=lambda k: (-round(step.outcome.largest[k], DIGITS), k))
