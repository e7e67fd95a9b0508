"""Two parts with ever more weakly active contacts: λᵢ = yᵢ = 0 in the solution."""

from __future__ import annotations

from functools import partial

from problems.manufactured.exact import deferred
from problems.manufactured.ladder import Ladder, Scene, matrices


def _rung(n: int, percent: int) -> Scene:
    weak = percent / 100
    problem = deferred(n, 1e6, seed=2, closed=min(0.4, 1 - weak), weak=weak)
    return matrices(f"Two parts, {percent} % of the contacts touch without a force", problem)


RUNGS: Ladder = {f"{percent:03d}": partial(_rung, 128, percent) for percent in (5, 10, 25, 50, 75, 100)}
FULL_SIZE: Ladder = {
    f"{n}-{percent:03d}": partial(_rung, n, percent)
    for n, percent in ((4386, 25), (4386, 50), (4386, 75), (4386, 100), (11308, 50))
}
