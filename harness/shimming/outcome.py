"""The outcome of a search for shims: in words, and the figures of its record."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from harness.placement.fresh_cases import Goal, SearchOutcome
from harness.placement.session import Outcome
from harness.scene.allowed_gap import check_answer
from harness.scene.mesh_error import estimated, mesh_record
from harness.scene.solution import solve
from problems.model.fastener_forces import fastener_forces
from problems.scene_files import read_scene
from report.document.numbers import beside, counted, position, proven_to, raised

from .patches import BORDERS
from .study import ShimStudy

UNITS = ("N", "N/mm²")  # of the limits of force and stress


def sentence_of(result: SearchOutcome, goal: Goal, study: ShimStudy) -> tuple[str, bool]:
    """The outcome in words, and whether the plan passed."""
    first, sample = result.steps[0], result.samples[-1] if result.samples else None
    limit = goal.limit_mm or 0.0
    # No shims may be enough where it chose, and refuted by fresh cases.
    step = result.best or (first if first.gap_mm <= limit else None)
    least = step or min(result.steps, key=lambda step: step.gap_mm)
    figures = least.outcome.further[least.worst]
    gaps, more = np.array(figures[: len(study.masks)]), zip(figures[-2:], study.limits, UNITS, strict=True)
    others = "".join(f", {beside(most, raised)(value)} {unit}" for value, most, unit in more if most < inf)
    largest = beside(limit, raised)(gaps.max())
    leave = f"{largest} mm{others} of {goal.limit_mm:g} mm{goal.also} allowed"
    if step is None:
        words = "no shims of the stock are found with which all limits are kept; the best tried leave"
        at = [*(f"in patch {patch.name}" for patch in study.patches), "beyond all patches"]
        proven = "proven" if np.isfinite(figures).all() else "not proven"
        return f"FAIL: {words} {leave}, the largest gap {at[int(gaps.argmax())]}, {proven}.", False
    passed, count = (sample.step if sample else step).gap_mm <= limit, len(step.plan)
    words = f"{counted(count, 'shim') if count else 'the scene'} {'leave' if count > 1 else 'leaves'} {leave}"
    words = sample.sentence(goal) if sample else words
    none_needed = "" if count or not passed else "no shim is needed: "
    return f"{'PASS' if passed else 'FAIL'}: {none_needed}{words}, proven.", passed


def figures_of(study: ShimStudy, before: Sequence[Outcome], after: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of each patch and of all, without and with shims: the largest, of a volume the mean."""
    count, joint = len(study.patches), study.bare.joint
    old, new = (np.array([row for one in some for row in one.further]) for some in (before, after))
    patches = [
        {"patch": patch.name, "outline": patch.outline, "area_mm2": patch.area}
        | dict(zip(BORDERS, patch.shim.ranges.ravel().tolist(), strict=True))
        | {"gap_before_mm": old[:, k].max(), "gap_after_mm": new[:, k].max()}
        | {"liquid_mm3": new[:, count + 1 + k].mean()}
        for k, patch in enumerate(study.patches)
    ]
    names = ("gap", "force", "stress")
    whole = {
        when: dict(zip(names, (some[:, : count + 1].max(), *some[:, -2:].max(axis=0)), strict=True))
        for when, some in {"before": old, "after": new}.items()
    }
    contacts = [contact for one in after for contact in one.contact]
    worst = contacts[int(new[:, : count + 1].max(axis=1).argmax())]
    drawn = {"bounds": joint.bounds.tolist(), "marks": study.bare.marks().tolist()}
    return {"patches": patches, **whole, **drawn, "worst_at": position(study.places[worst], study.places)}


def record_of(result: SearchOutcome, study: ShimStudy) -> dict[str, Any]:
    """The figures before, in the cases that chose, and after, in those that decided, and what was tried."""
    best = result.best or result.steps[0]
    after = result.samples[-1].step if result.samples else best
    figures = figures_of(study, [result.steps[0].outcome], [after.outcome])
    sizes = {int(k): t for k, *t in best.plan}
    for k, patch in enumerate(figures["patches"]):
        patch["thickness_mm"], *end = sizes.get(k, [0.0] * study.ends)
        patch |= {"thickness_end_mm": end[0]} if end else {}
    samples = [{"cases": len(s.numbers), "kept": s.kept, "interval": s.interval} for s in result.samples]
    steps = [{"moved": step.moved, "gap_mm": step.gap_mm, "plan": step.plan} for step in result.steps]
    return figures | {"samples": samples, "steps": steps}


def solver_statements(path: Path, shims: int, allowed_mm: float) -> dict[str, Any]:
    """The uncertainties that `solve` states for the scene with shims, and the forces in its fasteners.

    The forces are those without and with shims.
    """
    after: Any = read_scene(str(path))
    without = replace(after, effects=after.effects[: len(after.effects) - shims])
    answers = [solve(without), solve(after)]
    check = check_answer(answers[1], allowed_mm, [], mesh := estimated(answers[1]))
    pairs = zip(*(fastener_forces(answer.problem.scene, answer.x) for answer in answers), strict=True)
    sure = [f"Solver: gaps {proven_to(check['uncertainty_mm'])}", mesh_record(mesh)["said"]]
    sure.append(f"Scan: {check.get('beyond_scan', 'no contact is beyond measured points')}")
    return {"sure": sure, "forces": [old | {"with_shims_N": new["force_N"]} for old, new in pairs]}
