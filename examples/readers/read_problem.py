"""Reads what `export SCENE --form FORM --with-reference --out FOLDER` wrote, and checks its solution.

python examples/readers/read_problem.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np
import scipy.io


def read_problem(folder):
    """The arrays and sparse matrices by name; columns are vectors."""
    found = {file.stem: scipy.io.mmread(file) for file in Path(folder).glob("*.mtx")}
    return {name: M.ravel() if M.shape[1] == 1 else M for name, M in found.items()}


if __name__ == "__main__":
    p = read_problem(sys.argv[1])
    if "G" in p:  # primal, sparse: Px + q + Gᵀλ = 0
        residual = p["P"] @ p["x"] + p["q"] + p["G"].T @ p["lam"]
    else:  # dual: λ ≥ 0, Pλ + q ≥ 0, one of them zero
        residual = np.minimum(p["lam"], p["P"] @ p["lam"] + p["q"])
    print(len(p["q"]), abs(residual).max())
