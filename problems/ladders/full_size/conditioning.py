"""Two parts with an ever wider spectrum at full size, made from their answer without rounding."""

from __future__ import annotations

from functools import partial

from problems.forms.manufactured_problem import DeferredProblem
from problems.manufactured.exact import Shares
from problems.manufactured.ladder import Ladder, Rung

from .degeneracy import touching


def _rung(n: int, condition: float) -> Rung:
    size = n // 2
    problem = DeferredProblem((size, size), size, partial(touching, size, condition, Shares()))
    return Rung(f"Two parts, cond(K) = {condition:g}, n = {n}", made=problem)


RUNGS: Ladder = {
    f"{n}-{condition:.0e}": partial(_rung, n, condition)
    for n, condition in ((4386, 1e8), (4386, 1e10), (4386, 1e11), (4386, 1e12))
}
