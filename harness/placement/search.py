"""The fewest fasteners that keep a limit on the gap, or the best plan of a given number of them.

The gap G(S) of a plan S is the smallest limit that it keeps in all of its K load cases but those that may
fail (fresh_cases.py). G is not monotone: one more fastener may open a gap elsewhere. Plans are compared by

    φ(S) = (max(G, limit), mean over the cases of (Σ y⁸ / m)^⅛),

y the m gaps of a case. φ is estimated on the worst cases of the plan before: twice the number that may fail,
and 8 more. The G of these cases is never above that of all. Each plan that is kept is then solved in all
cases, and proven.

Removal deletes the fastener whose loss costs least: without it, φ is least. While the limit holds, it deletes
an eighth of the plan per step, never two neighbours. As a rule, the cost of a removal grows with the number
of fasteners already deleted. So the values of earlier steps are renewed in their order, until no other can be
less (the lazy greedy method: Minoux, Optimization Techniques, 234–243, 1978).

Exchange moves one fastener to a free hole next to a place where the gap is too large. It tries the fasteners
nearest to that hole and those whose loss costs least, makes the best move, and goes on while φ falls. It
starts from the plan of least G among the uniform ones of as many fasteners and the plan after a removal; from
each of them if FEW fasteners or fewer are asked for. If there are at most PLANS plans of a number of
fasteners, all of them are compared instead.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from math import comb, dist
from typing import TypeAlias

from harness.placement.candidates import Place, Plan, uniform_plans
from harness.placement.plan_search import PlanSearch, Step
from problems.forms.assembly import Matrix
from problems.model.scene import JointScene

Value: TypeAlias = tuple[float, float]
Values: TypeAlias = dict[Place, Value]

AT_ONCE = 8  # plans estimated together
NONE = (0.0, 0.0)  # less than any φ
HOLES, NEAREST, LEAST = 3, 3, 3  # of an exchange: holes, fasteners near each, fasteners that cost least
SHARE_AT_ONCE = 8  # 1/8 of a plan is deleted per step, while the limit holds
NEXT = 3  # a fastener and its neighbours
FEW = 3  # up to so many fasteners, exchange starts from every plan
PLANS = 300  # up to so many plans of a number, all are compared; after a removal half as many
FURTHER = 1.25  # times the limit: removal goes on up to this gap


@dataclass
class Search(PlanSearch):
    """Searches among plans from a set of candidate holes.

    bare : the scene without fasteners. contacts : their places (m, 2), mm.
    """

    item = "fastener"
    bare: JointScene
    contacts: Matrix
    candidates: Plan

    def once(self, current: Plan, count: int | None) -> tuple[list[Step], Step]:
        """All candidates, the scene's own plan, removal and exchange, uniform plans of as many fasteners."""
        steps = [self.whole(self.candidates, "all candidates")]
        if current != self.candidates:
            steps.append(self.whole(current, "own"))
        best, values = steps[0], Values()
        if count is None and best.gap_mm <= self.limit_mm:
            best, way = self.fewest(best)
            steps += way
        elif count is not None and comb(len(self.candidates), count) <= PLANS:
            steps.append(best := self.best_of_all(best, count))
        elif count is not None:
            way = [best, *islice(self.removal(best, values), len(best.plan) - count - 1)]
            steps += way[1:]
            steps.append(best := self.fewer(way[-1], values, every=count <= FEW)[0])
        return [*steps, *self.wholes(self.even(len(best.plan)), "uniform")], best

    def even(self, count: int) -> list[Plan]:
        """Plans of the holes nearest to uniform patterns of `count` fasteners."""
        return list(dict.fromkeys(onto(plan, self.candidates) for plan in uniform_plans(self.bare, count)))

    def fewest(self, start: Step) -> tuple[Step, list[Step]]:
        """The smallest plan found that keeps the limit, and all steps to it. start : all candidates, which
        keep it.
        """
        best, steps, earlier = start, list[Step](), Values()
        while (count := len(best.plan) // SHARE_AT_ONCE) > 1:
            steps.append(step := self._without_least(best, earlier, count))
            if step.gap_mm > self.limit_mm:
                break
            best = step
        values = dict(earlier)
        for step in self.removal(best, earlier):
            steps.append(step)
            if step.gap_mm <= self.limit_mm:
                best, values = step, dict(earlier)
            elif step.gap_mm > FURTHER * self.limit_mm:
                break
        while best.plan:
            fewer, values = self.fewer(best, values)
            if fewer.gap_mm > self.limit_mm:
                break
            steps.append(best := fewer)
        return best, steps

    def fewer(self, step: Step, earlier: Values, every: bool = False) -> tuple[Step, Values]:
        """The best plan found with one fastener less, and the values on the way to it.

        Exchange starts from the best plan of that number, or from every one of them; if there are few plans
        of that number, all are compared.
        """
        if comb(len(self.candidates), len(step.plan) - 1) <= PLANS // 2:
            return self.best_of_all(step, len(step.plan) - 1), {}
        starts: dict[Plan, Values] = {plan: {} for plan in self.even(len(step.plan) - 1)}
        starts[without(step.plan, self._least(step, earlier, 1)[0])] = earlier
        ordered = sorted(self.wholes(list(starts), "exchange"), key=Step.sort_key)
        tried = [self.exchanged(start, starts[start.plan]) for start in (ordered if every else ordered[:1])]
        return min(tried, key=Step.sort_key), starts[ordered[0].plan]

    def best_of_all(self, step: Step, count: int) -> Step:
        """The plan of least G among all plans of `count` fasteners. step : the base of the first estimates.

        Estimates are never above G: plans are solved in the order of their estimates, until no other can have
        a smaller G.
        """
        plans = list(combinations(self.candidates, count))
        values = dict(zip(plans, self._values(step, plans), strict=True))
        solved: list[Step] = []
        while values:
            del values[plan := min(values, key=lambda plan: (values[plan], plan))]
            solved.append(self.whole(plan, "exchange"))
            least = min(step.gap_mm for step in solved)
            values = {plan: value for plan, value in values.items() if value[0] < max(least, self.limit_mm)}
            renewed = self._values(solved[-1], list(values))
            values = {plan: max(pair) for plan, *pair in zip(values, values.values(), renewed, strict=True)}
        return min(solved, key=Step.sort_key)

    def removal(self, step: Step, earlier: Values) -> Iterator[Step]:
        """Plans with one, two, … fasteners less. earlier : values of earlier steps, renewed."""
        while step.plan:
            yield (step := self._without_least(step, earlier, 1))

    def _without_least(self, step: Step, earlier: Values, count: int) -> Step:
        """The plan without the `count` fasteners whose loss costs least; of neighbours, one alone goes."""
        gone: list[Place] = []
        for place in self._least(step, earlier, count):
            if not set(nearest(step.plan, place, NEXT)).intersection(gone):
                gone.append(place)
        return self.whole(tuple(place for place in step.plan if place not in gone), "removal")

    def _least(self, step: Step, earlier: Values, count: int) -> list[Place]:
        """The `count` fasteners whose loss costs least. earlier : φ of earlier steps, renewed."""
        fresh: Values = {}
        waiting = sorted(step.plan, key=lambda place: (earlier.get(place, NONE), place))
        while waiting:
            if len(fresh) >= count and sorted(fresh.values())[count - 1] <= earlier.get(waiting[0], NONE):
                break
            some, waiting = waiting[:AT_ONCE], waiting[AT_ONCE:]
            values = self._values(step, [without(step.plan, place) for place in some])
            fresh |= dict(zip(some, values, strict=True))
        earlier |= fresh
        return sorted(fresh, key=lambda place: (fresh[place], place))[:count]

    def exchanged(self, step: Step, earlier: Values) -> Step:
        """The plan after the best moves, until it keeps the limit or no move makes φ less.

        If a move turns out not to lower G, its worst cases also decide about the next moves.
        """
        cases = self.deciding(step)
        while step.gap_mm > self.limit_mm:
            moves = self._moves(step, earlier)
            (now, *values) = self._values(step, [step.plan, *moves], cases)
            best = min(range(len(moves)), key=lambda k: (values[k], moves[k]), default=None)
            if best is None or values[best] >= now:
                break
            after = self.whole(moves[best], "exchange")
            if after.gap_mm < step.gap_mm:
                step, cases = after, self.deciding(after)
            elif set(more := self.deciding(after)) <= set(cases):
                break
            else:
                cases = tuple(sorted({*cases, *more}))
        return step

    def order_of(self, best: Step) -> list[Step]:
        return [best, *self.removal(best, {})][::-1]

    def _moves(self, step: Step, earlier: Values) -> list[Plan]:
        """Plans with one fastener moved to a free hole."""
        free = [place for place in self.candidates if place not in step.plan]
        if not (free and step.plan):
            return []
        least = self._least(step, earlier, LEAST)
        places = [self.contacts[step.outcome.contact[k]] for k in self.deciding(step)]
        holes = Counter(nearest(free, place, 1)[0] for place in places)
        moves = {
            plan: None
            for hole, _ in sorted(holes.items(), key=lambda item: (-item[1], item[0]))[:HOLES]
            for gone in dict.fromkeys([*nearest(step.plan, hole, NEAREST), *least])
            for plan in [tuple(sorted((*without(step.plan, gone), hole)))]
        }
        return list(moves)

    def _values(self, step: Step, plans: Sequence[Plan], cases: tuple[int, ...] = ()) -> list[Value]:
        """φ of other plans, estimated in `cases`, by default the worst ones of the step."""
        outcomes = self.outcomes(plans, cases or self.deciding(step), step.plan)
        return [self.value(outcome) for outcome in outcomes]


def without(plan: Plan, gone: Place) -> Plan:
    return tuple(place for place in plan if place != gone)


def onto(plan: Plan, candidates: Plan) -> Plan:
    """The plan with each fastener moved to the nearest free hole."""
    free = list(candidates)
    for place in plan:
        free.remove(nearest(free, place, 1)[0])
    return tuple(place for place in candidates if place not in free)


def nearest(places: Sequence[Place], to: Place | Matrix, count: int) -> list[Place]:
    """The `count` places nearest to a point, the nearest first."""
    return sorted(places, key=lambda place: (dist(place, to), place))[:count]
