"""Studies of shims in one load case, and searches in them."""

from math import inf
from pathlib import Path

from small_joints import scene_at

from harness.placement.session import PlanSession
from harness.shimming.patches import patches_of
from harness.shimming.shim_search import ShimSearch
from harness.shimming.study import ShimStudy
from problems.build import load_case
from problems.load_cases import Listed
from problems.model.stage_answers import last_scene


def study_of(path: Path, patches: str, limits: tuple[float, float] = (inf, inf), ends: int = 1) -> ShimStudy:
    """Of the scene's own gap."""
    scene = scene_at(path)
    bare = last_scene(scene)
    cases = Listed((load_case(bare),))
    return ShimStudy(scene, bare, cases, "dual", patches_of(scene.joint, patches), limits, ends)


def search_of(session: PlanSession, limit_mm: float, stock: tuple[float, ...]) -> ShimSearch:
    """In the only case, which may not fail."""
    assert isinstance(session.study, ShimStudy)
    return ShimSearch(lambda some: [session.answer(q) for q in some], 1, 0, limit_mm, session.study, stock)
