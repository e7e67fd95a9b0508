"""Parts held by contact alone: K is singular, and the model refuses it."""

from __future__ import annotations

import numpy as np

from problems.manufactured.exact import exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung, plates

from .parts import CLAMPED_PART, FASTENERS, GAP, JUNCTION

REFUSED = "K must be positive definite"


def _on_a_part() -> Rung:
    parts = [CLAMPED_PART | {"name": "clamped"}, {"name": "floating", "thickness": 6.0}]
    joint = {"junction": JUNCTION, "part": parts}
    return plates("A free plate against a clamped one", joint, GAP, FASTENERS, refused=REFUSED)


def _on_a_tool() -> Rung:
    part = {"name": "floating", "thickness": 6.0}
    joint = {"junction": JUNCTION, "part": [part], "contacts": (("floating", "tool"),)}
    return plates("A free plate against a rigid tool", joint, GAP, FASTENERS, refused=REFUSED)


def _singular() -> Rung:
    d = spectrum(16, 1e4)
    made = manufacture(exact_model(d, d), seed=13)
    free = np.concatenate([[0.0], d[1:]])
    made = ManufacturedProblem(exact_model(d, free).assembly(), made.load)
    return Rung("A part that can move without strain", made=made, refused=REFUSED)


RUNGS: Ladder = {"on-a-part": _on_a_part, "on-a-tool": _on_a_tool, "matrix": _singular}
