"""NumPy's .npz with arrays K, A, f, g and optionally nodes: the format that scenes open.

K and A of a sparse problem are stored as compressed columns (problems/input/sparse_npz.py). A file of SciPy's
`save_npz` holds one matrix, named by the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from problems.formats import NAMES, Data
from problems.input import sparse_npz
from problems.input.stored_matrices import SMALL

DESCRIPTION = "a file .npz, bit for bit"
SUFFIXES = (".npz",)
DENSEST = 0.25  # of K's entries: a sparser one of some size is stored so


def accepts(path: Path) -> bool:
    with np.load(path) as archive:
        return "P" not in archive.files  # which qpsolvers' have


def write(path: Path, data: Data) -> None:
    n = data["K"].shape[0]
    if n <= SMALL or data["K"].nnz > DENSEST * n**2:
        data = data | {name: data[name].toarray() for name in "KA"}
    sparse_npz.write(path, data)


def read(path: Path) -> Data:
    return sparse_npz.read(path, NAMES)
