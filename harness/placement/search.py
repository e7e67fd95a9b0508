"""The fewest fasteners that keep a gap, or the best of a number: removal one by one, then exchange.

The gap G(S) of a plan S is the least that all load cases but the ⌊(1 − share) K⌋ worst of K keep. It is not
monotone: a fastener may open a gap elsewhere. Plans are compared by

    φ(S) = (max(G, limit), mean over the cases of (Σ y⁸ / m)^⅛),

estimated on the cases that decide about G: twice the number that may fail and 8 more, the worst of the plan
before. Their G is never above that of all. Each plan that is kept is then solved in all cases, and proven.

Removal takes out the fastener without which φ is least, or an eighth of the plan, those without which it is
least one by one, as long as the limit is kept. What removing one costs grows, as a rule, with each other that
is gone, so that values of earlier steps are tried in their order until none can be less (the lazy greedy
method: Minoux, Optimization Techniques, 234–243, 1978).

Exchange moves a fastener to one of the free holes next to where the gap is too large: one of the nearest, or
of those that are needed least. The best move is made as long as it makes φ less.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from harness.placement.candidates import Place, Plan
from harness.placement.session import Outcome, Question
from problems.forms.assembly import Matrix

Ask: TypeAlias = Callable[[Sequence[Question]], list[Outcome]]
Value: TypeAlias = tuple[float, float]

BLOCK = 50  # cases that are solved together
MORE_CASES = 8  # than twice those that may fail, in an estimate
AT_ONCE = 8  # plans that are tried together
SHARE_AT_ONCE = 8  # a plan's share that is taken out at once, as long as that keeps the limit
NONE = (0.0, 0.0)  # less than any φ
HOLES, NEAREST, LEAST = 3, 3, 3  # of an exchange: holes, fasteners near each, fasteners needed least
FURTHER = 1.25  # times what is enough: how far removal goes on
DIGITS = 6  # of mm: values closer than a nanometre are equal, whatever the rounding


@dataclass(frozen=True)
class Step:
    """A plan, its gap G, proven, mm, and its outcome in each case. moved : how it came about."""

    plan: Plan
    gap_mm: float
    outcome: Outcome
    moved: str = ""

    @property
    def worst(self) -> int:
        """The case with the largest gap."""
        return max(range(len(self.outcome.largest)), key=lambda k: self.outcome.largest[k])


class Search:
    """ask : answers questions. contacts : (m, 2) their places, mm. cases : K. allowed : ⌊(1 − share) K⌋.

    said : told of each plan that is kept.
    """

    def __init__(
        self,
        ask: Ask,
        contacts: Matrix,
        cases: int,
        allowed: int,
        limit_mm: float,
        said: Callable[[Step], None] = lambda step: None,
    ) -> None:
        self.ask, self.contacts, self.cases = ask, contacts, cases
        self.allowed, self.limit_mm, self.said = allowed, limit_mm, said

    def gap(self, outcome: Outcome) -> float:
        """G, mm, of all cases, or of those in the outcome."""
        return sorted(outcome.largest, reverse=True)[self.allowed]

    def whole(self, plan: Plan, moved: str = "") -> Step:
        """A plan in all cases, proven."""
        return self.wholes([plan], moved)[0]

    def wholes(self, plans: Sequence[Plan], moved: str = "") -> list[Step]:
        starts = range(0, self.cases, BLOCK)
        blocks = [tuple(range(start, min(start + BLOCK, self.cases))) for start in starts]
        found = iter(self.ask([Question(plan, block) for plan in plans for block in blocks]))
        steps = []
        for plan in plans:
            parts = [next(found) for _ in blocks]
            outcome = Outcome(*(tuple(v for p in parts for v in getattr(p, name)) for name in FIELDS))
            steps.append(Step(plan, self.gap(outcome), outcome, moved))
            self.said(steps[-1])
        return steps

    def fewest(self, start: Step, candidates: Plan, enough_mm: float) -> tuple[Step, list[Step]]:
        """The smallest plan found whose gap is enough, as that of `start` is, and every plan on the way."""
        best, steps, before = start, list[Step](), dict[Place, Value]()
        while (count := len(best.plan) // SHARE_AT_ONCE) > 1:
            steps.append(step := self._without_least(best, before, count))
            if step.gap_mm > enough_mm:
                break
            best = step
        for step in self.removal(best, before):
            steps.append(step)
            if step.gap_mm <= enough_mm:
                best = step
            elif step.gap_mm > FURTHER * enough_mm:
                break
        while best.plan:
            fewer = self.exchanged(next(self.removal(best)), candidates, enough_mm)
            if fewer.gap_mm > enough_mm:
                break
            steps.append(best := fewer)
        return best, steps

    def removal(self, step: Step, before: dict[Place, Value] | None = None) -> Iterator[Step]:
        """The plans with one fastener less each. before : values of earlier steps."""
        before = {} if before is None else before
        while step.plan:
            yield (step := self._without_least(step, before, 1))

    def _without_least(self, step: Step, before: dict[Place, Value], count: int) -> Step:
        """Without the fasteners that are needed least."""
        fresh = self._harm(step, before, count)
        before |= fresh
        gone = sorted(fresh, key=lambda place: (fresh[place], place))[:count]
        return self.whole(tuple(place for place in step.plan if place not in gone), "removal")

    def _harm(self, step: Step, before: dict[Place, Value], count: int) -> dict[Place, Value]:
        """φ of the plan without one of its fasteners: of those that may be the `count` least."""
        fresh: dict[Place, Value] = {}
        waiting = sorted(step.plan, key=lambda place: (before.get(place, NONE), place))
        while waiting:
            if len(fresh) >= count and sorted(fresh.values())[count - 1] <= before.get(waiting[0], NONE):
                break
            some, waiting = waiting[:AT_ONCE], waiting[AT_ONCE:]
            fresh |= dict(
                zip(some, self._values(step, [without(step.plan, each) for each in some]), strict=True)
            )
        return fresh

    def exchanged(self, step: Step, candidates: Plan, enough_mm: float) -> Step:
        """The plan after the best moves, until its gap is at most enough_mm or no move makes φ less."""
        while step.gap_mm > enough_mm:
            moves = self._moves(step, candidates)
            (own, *values) = self._values(step, [step.plan, *moves])
            best = min(range(len(moves)), key=lambda k: (values[k], moves[k]), default=None)
            if best is None or values[best] >= own:
                break
            after = self.whole(moves[best], "exchange")
            if after.gap_mm >= step.gap_mm:  # as all cases show
                break
            step = after
        return step

    def _moves(self, step: Step, candidates: Plan) -> list[Plan]:
        """Plans with one fastener moved to a free hole."""
        free = [place for place in candidates if place not in step.plan]
        if not (free and step.plan):
            return []
        harm = self._harm(step, {}, LEAST)
        least = sorted(harm, key=lambda place: (harm[place], place))[:LEAST]
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

    def _values(self, step: Step, plans: Sequence[Plan]) -> list[Value]:
        """φ of other plans, estimated."""
        cases = self._deciding(step)
        found = self.ask([Question(plan, cases, step.plan) for plan in plans])
        return [
            (round(max(self.gap(each), self.limit_mm), DIGITS), round(float(np.mean(each.mean)), DIGITS))
            for each in found
        ]


FIELDS = ("largest", "contact", "mean")


def without(plan: Plan, gone: Place) -> Plan:
    return tuple(place for place in plan if place != gone)


def nearest(places: Sequence[Place], to: Place | Matrix, count: int) -> list[Place]:
    """Those of the places that are nearest, the nearest first."""
    return sorted(places, key=lambda place: ((place[0] - to[0]) ** 2 + (place[1] - to[1]) ** 2, place))[
        :count
    ]
