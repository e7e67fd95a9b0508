"""The fingerprint of the code that can change a solver's answer or its time: a row names it.

The code is the solver's own file and what it imports from the package `solvers`, and that in turn: never
another solver's. What solves in a library is told by the version of the library, beside this.
"""

from __future__ import annotations

import inspect
from pathlib import Path

from problems.storage.fingerprint import fingerprint
from solvers.base import Solver
from solvers.scaling import Scaled


def code_of(solver: Solver) -> str:
    """The fingerprint of a solver of the package, or of a user's."""
    made = [solver, solver.solver] if isinstance(solver, Scaled) else [solver]
    return fingerprint([Path(inspect.getfile(type(each))) for each in made], within=["solvers"])
