"""Two parts with an ever wider spectrum: cond(K) from 1e6 to 1e14."""

from __future__ import annotations

from functools import partial

from problems.manufactured.exact import exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung

N = 64  # unknowns per part


def _rung(condition: float) -> Rung:
    d = spectrum(N, condition)
    return Rung(f"Two parts, cond(K) = {condition:g}", made=manufacture(exact_model(d, d), seed=1))


def _beyond(condition: float) -> Rung:
    """K is no longer exact, which does not matter because it is refused."""
    d = spectrum(N, condition)
    model = exact_model(d, d)
    made = ManufacturedProblem(model.assembly(), manufacture(exact_model(d[:1], d[:1]), seed=1).load)
    return Rung(f"Two parts, cond(K) = {condition:g}", made=made, refused="K must be positive definite")


RUNGS: Ladder = {
    **{f"{condition:.0e}": partial(_rung, condition) for condition in (1e6, 1e8, 1e10, 1e12, 1e13, 9e13)},
    "1e+16": partial(_beyond, 1e16),
}
