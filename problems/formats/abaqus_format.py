"""Abaqus matrix text, as *MATRIX OUTPUT writes it: the stiffness as lines of numbers.

    row node, row dof, column node, column dof, value      FORMAT=MATRIX INPUT
    row, column, value                                     FORMAT=COORDINATE

One triangle of K or both. Abaqus has no text format for A, f, g: they become Matrix Market files beside it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.formats import Data

from . import mtx_format

DESCRIPTION = "a folder: K as Abaqus matrix text, the others as Matrix Market, bit for bit"
SUFFIXES = (".mtx",)
NORMAL = 3  # the degree of freedom under which displacements are written


def accepts(path: Path) -> bool:
    return not mtx_format.accepts(path)


def write(path: Path, data: Data) -> None:
    path.mkdir(parents=True, exist_ok=True)
    lower = sp.coo_array(sp.tril(data["K"]))
    lines = (
        f"{i + 1},{NORMAL},{j + 1},{NORMAL},{value!r}\n"
        for i, j, value in zip(*lower.coords, lower.data.tolist(), strict=True)
    )
    with (path / "K.mtx").open("w", encoding="ascii") as file:
        file.writelines(lines)
    mtx_format.write_others(path, data)


def read(path: Path) -> Data:
    rows = _rows(path)
    unknowns, place = np.unique(np.vstack(np.hsplit(rows[:, :-1], 2)), axis=0, return_inverse=True)
    i, j = place.reshape(2, -1)
    n = len(unknowns)
    K = sp.csr_array(sp.coo_array((rows[:, -1], (i, j)), shape=(n, n)))
    if sp.tril(K, -1).nnz == 0 or sp.triu(K, 1).nnz == 0:
        K = K + K.T - sp.diags_array(K.diagonal())
    return {path.stem: sp.csr_array(K)}


def _rows(path: Path) -> np.ndarray:
    """(k, 5) or (k, 3) numbers. Raises InputError with the invalid lines."""
    rows: list[list[float]] = []
    faults: list[Fault] = []
    with path.open(encoding="ascii", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if not line.strip() or line.startswith("*"):  # ** comments, *MATRIX ASSEMBLE, …
                continue
            try:
                row = [float(word) for word in line.replace(",", " ").split()]
            except ValueError:
                row = []
            if len(row) not in (3, 5) or (rows and len(row) != len(rows[0])):
                allowed = "node, dof, node, dof, value; or row, column, value; the same on every line"
                faults.append(Fault(str(path), f"line {number}", line.strip(), allowed))
            else:
                rows.append(row)
    if not rows and not faults:
        faults.append(Fault(str(path), "lines", 0, "at least one"))
    if faults:
        raise InputError(faults)
    return np.array(rows)
