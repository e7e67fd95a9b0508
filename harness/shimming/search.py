"""The fewest shims from a stock that keep a limit on the gap, then the least of them.

A plan gives some patches a thickness t each: g −= t there. A force in a fastener, or a stress, counts as a
gap that takes the same share of its limit.

Growth starts without shims. Each patch whose gap y is too large gets the least thickness of the stock that is
at least t + y − limit, the contact problems are solved anew, and so on. A shim lowers the gap of its patch by
no more than it grows. So, if it never lowered that of another patch, no plan that keeps the limit would be
thinner anywhere than what growth ends in. But parts are levers: a shim may relieve its neighbours. So a plan
is also made shim by shim, each time by the change for which (max(G, limit), mean of (Σ y⁸ / m)^⅛) is least, G
the gap that all cases but those that may fail keep. From the better of both each shim in turn is taken out or
made a step thinner, and the others grow; the best that is better is proven, until there is none. Plans are
compared by their number of shims, then by Σ t · area.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np

from harness.placement.candidates import Place, Plan
from harness.placement.plan_search import DIGITS, ESTIMATED, PlanSearch, Step
from harness.placement.session import Outcome, Study
from harness.scene.stress import largest_of
from problems.effects.shims import Shims
from problems.forms.assembly import Assembly, Mask, Vector
from problems.model.fastener_forces import fastener_forces, force_error_per_mm
from problems.model.surface import surface_of

from .patches import Patch


@dataclass(frozen=True)
class ShimStudy(Study):
    """An item is the number of a patch and a thickness, mm. limits : of force, N, and stress, N/mm²."""

    patches: tuple[Patch, ...]
    limits: tuple[float, float]

    def effect(self, item: Place) -> Shims:
        return self.patches[int(item[0])].shim.model_copy(update={"thickness": item[1]})

    @cached_property
    def masks(self) -> list[Mask]:
        """The contacts of each patch, and those of none."""
        inside = [patch.shim.gap(self.bare.joint) < 0 for patch in self.patches]
        return [*inside, ~np.any(inside, axis=0)]

    @cached_property
    def areas(self) -> Vector:
        """(m,) of the contacts, mm²."""
        joint = self.bare.joint
        return np.concatenate([surface_of(joint.places(pair)).areas for pair in joint.pairs])

    def further(
        self, assembly: Assembly, gap: Vector, x: Callable[[], Vector], error_mm: float
    ) -> tuple[float, ...]:
        """In each patch and beyond them the largest gap, mm, and ∫ gap, mm³; force, N, and stress, N/mm², if
        they have a limit.
        """
        gaps = [float(gap[mask].max(initial=0.0)) for mask in self.masks]
        volumes = [float(np.maximum(gap[mask], 0.0) @ self.areas[mask]) for mask in self.masks]
        force = stress = 0.0
        if self.limits[0] < inf:
            at = assembly.at_junction(x())
            force = max(abs(fastener["force_N"]) for fastener in fastener_forces(self.bare, at))
            force += force_error_per_mm(self.bare) * error_mm
        if self.limits[1] < inf:
            stress = largest_of(self.bare, x())
        return *gaps, *volumes, force, stress


@dataclass
class ShimSearch(PlanSearch):
    """stock : the thicknesses, mm, ascending."""

    item = "shim"
    study: ShimStudy
    stock: Sequence[float]

    def outcomes(
        self, plans: Sequence[Plan], cases: Sequence[int], most: int, base: Plan | None = None
    ) -> list[Outcome]:
        def used(figures: Sequence[float]) -> float:
            shares = [value / limit for value, limit in zip(figures[-2:], self.study.limits, strict=True)]
            return max(*figures[: len(self.study.masks)], self.limit_mm * max(shares))

        made = super().outcomes(plans, cases, most, base)
        return [replace(one, largest=tuple(map(used, one.further))) for one in made]

    def used(self, step: Step) -> str:
        share = f"{step.gap_mm / self.limit_mm:.1%} of the limits"
        return super().used(step) if min(self.study.limits) == inf else share

    def cost(self, plan: Plan) -> tuple[float, float]:
        return len(plan), round(sum(t * self.study.patches[int(k)].area for k, t in plan), DIGITS)

    def once(self, current: Plan, count: int | None = None) -> tuple[list[Step], Step]:
        """All plans kept, and the best; the first one, without shims, if no plan keeps the limit."""
        steps, kept = [self.whole((), "no shims")], list[Step]()
        if steps[0].gap_mm <= self.limit_mm:
            return steps, steps[0]
        for start in self._starts(steps[0]):
            grown = self.grown([(start, -1)], (), range(self.cases), (inf, inf))
            most = len(grown[0]) if grown else len(self.study.patches)
            for plan in (*grown, *self.added(start, most, self.deciding(steps[0]))):
                steps.append(step := self.whole(plan, "growth"))
                if step.gap_mm > self.limit_mm and (more := self.thicker(step.plan, step.outcome)):
                    steps.append(step := self.whole(more, "growth"))  # what the estimate could not tell
                kept += [step] if step.gap_mm <= self.limit_mm else []
            if kept:
                break
        best = last = min(kept, key=lambda step: self.cost(step.plan), default=None)
        while best and (best := self.better(best)):
            steps.append(last := best)
        return steps, last or steps[0]

    def _starts(self, without: Step) -> Iterator[Plan]:
        """No shims; where nothing gets there from them, the best with one thickness everywhere."""
        yield ()
        plans = [tuple((k, t) for k in range(len(self.study.patches))) for t in self.stock]
        outcomes = self.outcomes(plans, self.deciding(without), ESTIMATED, ())
        yield min(zip([self._value(one)[0] for one in outcomes], plans, strict=True))[1]

    def added(self, plan: Plan, most: int, cases: Sequence[int]) -> list[Plan]:
        """The plan of at most so many shims after the best change of one shim after another, until it keeps
        the limit by estimates, or none helps; none if growth got there with fewer.
        """
        (outcome,) = self.outcomes([plan], cases, ESTIMATED, plan)
        while self.gap(outcome) > self.limit_mm:
            options = [option for option in self._changes(plan, outcome) if len(option) <= most]
            made = self.outcomes(options, cases, ESTIMATED, plan) if options else []
            values = [(self._value(one), option) for one, option in zip(made, options, strict=True)]
            if not values or min(values)[0] >= self._value(outcome):
                return [plan] if most == len(self.study.patches) else []
            outcome, plan = made[k := values.index(min(values))], options[k]
        return [plan]

    def _value(self, outcome: Outcome) -> tuple[float, float]:
        mean = float(np.mean(outcome.mean))
        return round(max(self.gap(outcome), self.limit_mm), DIGITS), round(mean, DIGITS)

    def _changes(self, plan: Plan, outcome: Outcome) -> list[Plan]:
        """One patch as thick as its gap asks for or a step more, a step thinner, or without a shim."""
        changed, now = list[Plan](), dict(plan)
        for k, excess in enumerate(self._excess(outcome)):
            options = {*self._enough(now.get(k, 0.0), max(excess, 0.0))[:2], *self._thinner(now.get(k, 0.0))}
            changed += [_with(plan, k, option) for option in sorted(options)]
        return changed

    def better(self, step: Step) -> Step | None:
        """The best plan that is better, by a shim less or thinner and what others grow to, if any."""
        moves = [(_with(step.plan, int(k), t), int(k)) for k, now in step.plan for t in self._thinner(now)]
        plans = self.grown(moves, step.plan, self.deciding(step), self.cost(step.plan))
        for plan in sorted(set(plans), key=lambda plan: (self.cost(plan), plan)):
            if (other := self.whole(plan, "descent")).gap_mm <= self.limit_mm:
                return other
        return None

    def grown(
        self, starts: list[tuple[Plan, int]], base: Plan, cases: Sequence[int], below: tuple[float, float]
    ) -> list[Plan]:
        """What plans grow to, each with the number of a patch that does not, if that keeps the limit by
        estimates and costs less. base : see Question.
        """
        kept, waiting = list[Plan](), starts
        while waiting := [(plan, held) for plan, held in waiting if self.cost(plan) < below]:
            outcomes = self.outcomes([plan for plan, _ in waiting], cases, ESTIMATED, base)
            pairs = list(zip(waiting, outcomes, strict=True))
            kept += [plan for (plan, _), outcome in pairs if self.gap(outcome) <= self.limit_mm]
            thicker = [
                (self.thicker(plan, outcome, held), held)
                for (plan, held), outcome in pairs
                if self.gap(outcome) > self.limit_mm
            ]
            waiting = [(plan, held) for plan, held in dict.fromkeys(thicker) if plan]
        return kept

    def thicker(self, plan: Plan, outcome: Outcome, held: int = -1) -> Plan:
        """The plan with what the gap of each patch asks for, or the thickest; empty if a patch has that
        already or is held, or if no gap asks.
        """
        now, asking = dict(plan), [(k, more) for k, more in enumerate(self._excess(outcome)) if more > 0]
        if any(k == held or now.get(k) == self.stock[-1] for k, _ in asking) or not asking:
            return ()
        now |= {k: [*self._enough(now.get(k, 0.0), more), self.stock[-1]][0] for k, more in asking}
        return tuple(sorted(now.items()))

    def _excess(self, outcome: Outcome) -> list[float]:
        """By how much the gap of each patch is too large, mm, in all cases but the worst, which may fail."""
        order = sorted(range(len(outcome.largest)), key=lambda k: (outcome.largest[k], k))
        figures = np.array([outcome.further[k] for k in order[: len(order) - self.allowed]])
        return list(map(float, figures[:, : len(self.study.patches)].max(axis=0) - self.limit_mm))

    def _enough(self, t: float, excess: float) -> list[float]:
        """The thicknesses of the stock above t that are not below t + excess."""
        return [s for s in self.stock if s > t and s >= round(t + excess, DIGITS)]

    def _thinner(self, t: float) -> list[float]:
        """No shim, and a step thinner than t."""
        lower = [0.0, *(s for s in self.stock if s < t)] if t else []
        return list(dict.fromkeys(lower[:1] + lower[-1:]))


def _with(plan: Plan, patch: int, thickness: float) -> Plan:
    """The plan with that thickness of a patch; 0: none."""
    rest = {k: t for k, t in plan if k != patch} | ({patch: thickness} if thickness else {})
    return tuple(sorted(rest.items()))
