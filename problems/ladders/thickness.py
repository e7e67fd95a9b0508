"""Two plates, the second ever thicker: its stiffness, and with it cond(K), grows with its cube."""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Scene
from problems.manufactured.plates import CLAMPED, plates, wing_panel


def _rung(times: int) -> Scene:
    parts = {"thin": CLAMPED, "thick": CLAMPED | {"thickness": 6.0 * times}}
    return plates(f"A plate of 6 mm and one of {6 * times} mm", parts)


def _full_size(n: int, times: int) -> Scene:
    return wing_panel(f"A wing panel of 6 mm on a fragment of {6 * times} mm", n, thicker=times)


RUNGS: Ladder = {f"{times:03d}": partial(_rung, times) for times in (1, 4, 10, 40, 100, 300)}
FULL_SIZE: Ladder = {
    f"{n}-{times:02d}": partial(_full_size, n, times)
    for n, times in ((4386, 1), (4386, 4), (4386, 10), (4386, 30), (4386, 70), (11308, 30))
}
