"""The fingerprint in each row of the code that can change a solver's answer or its time.

The code is the solver's own file and what it imports from the package `solvers`, directly or indirectly;
and of a plug-in, what it imports of the user's own. The version of the library is a field of its own.
"""

from __future__ import annotations

import inspect
from pathlib import Path

from problems.storage.fingerprint import ROOT, fingerprint
from solvers.base import Solver
from solvers.plugin import own_files


def code_of(solver: Solver) -> str:
    """The fingerprint of a solver of the package, or of a plug-in."""
    file = Path(inspect.getfile(type(solver)))
    files = [file] if ROOT / "solvers" in file.parents else own_files(file)
    return fingerprint(files, within=["solvers"])
