"""Two parts that touch at ever more contacts without a force: λᵢ = yᵢ = 0 in the answer."""

from __future__ import annotations

from functools import partial

from problems.manufactured.exact import Shares, frame, solved, spectrum
from problems.manufactured.ladder import Ladder, Rung

N = 64  # contacts
CONDITION = 1e6


def _rung(percent: int) -> Rung:
    weak = percent / 100
    d = spectrum(N, CONDITION)
    made = solved(frame(d, d), seed=2, shares=Shares(min(0.4, 1 - weak), weak))
    return Rung(f"Two parts, {percent} % of the contacts touch without a force", made=made)


RUNGS: Ladder = {f"{percent:03d}": partial(_rung, percent) for percent in (5, 10, 25, 50, 75, 100)}
