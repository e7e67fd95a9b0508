"""Matrix Market: a folder with K.mtx, A.mtx, f.mtx, g.mtx; 17 digits keep every bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.formats import Data, vector
from problems.input.user_matrices import read_mtx

DESCRIPTION = "a folder of Matrix Market files, bit for bit"
SUFFIXES = (".mtx",)
HEADER = b"%%MatrixMarket"


def accepts(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(HEADER)) == HEADER


def write(path: Path, data: Data) -> None:
    path.mkdir(parents=True, exist_ok=True)
    write_one(path / "K.mtx", data["K"], "symmetric")
    write_others(path, data)


def write_others(path: Path, data: Data) -> None:
    write_one(path / "A.mtx", data["A"], "general")
    for name in "fg":
        write_one(path / f"{name}.mtx", data[name][:, None], "general")


def write_one(path: Path, matrix: object, symmetry: str) -> None:
    if isinstance(matrix, np.ndarray) and not matrix.size:
        matrix = sp.coo_array(matrix)  # of an empty array, SciPy before 1.17 writes without end
    scipy.io.mmwrite(path, matrix, precision=17, symmetry=symmetry)


def read(path: Path) -> Data:
    found = read_mtx(path)
    return {path.stem: vector(found) if path.stem in "fg" else found}
