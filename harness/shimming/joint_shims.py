"""Shims of its own for each joint: a search in each load case, and the stock that all of them need."""

from dataclasses import dataclass, replace
from math import floor, isinf
from typing import Any

from harness.placement.answer_journal import AnswerJournal
from harness.placement.fresh_cases import ALPHA, Goal
from harness.placement.session import Outcome, PlanSession, Question
from harness.scene.allowed_gap import CONFIDENCE, share_interval
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.reporter import Reporter
from report.document.numbers import counted, out_of, percent_interval

from .shim_search import ShimSearch
from .study import ShimStudy

TOGETHER = 20  # joints between two lines of progress


@dataclass(frozen=True)
class JointQuestion(Question):
    """Asks for a search in one load case: the outcomes without shims and of the best plan, both proven."""

    limit_mm: float = 0.0
    stock: tuple[float, ...] = ()

    def answered(self, session: PlanSession) -> list[Outcome]:
        assert isinstance(session.study, ShimStudy)
        about = self.limit_mm, session.study, self.stock
        search = ShimSearch(lambda some: list(map(session.answer, some)), 1, 0, *about)
        steps, best = search.among(self.cases, 0).once(())
        return [steps[0].outcome, replace(best.outcome, plan=best.plan)]


def each_joint(
    journal: AnswerJournal, study: ShimStudy, goal: Goal, stock: tuple[float, ...], reporter: Reporter
) -> tuple[list[dict[str, Any]], list[Outcome], list[Outcome], str, bool]:
    """The joints, their outcomes without and with shims, the verdict in words, and whether it is PASS."""
    limit, count, answers = goal.limit_mm or 0.0, study.cases.count, list[list[Outcome]]()
    for start in range(0, count, TOGETHER):
        some = range(start, min(start + TOGETHER, count))
        answers += journal([JointQuestion((), (k,), None, limit, stock) for k in some])
        reporter.progress(f"{out_of(len(answers), count, 'joint')} searched")
    before, after = ([pair[k] for pair in answers] for k in (0, 1))
    joints = [
        {"joint": k, "kept": one.largest[0] <= limit, "shims": len(one.plan), "plan": one.plan}
        for k, one in enumerate(after)
    ]
    kept, pieces = sum(one.largest[0] <= limit for one in after), sum(len(one.plan) for one in after)
    most = goal.allowed_fresh(count, ALPHA)
    if isinstance(study.cases, MeasuredGaps):  # there are no others
        most = floor((1 - goal.share) * count + 1e-9)
    interval = share_interval(kept, count, sum(isinf(one.largest[0]) for one in after))
    words = f"{out_of(kept, count, 'joint')} can be kept within the limits, {100 * kept / count:.1f} %"
    words += f" ({100 * CONFIDENCE:g} % interval {percent_interval(interval)})"
    none = "no shim is needed" if kept == count else "none of these needs a shim"
    words += f", with {counted(pieces, 'shim')} in all" if pieces else f"; {none}" * bool(kept)
    passed = count - kept <= most
    return joints, before, after, f"{'PASS' if passed else 'FAIL'}: {words}, proven.", passed
