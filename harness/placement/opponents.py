"""Plans that cost next to nothing, which a search has to beat: uniform patterns, and farthest points.

Farthest points: first the fastener that does most, ‖f‖ in the norm of K⁻¹, then each time the one that is
farthest from all before it in that norm: whose effect is least like theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from harness.placement.candidates import Plan, grid, plan_of
from harness.placement.search import Step
from problems.forms.assembly import Matrix
from problems.model.scene import JointScene

MOST_ROWS = 4


def uniform_plans(bare: JointScene, fewer_than: int) -> list[list[Plan]]:
    """For 1, 2, … rows, the patterns of 1, 2, … columns at the middles of equal cells."""
    rows = range(1, MOST_ROWS + 1)
    return [[plan_of(grid(bare, r, c)) for c in range(1, (fewer_than - 1) // r + 1)] for r in rows]


def farthest_plans(candidates: Plan, distances: Matrix) -> list[Plan]:
    """The first 1, 2, … of the farthest points. distances : (k, k), and the norms on their diagonal."""
    apart = distances - np.diag(np.diag(distances))
    order = [int(np.argmax(np.diag(distances)))]
    while len(order) < len(candidates):
        order.append(int(np.argmax(apart[:, order].min(axis=1))))
    return [tuple(sorted(candidates[k] for k in order[: count + 1])) for count in range(len(order))]


def bisected(plans: Sequence[Plan], enough_mm: float, whole: Callable[[Plan], Step]) -> list[Step]:
    """The plans tried to find the first whose gap is enough, by bisection: as if gaps shrank along them."""
    tried, low, high = [], 0, len(plans) - 1
    while low <= high:
        middle = (low + high) // 2
        tried.append(whole(plans[middle]))
        if tried[-1].gap_mm <= enough_mm:
            high = middle - 1
        else:
            low = middle + 1
    return tried
