"""Two plates, the second ever thicker: its stiffness, and with it cond(K), grows with its cube."""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Rung, plates

from .parts import CLAMPED_PART, FASTENERS, GAP, JUNCTION


def _rung(times: int) -> Rung:
    parts = [CLAMPED_PART | {"name": "thin"}, CLAMPED_PART | {"name": "thick", "thickness": 6.0 * times}]
    title = f"A plate of 6 mm and one of {6 * times} mm"
    return plates(title, {"junction": JUNCTION, "part": parts}, GAP, FASTENERS)


RUNGS: Ladder = {f"{times:03d}": partial(_rung, times) for times in (1, 4, 10, 40, 100, 300)}
