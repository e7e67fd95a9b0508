"""What is recorded of a search for a plan of fasteners: its identity, its outcome, and a sentence on it."""

from collections.abc import Sequence
from dataclasses import asdict
from math import inf, isfinite
from typing import Any

from harness.placement.candidates import Plan
from harness.placement.fresh_cases import CONFIDENCE, Goal, SearchOutcome
from harness.placement.plan_search import Step
from harness.placement.session import FastenerStudy
from harness.results.provenance import stamp
from problems.forms.assembly import Matrix
from problems.storage import digest
from report.document.numbers import beside, counted, position, raised


def identity_of(study: FastenerStudy, current: Plan, candidates: Plan, goal: Goal) -> dict[str, Any]:
    """All that decides what is written, so that one directory holds one search."""
    holes = {"candidates": candidates, "the scene's fasteners": current}
    return {
        **asdict(goal),
        **{name: f"{counted(len(plan), 'place')}, hash {digest(plan)[:8]}" for name, plan in holes.items()},
        "fastener": study.fastener.model_dump(mode="json", include={"preload", "between"}),
        **study.identity,
    }


def record_of(
    study: FastenerStudy, current: Plan, candidates: Plan, goal: Goal, result: SearchOutcome, nodes: Matrix
) -> dict[str, Any]:
    """The content of place.json."""
    scene = study.scene

    def entry(step: Step, numbers: Sequence[int] = result.numbers) -> dict[str, Any]:
        limit, gaps = inf if goal.limit_mm is None else goal.limit_mm, step.outcome.largest
        return {
            "moved": step.moved,
            "fasteners": len(step.plan),
            "gap_mm": step.gap_mm,
            "failing": [numbers[k] for k, gap in enumerate(gaps) if limit < gap < inf],
            "unproven": [numbers[k] for k, gap in enumerate(gaps) if not gap < inf],
            "worst_case": numbers[step.worst],
            "worst_at": nodes[step.outcome.contact[step.worst]].tolist(),
            "plan": step.plan,
        }

    return {
        "scene": scene.name,
        "title": scene.title,
        "cases": len(result.numbers),
        "chosen_by_share": 1 - goal.allowed_choosing(len(result.numbers)) / len(result.numbers),
        "preload": study.fastener.preload,
        "stages": [stage.name for stage in scene.stages],
        **asdict(goal),
        "confidence": CONFIDENCE,
        "samples": [
            entry(sample.step, sample.numbers)
            | {"cases": len(sample.numbers), "numbers": list(sample.numbers)}
            | {"kept": sample.kept, "interval": sample.interval}
            for sample in result.samples
        ],
        "candidates": candidates,
        "own": current,
        "steps": [entry(step) for step in result.steps],
        "best": None if result.best is None else entry(result.best),
        "order": [entry(step) for step in result.order],
        "scene_key": scene.key,
        **stamp(),
    }


def sentence_on(result: SearchOutcome, goal: Goal, nodes: Matrix) -> tuple[str, bool]:
    """The outcome in words, and whether the plan passed."""
    step, which = (result.best, "") if result.best else (result.steps[0], "all of the ")
    sample = result.samples[-1] if result.samples else None
    if sample:
        step, words = sample.step, sample.sentence(goal, which)
    else:
        leave = "leaves" if len(step.plan) == 1 else "leave"
        fasteners = f"{which}{counted(len(step.plan), 'fastener')}"
        gap, limit = step.gap_mm, goal.limit_mm
        shown = beside(inf if limit is None else limit, raised)(gap)
        words = f"{fasteners} {leave} {shown} mm in the one load case"
    if goal.limit_mm is None:
        return f"{words}, {'' if isfinite(step.gap_mm) else 'not '}proven.", True
    if step.gap_mm <= goal.limit_mm:
        return f"PASS: {words}, proven.", True
    worst = step.worst if sample is None else sample.numbers[step.worst]
    if step.gap_mm == inf:
        return f"FAIL: {words}; nothing is proven of case {worst}.", False
    at = position(nodes[step.outcome.contact[step.worst]], nodes)
    if sample:
        share = f"{100 * goal.share:.4g} % of the cases" if goal.share < 1 else "every case"
        words += f"; in {share} it is {beside(goal.limit_mm, raised)(step.gap_mm)} mm"
    more = f"{step.gap_mm - goal.limit_mm:.3g} mm more than allowed"
    return f"FAIL: {words}, {more}; case {worst} is the worst, at {at}.", False
