"""Parts held by contact alone: K is singular, and the model refuses it."""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.exact import exact_assembly, spectrum, two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices
from problems.manufactured.plates import CLAMPED, FREE, plates

REFUSED = "K must be positive definite"


def _singular() -> Scene:
    d = spectrum(16, 1e4)
    free = np.concatenate([[0.0], d[1:]])
    problem = ManufacturedProblem(exact_assembly(d, free), two_parts(16, 1e4, seed=13).load)
    return matrices("A part that can move without strain", problem, refused=REFUSED)


_floating = partial(plates, refused=REFUSED)

RUNGS: Ladder = {
    "on-a-part": partial(
        _floating, "A free plate against a clamped one", {"clamped": CLAMPED, "floating": FREE}
    ),
    "on-a-tool": partial(
        _floating, "A free plate against a rigid tool", {"floating": FREE}, contacts=(("floating", "tool"),)
    ),
    "matrix": _singular,
}
