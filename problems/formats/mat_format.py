"""MATLAB's .mat as the Maros and Mészáros test set has it: min ½xᵀPx + qᵀx + r, l ≤ Ax ≤ u.

The bounds of the unknowns are rows of A, as in the files of qpbenchmark. r does not change x.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.errors import InputError
from problems.formats import Data
from problems.input import sparse_npz

from . import mat_arrays
from .rows_and_bounds import INFINITE, contact_problem

DESCRIPTION = "a file .mat with P, q, r, A, l, u (Maros and Mészáros), bit for bit"
SUFFIXES = (".mat",)
NEEDED = ("P", "q", "A", "l", "u")


def write(path: Path, data: Data) -> None:
    n, m = data["A"].shape
    columns = {"q": -data["f"], "l": np.full(m, -INFINITE), "u": data["g"]}
    arrays = {name: values[:, None] for name, values in columns.items()}
    arrays |= {"P": sp.csc_matrix(data["K"]), "A": sp.csc_matrix(data["A"].T)}
    with path.open("wb") as file:
        scipy.io.savemat(file, arrays | {"r": 0.0, "n": float(n), "m": float(m)})


def read(path: Path) -> Data:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "arrays.npz"
        words = [sys.executable, "-P", mat_arrays.__file__, str(path.resolve()), str(out), *NEEDED]
        done = subprocess.run(words, capture_output=True, text=True, errors="replace")
        if done.returncode:
            raise ValueError((done.stderr.strip().splitlines() or ["SciPy's reader crashed"])[-1])
        found = sparse_npz.read(out, (*NEEDED, "names"))
    missing = [name for name in NEEDED if name not in found]
    if missing:
        allowed = f"P, q, A, l and u; {', '.join(missing)} missing"
        raise InputError.one(path, "arrays", found["names"].tolist(), allowed)
    return contact_problem(path, *(found[name] for name in NEEDED))
