"""Whether a plan keeps a limit in a share s of the load cases: decided by fresh cases, which chose nothing.

In the K cases that choose a plan, half as many may fail as in all, ⌊(1 − s) K / 2⌋. N fresh cases follow. It
keeps the limit if the exact interval of Clopper and Pearson for its share begins at s or above, which is so
if at most c of them fail:

    Σ_{i ≤ c} C(N, i) (1 − s)^i s^(N − i) ≤ α_r / 2,   α_r = 0.05 / 2^r.

N is the least, with its c, for which a plan that fails half as often as s allows passes with probability 0.8.
Otherwise K is doubled, the search begins again, and cases that were never used decide: at most ROUNDS times.
As Σ α_r < 0.05, all intervals of a search hold with 95 % together, whenever it ends. Where s = 1, N = K and
c = 0: no number of cases shows that none fails, and the interval says how many it may be.

A table of gaps ends: its odd rows are held back, r = 0, and there is one round.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count, islice
from math import ceil, comb, floor, log

from harness.placement.candidates import Plan
from harness.placement.search import FEW, PLANS, Search, Step, Values
from problems.errors import InputError

ALPHA = 0.05
CONFIDENCE = 1 - ALPHA
POWER = 0.8
ROUNDS = 4
MOST = 10**7  # fresh cases


@dataclass(frozen=True)
class Goal:
    """The fewest fasteners with which at least `share` of the cases keep limit_mm, or the best `count`."""

    limit_mm: float | None
    share: float
    count: int | None

    def allowed(self, cases: int) -> int:
        """How many of the cases that choose may fail. Raises InputError if as many cannot show the share."""
        if self.share < 1 and self.share**cases > ALPHA:
            allowed = f"{cases} cases cannot show it: take {self.least(ALPHA)}, or a share of 1"
            raise InputError.one("--share", "share", self.share, allowed)
        return floor((1 - self.share) * cases / 2 + 1e-9)

    def least(self, alpha: float) -> int:
        """The fewest cases that show the share, if none of them fails."""
        return ceil(log(alpha) / log(self.share))

    def fresh(self, alpha: float) -> int:
        """N, for a share below 1."""
        from scipy.stats import binom  # slow to import

        q = 1 - self.share
        sizes = (
            (c, bisect_left(range(MOST), True, key=lambda n: binom.cdf(c, n, q) <= alpha / 2))
            for c in count()
        )
        return next(n for c, n in sizes if binom.cdf(c, n, q / 2) >= POWER)

    def failing(self, cases: int, alpha: float) -> int:
        """c, of so many fresh cases; -1 if they cannot show the share."""
        from scipy.stats import binom

        shown = binom.cdf(range(cases), cases, 1 - self.share) <= alpha / 2
        return int(shown.sum()) - 1 if self.share < 1 else 0


@dataclass(frozen=True)
class Cases:
    """The numbers of load cases in the order of their use; the first `choosing` choose a plan.

    table : whether that are all.
    """

    numbers: Sequence[int]
    choosing: int
    table: bool = False

    @classmethod
    def of(cls, count: int, table: bool, goal: Goal) -> Cases:
        """count : that choose; of a table, all. Raises InputError if they cannot show the share."""
        if table and count > 1:
            if goal.failing(count // 2, ALPHA) < 0:
                least = 2 * goal.least(ALPHA / 2)
                allowed = f"half of {count} rows are held back: take {least} rows, or a share of 1"
                raise InputError.one("--share", "share", goal.share, allowed)
            return cls([*range(0, count, 2), *range(1, count, 2)], count - count // 2, True)
        goal.allowed(count)
        return cls(range(MOST if count > 1 else 1), count)


@dataclass(frozen=True)
class Sample:
    """Fresh cases of a plan. step : its gap_mm is what all but c of them keep. what : the name of the cases.
    kept : how many keep the limit, or without one that gap. interval : of the share of all cases that do.
    """

    step: Step
    numbers: Sequence[int]
    what: str
    kept: int
    interval: tuple[float, float]

    @classmethod
    def of(cls, plan: Plan, search: Search, goal: Goal, cases: Cases, fresh: slice, alpha: float) -> Sample:
        """fresh : of the cases' numbers."""
        from scipy.stats import binomtest

        numbers = cases.numbers[fresh]
        count = len(numbers)
        step = search.among(numbers, goal.failing(count, alpha)).whole(plan, "fresh cases")
        limit = step.gap_mm if goal.limit_mm is None else goal.limit_mm
        kept = sum(gap <= limit for gap in step.outcome.largest)
        low, high = binomtest(kept, count).proportion_ci(1 - alpha, "exact")
        what = "held-back row" if cases.table else "fresh case"
        return cls(step, numbers, f"{what}s" if count > 1 else what, kept, (float(low), float(high)))


@dataclass(frozen=True)
class Found:
    """steps : of the last search, by `numbers` of cases. best : None if all candidates do not keep the limit.
    samples : of each round; none if there is one load case. order : the plans with 0, 1, … fasteners set.
    """

    steps: list[Step]
    numbers: Sequence[int]
    best: Step | None
    samples: list[Sample]
    order: list[Step]


def decided(
    search: Search, own: Plan, goal: Goal, cases: Cases, again: Callable[[Sample, int], None]
) -> Found:
    """Search after search, each with a sample, until one is enough.

    again : told of a sample that is not, and of how many cases choose the next plan.
    """
    used, chosen, samples = cases.choosing, cases.choosing, list[Sample]()
    while True:
        now = search.among(cases.numbers[:chosen], goal.allowed(chosen))
        steps, best = searched(now, own, goal)
        enough = more_may_help = goal.limit_mm is None or best.gap_mm <= goal.limit_mm
        if len(cases.numbers) == 1:
            break
        alpha = ALPHA if cases.table else ALPHA / 2 ** (len(samples) + 1)
        count = cases.choosing if goal.share == 1 else goal.fresh(alpha)
        fresh = slice(used, None if cases.table else used + count)
        samples.append(sample := Sample.of(best.plan, search, goal, cases, fresh, alpha))
        enough = goal.limit_mm is None or sample.step.gap_mm <= goal.limit_mm
        if enough or cases.table or not more_may_help or len(samples) == ROUNDS:
            break
        again(sample, 2 * chosen)
        chosen *= 2
        used = max(used + count, chosen)
    none = best is steps[0] and not enough
    order = [] if none else [best, *now.removal(best, {})][::-1]
    return Found(steps, cases.numbers[:chosen], None if none else best, samples, order)


def searched(search: Search, own: Plan, goal: Goal) -> tuple[list[Step], Step]:
    """All candidates, the scene's own plan, removal and exchange, uniform plans of as many; and the best."""
    steps = [search.whole(search.candidates, "all candidates")]
    if own != search.candidates:
        steps.append(search.whole(own, "own"))
    best, before = steps[0], Values()
    if goal.count is None and best.gap_mm <= search.limit_mm:
        best, way = search.fewest(best)
        steps += way
    elif goal.count is not None and comb(len(search.candidates), goal.count) <= PLANS:
        steps.append(best := search.best_of_all(best, goal.count))
    elif goal.count is not None:
        steps += islice(search.removal(best, before), len(best.plan) - goal.count - 1)
        steps.append(best := search.fewer(steps[-1], before, every=goal.count <= FEW)[0])
    return [*steps, *search.wholes(search.even(len(best.plan)), "uniform")], best
