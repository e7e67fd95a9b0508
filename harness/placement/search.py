"""The fewest fasteners that keep a gap, or the best of a number: removal one by one, then exchange.

The gap G(S) of a plan S is the least that all load cases but the worst keep, as many as may fail of K (see
fresh_cases.py). It is not monotone: a fastener may open a gap elsewhere. Plans are compared by

    φ(S) = (max(G, limit), mean over the cases of (Σ y⁸ / m)^⅛),

estimated on the cases that decide about G: twice the number that may fail and 8 more, the worst of the plan
before. Their G is never above that of all. Each plan that is kept is then solved in all cases, and proven.

Removal takes out the fastener without which φ is least, or an eighth of the plan, those without which it is
least one by one, no two next to each other, as long as the limit is kept. What removing one costs grows, as
a rule, with each other that is gone, so that values of earlier steps are tried in their order until none can
be less (the lazy greedy method: Minoux, Optimization Techniques, 234–243, 1978).

Exchange moves a fastener to one of the free holes next to where the gap is too large: one of the nearest, or
of those that are needed least. The best move is made as long as it makes φ less. Of the plan without the
fastener that is needed least and uniform ones of as many, it starts from the one of least G. Where there are
few plans of a number of fasteners, all of them are compared instead. Where a number of FEW or less is asked
for, it starts from each.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import combinations
from math import comb, dist
from typing import TypeAlias

import numpy as np

from harness.placement.candidates import Place, Plan, uniform_plans
from harness.placement.session import Outcome, Question
from problems.forms.assembly import Matrix
from problems.model.scene import JointScene
from problems.reporter import SILENT, Reporter
from report.document.numbers import counted

Ask: TypeAlias = Callable[[Sequence[Question]], list[list[Outcome]]]
Value: TypeAlias = tuple[float, float]
Values: TypeAlias = dict[Place, Value]

TOGETHER, ESTIMATED = 50, 14  # cases of two questions, at most; of estimates
MORE_CASES = 8  # than twice those that may fail, in an estimate: of fewer, a plan's worst may be new ones
AT_ONCE = 8  # plans that are tried together
NONE = (0.0, 0.0)  # less than any φ
HOLES, NEAREST, LEAST = 3, 3, 3  # of an exchange: holes, fasteners near each, fasteners needed least
SHARE_AT_ONCE = 8  # a plan's share that is taken out at once, as long as that keeps the limit
NEXT = 3  # a fastener and those next to it
FEW = 3  # fasteners, for whose number exchange starts from every plan
PLANS = 300  # that are all compared; after a removal half as many
FURTHER = 1.25  # times what is enough: how far removal goes on
DIGITS = 6  # of mm: values closer than a nanometre are equal, whatever the rounding


@dataclass(frozen=True)
class Step:
    """A plan, its gap G, proven, mm, and its outcome in each case. moved : how it came about."""

    plan: Plan
    gap_mm: float
    outcome: Outcome
    moved: str = ""

    def order(self) -> tuple[float, Plan]:
        """The least gap first."""
        return round(self.gap_mm, DIGITS), self.plan

    @property
    def worst(self) -> int:
        """The case with the largest gap."""
        return max(range(len(self.outcome.largest)), key=lambda k: self.outcome.largest[k])


@dataclass
class Search:
    """ask : answers questions. bare : the scene without fasteners. contacts : (m, 2) their places, mm.
    cases : K. allowed : how many may fail. reporter : is told each plan that is kept.
    """

    ask: Ask
    bare: JointScene
    contacts: Matrix
    candidates: Plan
    cases: int
    allowed: int
    limit_mm: float
    reporter: Reporter = SILENT
    proven: Iterator[int] = field(default_factory=lambda: itertools.count(1))

    def gap(self, outcome: Outcome) -> float:
        """G, mm, of all cases, or of those in the outcome."""
        return sorted(outcome.largest, reverse=True)[self.allowed]

    def among(self, numbers: Sequence[int], allowed: int) -> Search:
        """The search among the load cases of these numbers, which are its cases 0, 1, …"""

        def ask(questions: Sequence[Question]) -> list[list[Outcome]]:
            return self.ask([replace(q, cases=tuple(numbers[k] for k in q.cases)) for q in questions])

        return replace(self, ask=ask, cases=len(numbers), allowed=allowed)

    def whole(self, plan: Plan, moved: str = "") -> Step:
        """A plan in all cases, proven."""
        return self.wholes([plan], moved)[0]

    def wholes(self, plans: Sequence[Plan], moved: str = "") -> list[Step]:
        found = zip(plans, self._left(plans, range(self.cases), TOGETHER), strict=True)
        steps = [Step(plan, self.gap(outcome), outcome, moved) for plan, outcome in found]
        for step in steps:
            proven = counted(next(self.proven), "plan")
            words = f"{counted(len(step.plan), 'fastener')}, {step.moved}: {step.gap_mm:.3g} mm"
            self.reporter.progress(f"{words} ({proven} proven)")
        return steps

    def _left(
        self, plans: Sequence[Plan], cases: Sequence[int], most: int, base: Plan | None = None
    ) -> list[Outcome]:
        """Of each plan, asked in parts of the cases, which share no solution: in pairs, for two workers."""
        parts = [tuple(part.tolist()) for part in np.array_split(cases, 2 * -(-len(cases) // most))]
        found = self.ask([Question(tuple(plans), part, base) for part in parts if part])
        names = [each.name for each in fields(Outcome)]
        return [
            Outcome(*(tuple(v for part in each for v in getattr(part, name)) for name in names))
            for each in zip(*found, strict=True)
        ]

    def even(self, count: int) -> list[Plan]:
        """The holes nearest to uniform patterns of so many fasteners."""
        return list(dict.fromkeys(onto(plan, self.candidates) for plan in uniform_plans(self.bare, count)))

    def fewest(self, start: Step) -> tuple[Step, list[Step]]:
        """The smallest plan found that keeps the limit, as `start`, all candidates, does; all on the way."""
        best, steps, before = start, list[Step](), Values()
        while (count := len(best.plan) // SHARE_AT_ONCE) > 1:
            steps.append(step := self._without_least(best, before, count))
            if step.gap_mm > self.limit_mm:
                break
            best = step
        known = dict(before)
        for step in self.removal(best, before):
            steps.append(step)
            if step.gap_mm <= self.limit_mm:
                best, known = step, dict(before)
            elif step.gap_mm > FURTHER * self.limit_mm:
                break
        while best.plan:
            fewer, known = self.fewer(best, known)
            if fewer.gap_mm > self.limit_mm:
                break
            steps.append(best := fewer)
        return best, steps

    def fewer(self, step: Step, before: Values, every: bool = False) -> tuple[Step, Values]:
        """The best that exchange makes of plans with one fastener less, or of all of them, if they are few;
        and the values on its way. every : whether it starts from all these plans, not from the best alone.
        """
        if comb(len(self.candidates), len(step.plan) - 1) <= PLANS // 2:
            return self.best_of_all(step, len(step.plan) - 1), {}
        starts: dict[Plan, Values] = {plan: {} for plan in self.even(len(step.plan) - 1)}
        starts[without(step.plan, self._least(step, before, 1)[0])] = before
        found = sorted(self.wholes(list(starts), "exchange"), key=Step.order)
        tried = [self.exchanged(start, starts[start.plan]) for start in (found if every else found[:1])]
        return min(tried, key=Step.order), starts[found[0].plan]

    def best_of_all(self, step: Step, count: int) -> Step:
        """The plan of least G of all with so many fasteners. step : the base of the first estimates.

        Estimates are never above G: plans are solved in the order of theirs, until no other can have less.
        """
        plans = list(combinations(self.candidates, count))
        left = dict(zip(plans, self._values(step, plans), strict=True))
        solved: list[Step] = []
        while left:
            del left[plan := min(left, key=lambda each: (left[each], each))]
            solved.append(self.whole(plan, "exchange"))
            least = min(step.gap_mm for step in solved)
            left = {plan: value for plan, value in left.items() if value[0] < max(least, self.limit_mm)}
            renewed = self._values(solved[-1], list(left))
            left = {plan: max(pair) for plan, *pair in zip(left, left.values(), renewed, strict=True)}
        return min(solved, key=Step.order)

    def removal(self, step: Step, before: Values) -> Iterator[Step]:
        """The plans with one fastener less each. before : values of earlier steps."""
        while step.plan:
            yield (step := self._without_least(step, before, 1))

    def _without_least(self, step: Step, before: Values, count: int) -> Step:
        """Without the fasteners that are needed least; of those next to each other, without one."""
        gone: list[Place] = []
        for place in self._least(step, before, count):
            if not set(nearest(step.plan, place, NEXT)).intersection(gone):
                gone.append(place)
        return self.whole(tuple(place for place in step.plan if place not in gone), "removal")

    def _least(self, step: Step, before: Values, count: int) -> list[Place]:
        """The `count` fasteners without one of which φ is least. before : earlier values, renewed."""
        fresh: Values = {}
        waiting = sorted(step.plan, key=lambda place: (before.get(place, NONE), place))
        while waiting:
            if len(fresh) >= count and sorted(fresh.values())[count - 1] <= before.get(waiting[0], NONE):
                break
            some, waiting = waiting[:AT_ONCE], waiting[AT_ONCE:]
            values = self._values(step, [without(step.plan, each) for each in some])
            fresh |= dict(zip(some, values, strict=True))
        before |= fresh
        return sorted(fresh, key=lambda place: (fresh[place], place))[:count]

    def exchanged(self, step: Step, before: Values) -> Step:
        """The plan after the best moves, until it keeps the limit or no move makes φ less. The worst cases of
        a move that was none decide about the next ones, too.
        """
        cases = self._deciding(step)
        while step.gap_mm > self.limit_mm:
            moves = self._moves(step, before)
            (own, *values) = self._values(step, [step.plan, *moves], cases)
            best = min(range(len(moves)), key=lambda k: (values[k], moves[k]), default=None)
            if best is None or values[best] >= own:
                break
            after = self.whole(moves[best], "exchange")
            if after.gap_mm < step.gap_mm:
                step, cases = after, self._deciding(after)
            elif set(more := self._deciding(after)) <= set(cases):
                break
            else:
                cases = tuple(sorted({*cases, *more}))
        return step

    def _moves(self, step: Step, before: Values) -> list[Plan]:
        """Plans with one fastener moved to a free hole."""
        free = [place for place in self.candidates if place not in step.plan]
        if not (free and step.plan):
            return []
        least = self._least(step, before, LEAST)
        places = [self.contacts[step.outcome.contact[k]] for k in self._deciding(step)]
        holes = Counter(nearest(free, place, 1)[0] for place in places)
        moves = {
            plan: None
            for hole, _ in sorted(holes.items(), key=lambda item: (-item[1], item[0]))[:HOLES]
            for gone in dict.fromkeys([*nearest(step.plan, hole, NEAREST), *least])
            for plan in [tuple(sorted((*without(step.plan, gone), hole)))]
        }
        return list(moves)

    def _deciding(self, step: Step) -> tuple[int, ...]:
        """The worst cases of a plan, in order of their number."""
        worst = sorted(range(self.cases), key=lambda k: (-round(step.outcome.largest[k], DIGITS), k))
        return tuple(sorted(worst[: 2 * self.allowed + MORE_CASES]))

    def _values(self, step: Step, plans: Sequence[Plan], cases: tuple[int, ...] = ()) -> list[Value]:
        """φ of other plans, estimated. cases : those that decide, unless given."""
        found = self._left(plans, cases or self._deciding(step), ESTIMATED, step.plan)
        return [
            (round(max(self.gap(each), self.limit_mm), DIGITS), round(float(np.mean(each.mean)), DIGITS))
            for each in found
        ]


def without(plan: Plan, gone: Place) -> Plan:
    return tuple(place for place in plan if place != gone)


def onto(plan: Plan, candidates: Plan) -> Plan:
    """Each of the plan's fasteners in the nearest hole that is free."""
    free = list(candidates)
    for place in plan:
        free.remove(nearest(free, place, 1)[0])
    return tuple(place for place in candidates if place not in free)


def nearest(places: Sequence[Place], to: Place | Matrix, count: int) -> list[Place]:
    """Those of the places that are nearest, the nearest first."""
    return sorted(places, key=lambda place: (dist(place, to), place))[:count]
