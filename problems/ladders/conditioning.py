"""Two parts with an ever wider spectrum: cond(K) from 1e6 to 1e14."""

from __future__ import annotations

from functools import partial

from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.exact import deferred, exact_assembly, spectrum, two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices


def _rung(n: int, seed: int, condition: float) -> Scene:
    return matrices(f"Two parts, cond(K) = {condition:g}", deferred(n, condition, seed))


def _beyond(condition: float) -> Scene:
    """K is no longer exact, which does not matter because it is refused."""
    d = spectrum(64, condition)
    problem = ManufacturedProblem(exact_assembly(d, d), two_parts(1, 1.0, seed=1).load)
    return matrices(f"Two parts, cond(K) = {condition:g}", problem, refused="K must be positive definite")


RUNGS: Ladder = {
    **{
        f"{condition:.0e}": partial(_rung, 128, 1, condition)
        for condition in (1e6, 1e8, 1e10, 1e12, 1e13, 9e13)
    },
    "1e+16": partial(_beyond, 1e16),
}
FULL_SIZE: Ladder = {
    f"{n}-{condition:.0e}": partial(_rung, n, 2, condition)
    for n, condition in ((4386, 1e8), (4386, 1e10), (4386, 1e11), (4386, 1e12))
}
