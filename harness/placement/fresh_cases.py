"""Decides by fresh load cases, which did not choose the plan, whether it keeps a limit in a share s of all.

Of the K cases that choose a plan, ⌊(1 − s) K / 2⌋ may fail: half as many as s allows. N fresh cases then
decide. The plan is shown to keep the limit if at most c of them fail, where c is the largest number with

    Σ_{i ≤ c} C(N, i) (1 − s)^i s^(N − i) ≤ α_r / 2,   α_r = 0.05 / 2^r.

Then the exact interval of Clopper and Pearson for the plan's share begins at s or above. N is the smallest
number for which a plan that fails half as often as s allows passes with probability 0.8.

If the plan does not pass, K is doubled, the search begins again, and cases that were never used decide: round
r = 1, 2, …, ROUNDS. As Σ α_r < 0.05, the intervals of all rounds hold together with 95 % confidence. For
s = 1, N = K and c = 0: no number of cases shows that none fails, but the interval bounds how many may.

A table of measured gaps is finite: its odd rows are held back, and there is one round, r = 0.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from math import ceil, floor, inf, isfinite, log, log10

from harness.placement.candidates import Plan
from harness.placement.plan_search import PlanSearch, Step
from harness.scene.allowed_gap import CONFIDENCE, SHARE, share_interval
from problems.errors import InputError
from report.document.numbers import beside, counted, percent_interval, raised

ALPHA = 0.05
POWER = 0.8
ROUNDS = 4
MOST = 10**7  # fresh cases


@dataclass(frozen=True)
class Goal:
    """The aim of a search.

    The fewest fasteners with which at least `share` of the cases keep limit_mm, or the best plan of `count`
    fasteners. also : other limits, in words.
    """

    limit_mm: float | None
    share: float
    count: int | None = None
    also: str = ""

    @staticmethod
    def share_of(share: float | None, cases: int) -> float:
        """The share that is asked for, by default 0.95, of a single case 1."""
        return share or (1.0 if cases == 1 else SHARE)

    def allowed_choosing(self, cases: int) -> int:
        """How many of the `cases` that choose a plan may fail. Raises InputError if they are too few to show
        the share.
        """
        if self.share < 1 and self.share**cases > ALPHA:
            allowed = f"{counted(cases, 'case')} cannot show it: take {self.least(ALPHA)}, or a share of 1"
            raise InputError.one("--share", "share", self.share, allowed)
        return floor((1 - self.share) * cases / 2 + 1e-9)

    def least(self, alpha: float) -> int:
        """The fewest cases that show the share, if none of them fails."""
        return ceil(log(alpha) / log(self.share))

    def fresh(self, alpha: float) -> int:
        """N, the number of fresh cases, for a share below 1."""
        from scipy.stats import binom  # slow to import

        q = 1 - self.share
        sizes = (
            (c, bisect_left(range(MOST), True, key=lambda n: binom.cdf(c, n, q) <= alpha / 2))
            for c in count()
        )
        return next(n for c, n in sizes if binom.cdf(c, n, q / 2) >= POWER)

    def allowed_fresh(self, cases: int, alpha: float) -> int:
        """c, how many of the fresh `cases` may fail; -1 if they are too few to show the share."""
        from scipy.stats import binom

        shown = binom.cdf(range(cases), cases, 1 - self.share) <= alpha / 2
        return int(shown.sum()) - 1 if self.share < 1 else 0


@dataclass(frozen=True)
class Cases:
    """The numbers of load cases in the order of their use; the first `choosing` choose a plan.

    table : whether they are the rows of a table, so that there are no others.
    """

    numbers: Sequence[int]
    choosing: int
    table: bool = False

    @classmethod
    def of(cls, count: int, table: bool, goal: Goal) -> "Cases":
        """count : how many choose a plan; of a table, all its rows. Raises InputError if they are too few to
        show the share.
        """
        if table and count > 1:
            if goal.allowed_fresh(count // 2, ALPHA) < 0:
                least = 2 * goal.least(ALPHA / 2)
                allowed = f"half of {count} rows are held back: take {least} rows, or a share of 1"
                raise InputError.one("--share", "share", goal.share, allowed)
            return cls([*range(0, count, 2), *range(1, count, 2)], count - count // 2, True)
        goal.allowed_choosing(count)
        return cls(range(MOST if count > 1 else 1), count)


@dataclass(frozen=True)
class Sample:
    """A plan in fresh cases.

    step : its gap_mm is the limit that all but c of them keep. cases : what they are called. kept : how many
    keep the goal's limit, or gap_mm if there is none. interval : of the share of all cases that do. item :
    what plans are made of.
    """

    step: Step
    numbers: Sequence[int]
    cases: str
    kept: int
    interval: tuple[float, float]
    item: str

    @classmethod
    def of(
        cls, plan: Plan, search: PlanSearch, goal: Goal, cases: Cases, fresh: slice, alpha: float
    ) -> "Sample":
        """fresh : which of the cases' numbers."""
        numbers = cases.numbers[fresh]
        count = len(numbers)
        step = search.among(numbers, goal.allowed_fresh(count, alpha)).whole(plan, "fresh cases")
        limit = step.gap_mm if goal.limit_mm is None else goal.limit_mm
        known = [gap for gap in step.outcome.largest if isfinite(gap)]  # of the others nothing is proven
        kept = sum(gap <= limit for gap in known)
        interval = share_interval(kept, count, count - len(known), 1 - alpha)
        name = "held-back row" if cases.table else "fresh case"
        name = f"{name}s" if count > 1 else name
        return cls(step, numbers, name, kept, interval, search.item)

    def sentence(self, goal: Goal, which: str = "") -> str:
        """3 fasteners keep 0.12 mm in 96.7 % of 300 fresh cases (95 % interval 94.0 to 98.4 %)"""
        step, cases = self.step, len(self.numbers)
        plan = f"{which}{counted(len(step.plan), self.item)} {'keeps' if len(step.plan) == 1 else 'keep'}"
        plan = plan if step.plan else f"joints without a {self.item} keep"
        digits = max(1, floor(1e-9 - log10(1 - goal.share))) if goal.share < 1 else 1
        limit = beside(inf, raised)(step.gap_mm) if goal.limit_mm is None else f"{goal.limit_mm:g}"
        share = f"{100 * self.kept / cases:.{digits}f} %"
        of = f"all {cases}" if self.kept == cases > 1 else f"{share} of {cases}"
        interval = f"{100 * CONFIDENCE:g} % interval {percent_interval(self.interval, digits)}"
        return f"{plan} {limit} mm{goal.also} in {of} {self.cases} ({interval})"


@dataclass(frozen=True)
class SearchOutcome:
    """The outcome of all rounds.

    steps : of the last search, in the load cases `numbers`. best : None if not even all candidates keep the
    limit. samples : one per round; none if there is one load case. order : the plans with 0, 1, … fasteners
    set, up to the best.
    """

    steps: list[Step]
    numbers: Sequence[int]
    best: Step | None
    samples: list[Sample]
    order: list[Step]


def search_in_rounds(search: PlanSearch, current: Plan, goal: Goal, cases: Cases) -> SearchOutcome:
    """Search, and let fresh cases decide, until a plan passes or no round is left. current : the scene's own
    plan, for comparison.
    """
    used, choosing, samples = cases.choosing, cases.choosing, list[Sample]()
    while True:
        now = search.among(cases.numbers[:choosing], goal.allowed_choosing(choosing))
        steps, best = now.once(current, goal.count)
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
        choosing *= 2
        more = f"that is too few. The search goes on with {choosing} cases"
        search.reporter.say(f"{sample.sentence(goal)}: {more}")
        used = max(used + count, choosing)
    none = best is steps[0] and not enough
    order = [] if none else now.order_of(best)
    return SearchOutcome(steps, cases.numbers[:choosing], None if none else best, samples, order)
