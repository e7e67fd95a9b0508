"""The fewest shims from a stock that keep a limit on the gap, then the least of them.

A plan gives some patches a thickness t each, g −= t there; a tapered shim one at either end of its longer
side. A force in a fastener, or a stress, counts as a gap that takes the same share of its limit.

Growth starts without shims. Each patch whose gap y is too large gets the least thickness of the stock that is
at least t + y − limit, the contact problems are solved anew, and so on. A shim lowers the gap of its patch by
no more than it grows. So, if it never lowered that of another patch, no plan that keeps the limit would be
thinner anywhere than what growth ends in. But parts are levers: a shim may relieve its neighbours. So a plan
is also made by a walk, each time by the change of one shim for which (max(G, limit), mean of (Σ y⁸ / m)^⅛) is
least, G the gap that all cases but those that may fail keep. A walk goes on where a change does not help, but
never to a plan twice. From the better of both each shim in turn is taken out or made a step thinner, or all
are made thinner, and the others grow; the best that is better is proven, until there is none. Then a walk
among plans with fewer shims, and one among those of less cost, begin at the best. Plans are compared by their
number of shims, then by Σ t · area, and tried in this order: the first that is proven is the best.

All of this is estimated in the cases that decide about a plan: the worst ones but those that may fail, none
of which may fail in turn; in the end all of the worst, some of which may. A plan that keeps the limit in them
is proven in all cases. If it fails there, it grows further in the cases that are its own worst, or these join
those that decide.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heapify, heappop, heappush
from itertools import product
from math import inf
from typing import Self

import numpy as np

from harness.placement.candidates import Plan
from harness.placement.plan_search import DIGITS, MORE_CASES, PlanSearch, Step
from harness.placement.session import Outcome
from problems.forms.assembly import Matrix
from report.document.numbers import beside

from .study import ShimStudy

AT_ONCE = 8  # plans estimated together
WORST, NEAREST = 3, 4  # patches whose gap is to fall, and those near each whose shims change
IDLE = 4  # steps of a walk in succession that do not lower G
ALL = inf, inf  # more than any cost


@dataclass
class ShimSearch(PlanSearch):
    """Searches for shims of a stock.

    stock : the thicknesses, mm, ascending.
    """

    item = "shim"
    study: ShimStudy
    stock: Sequence[float]

    def outcomes(
        self, plans: Sequence[Plan], cases: Sequence[int], base: Plan | None = None
    ) -> list[Outcome]:
        def used(figures: Sequence[float]) -> float:
            shares = [value / limit for value, limit in zip(figures[-2:], self.study.limits, strict=True)]
            return max(*figures[: len(self.study.masks)], self.limit_mm * max(shares))

        made = super().outcomes(plans, cases, base)
        return [replace(one, largest=tuple(map(used, one.further))) for one in made]

    def used(self, step: Step) -> str:
        share = f"{beside(100.0)(100 * step.gap_mm / self.limit_mm)} % of the limits"
        return super().used(step) if min(self.study.limits) == inf else share

    def cost(self, plan: Plan) -> tuple[float, float]:
        volumes = (sum(t) / len(t) * self.study.patches[int(k)].area for k, *t in plan)
        return len(plan), round(sum(volumes), DIGITS)

    def sizes(self, plan: Plan) -> Matrix:
        """(patches, ends) the thicknesses, mm; 0 without a shim."""
        t = np.zeros((len(self.study.patches), self.study.ends))
        for k, *ends in plan:
            t[int(k)] = ends
        return t

    def plan(self, t: Matrix) -> Plan:
        """The plan of thicknesses; a shim has at least the least one at either end."""
        rows = ((k, *np.maximum(row, self.stock[0]).tolist()) for k, row in enumerate(t) if row.any())
        return tuple(rows)

    @property
    def strict(self) -> Self:
        """The search in which no case may fail."""
        return replace(self, allowed=0)

    def deciding(self, step: Step) -> tuple[int, ...]:
        """The worst cases of a plan but those that may fail, by their numbers."""
        return tuple(sorted(self.worst_first(step)[self.allowed :][:MORE_CASES]))

    def once(self, current: Plan, count: int | None = None) -> tuple[list[Step], Step]:
        """All plans kept, and the best; the first one, without shims, if no plan keeps the limit."""
        steps, kept = [self.whole((), "no shims")], list[Step]()
        if steps[0].gap_mm <= self.limit_mm:
            return steps, steps[0]
        cases = self.deciding(steps[0])
        for start in self._starts(cases):
            grown = next(self.strict.grown([(start, -1)], (), cases), ())
            below = self.cost(grown) if grown else ALL
            walked, keeps = self.strict.walked(start, below, cases)
            for plan in filter(None, (grown, walked if keeps or not grown else ())):
                steps += (way := self.proven_growth(plan))
                kept += way[-1:] if way[-1].gap_mm <= self.limit_mm else []
            if kept:
                break
        best = last = min(kept, key=lambda step: self.cost(step.plan), default=None)
        while best and (best := self.better(best)):
            steps.append(last := best)
        return steps, last or steps[0]

    def _starts(self, cases: Sequence[int]) -> Iterator[Plan]:
        """No shims; where nothing gets there from them, the best with one thickness everywhere."""
        yield ()
        plans = [self.plan(np.full_like(self.sizes(()), t)) for t in self.stock]
        outcomes = self.outcomes(plans, cases, ())
        yield min(zip([self.strict.value(one)[0] for one in outcomes], plans, strict=True))[1]

    def proven_growth(self, plan: Plan) -> list[Step]:
        """The plan, proven, and what it grows to, until that keeps the limit or cannot grow."""
        steps = [self.whole(plan, "growth")]
        while (step := steps[-1]).gap_mm > self.limit_mm:
            more = self.thicker(step.plan, step.outcome)
            grown = self.strict.grown([(more, -1)], step.plan, self.deciding(step)) if more else iter(())
            if not (plan := next(grown, ())):
                break
            steps.append(self.whole(plan, "growth"))
        return steps

    def walked(self, plan: Plan, below: tuple[float, float], cases: Sequence[int]) -> tuple[Plan, bool]:
        """The first plan of a walk among those that cost less which keeps the limit by estimates, or the best
        of the walk, and whether it keeps the limit. The walk takes the best change of one shim each time,
        whether it helps or not, but never to a plan twice; it ends after IDLE steps that did not lower G.
        """
        base, seen, idle = plan, {plan}, 0
        (outcome,) = self.outcomes([plan], cases, base)
        best = (inf, inf), plan
        while idle < IDLE:
            less = self.cost(plan) < below
            options = self._changes(plan, outcome) if less else [one for one, _ in self._fewer(plan)]
            options = [one for one in options if one not in seen and self.cost(one) < below]
            if not options:
                break
            made = self.outcomes(options, cases, base)
            values = [(self.value(one), option) for one, option in zip(made, options, strict=True)]
            k = values.index(min(values))
            outcome, plan = made[k], options[k]
            if self.gap(outcome) <= self.limit_mm:
                return plan, True
            seen.add(plan)
            idle = 0 if values[k][0][0] < best[0][0] else idle + 1
            best = min(best, values[k])
        return best[1], False

    def _changes(self, plan: Plan, outcome: Outcome) -> list[Plan]:
        """A thickness as large as a gap asks for or a step more, one less, or no shim, in a patch near
        one of those whose gap is the largest.
        """
        changed, t, excess = dict[Plan, None](), self.sizes(plan), self._excess(outcome)
        worst = np.argsort(-excess.max(axis=1), kind="stable")[:WORST]
        some = np.unique(self.study.near[worst, :NEAREST])
        for k, end in product(some.tolist(), range(self.study.ends)):
            now = float(t[k, end])
            options = [*self._enough(now, max(excess[k, end], 0.0))[:2], *self._thinner(now)]
            changed |= dict.fromkeys(self._with(t, k, end, option) for option in sorted(options))
        return list(changed)

    def _with(self, t: Matrix, k: int, end: int, option: float) -> Plan:
        """The plan with that thickness at an end of patch k; 0: without its shim."""
        t = t.copy()
        t[k, end if option else slice(None)] = option
        return self.plan(t)

    def better(self, step: Step) -> Step | None:
        """A better plan that is proven, if any: one in which the same cases fail, or else other ones."""
        cases, strict = self.deciding(step), self.strict
        better = self._descended(step, strict, cases)
        for below in ((len(step.plan), 0.0), self.cost(step.plan)):  # fewer shims, or thinner ones
            plan, keeps = ((), False) if better else strict.walked(step.plan, below, cases)
            if keeps and (other := self.whole(plan, "walk")).gap_mm <= self.limit_mm:
                better = other
        if better or not self.allowed:
            return better
        return self._descended(step, self, super().deciding(step))

    def _descended(self, step: Step, search: Self, cases: tuple[int, ...]) -> Step | None:
        """A better plan that is proven, if any, by one shim after another that is taken out or thinner, and
        by what others grow to: each time the cheapest by estimates.
        """
        refused, base = set[Plan](), step.plan
        while True:
            plan = cheaper = base
            while cheaper:
                plan = cheaper
                grown = search.grown(self._fewer(plan), base, cases, self.cost(plan))
                cheaper = next((one for one in grown if one not in refused), ())
            if plan == base:
                return None
            if (other := self.whole(plan, "descent")).gap_mm <= self.limit_mm:
                return other
            refused.add(plan)
            failing = {k for k in self.deciding(other) if other.outcome.largest[k] > self.limit_mm}
            cases = tuple(sorted({*cases, *failing}))

    def _fewer(self, plan: Plan) -> list[tuple[Plan, int]]:
        """Plans with a shim less or a step thinner, and the number of its patch; all a step thinner."""
        t = self.sizes(plan)
        thinner = np.array([max([self.stock[0], *self._thinner(now)]) for now in t.flat]).reshape(t.shape)
        fewer = [
            (self._with(t, k, end, option), k)
            for (k, end), now in np.ndenumerate(t)
            for option in self._thinner(now)
        ]
        return [*fewer, (self.plan(np.where(t, thinner, 0.0)), -1)]

    def grown(
        self,
        starts: list[tuple[Plan, int]],
        base: Plan,
        cases: Sequence[int],
        below: tuple[float, float] = ALL,
    ) -> Iterator[Plan]:
        """What plans grow to, each with the number of a patch that does not, if that keeps the limit by
        estimates and costs less; the cheapest first. base : see Question.
        """
        waiting = [entry for plan, held in starts if (entry := (self.cost(plan), plan, held))[0] < below]
        kept, seen = list[tuple[tuple[float, float], Plan]](), set(waiting)
        heapify(waiting)
        while waiting or kept:
            if kept and (not waiting or kept[0] < waiting[0][:2]):
                yield heappop(kept)[1]
                continue
            some = [heappop(waiting) for _ in waiting[:AT_ONCE]]
            outcomes = self.outcomes([plan for _, plan, _ in some], cases, base)
            for (cost, plan, held), outcome in zip(some, outcomes, strict=True):
                if self.gap(outcome) <= self.limit_mm:
                    if (cost, plan) not in kept:
                        heappush(kept, (cost, plan))
                elif more := self.thicker(plan, outcome, held):
                    entry = self.cost(more), more, held
                    if entry[0] < below and entry not in seen:
                        seen.add(entry)
                        heappush(waiting, entry)

    def thicker(self, plan: Plan, outcome: Outcome, held: int = -1) -> Plan:
        """The plan with what the gap of each patch asks for, or the thickest; empty if a patch has that
        already or is held, or if no gap asks.
        """
        t, excess = self.sizes(plan), self._excess(outcome)
        asking = excess > 0
        if not asking.any() or (held >= 0 and asking[held].any()) or (t[asking] == self.stock[-1]).any():
            return ()
        for at in zip(*np.nonzero(asking), strict=True):
            t[at] = [*self._enough(t[at], excess[at]), self.stock[-1]][0]
        return self.plan(t)

    def _excess(self, outcome: Outcome) -> Matrix:
        """(patches, ends) by how much the gap is too large, mm, in all cases but those that may fail."""
        order = sorted(range(len(outcome.largest)), key=lambda k: (outcome.largest[k], k))
        figures = np.array([outcome.further[k] for k in order[: len(order) - self.allowed]])
        start, shape = 2 * len(self.study.masks), self.sizes(()).shape
        return np.asarray(figures[:, start:-2].max(axis=0).reshape(shape) - self.limit_mm)

    def _enough(self, t: float, excess: float) -> list[float]:
        """The thicknesses of the stock above t that are not below t + excess."""
        return [s for s in self.stock if s > t and s >= round(t + excess, DIGITS)]

    def _thinner(self, t: float) -> list[float]:
        """No shim, and a step thinner than t."""
        lower = [0.0, *(s for s in self.stock if s < t)] if t else []
        return list(dict.fromkeys(lower[:1] + lower[-1:]))
