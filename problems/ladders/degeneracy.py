"""Two parts with ever more weakly active contacts: λᵢ = yᵢ = 0 in the solution."""

from __future__ import annotations

from functools import partial

from problems.manufactured.exact import Shares, exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, Rung

N = 64  # contacts
CONDITION = 1e6


def _rung(percent: int) -> Rung:
    weak = percent / 100
    d = spectrum(N, CONDITION)
    made = manufacture(exact_model(d, d), seed=2, shares=Shares(min(0.4, 1 - weak), weak))
    return Rung(f"Two parts, {percent} % of the contacts touch without a force", made=made)


RUNGS: Ladder = {f"{percent:03d}": partial(_rung, percent) for percent in (5, 10, 25, 50, 75, 100)}
