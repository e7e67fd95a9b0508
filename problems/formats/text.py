"""Matrices as text: Matrix Market, and Abaqus' as *MATRIX OUTPUT writes it.

Matrix Market is a folder with K.mtx, A.mtx, f.mtx, g.mtx; 17 digits keep every bit. Abaqus has no text format
for A, f, g, which stay Matrix Market files; its stiffness are lines of numbers, one triangle of K or both:

    row node, row dof, column node, column dof, value      FORMAT=MATRIX INPUT
    row, column, value                                     FORMAT=COORDINATE
"""

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.input.matrix_files import read_mtx

HEADER = b"%%MatrixMarket"
NORMAL = 3  # the degree of freedom under which displacements are written to Abaqus


def is_matrix_market(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(HEADER)) == HEADER


def write_matrix_market(path: Path, data: dict[str, Any]) -> None:
    path.mkdir(parents=True, exist_ok=True)
    for name in "KAfg":
        if name in data:
            matrix = data[name] if name in "KA" else data[name][:, None]
            write_one(path / f"{name}.mtx", matrix, "symmetric" if name == "K" else "general")


def write_one(path: Path, matrix: object, symmetry: str) -> None:
    if isinstance(matrix, np.ndarray) and not matrix.size:
        matrix = sp.coo_array(matrix)  # of an empty array, SciPy before 1.17 writes without end
    scipy.io.mmwrite(path, matrix, precision=17, symmetry=symmetry)


def read_matrix_market(path: Path) -> dict[str, Any]:
    return {path.stem: read_mtx(path)}


def write_abaqus(path: Path, data: dict[str, Any]) -> None:
    write_matrix_market(path, {name: data[name] for name in "Afg"})
    lower = sp.coo_array(sp.tril(data["K"]))
    lines = (
        f"{i + 1},{NORMAL},{j + 1},{NORMAL},{value!r}\n"
        for i, j, value in zip(*lower.coords, lower.data.tolist(), strict=True)
    )
    with (path / "K.mtx").open("w", encoding="ascii") as file:
        file.writelines(lines)


def read_abaqus(path: Path) -> dict[str, Any]:
    return {path.stem: labelled_abaqus(path)[0]}


def labelled_abaqus(path: Path) -> tuple[sp.csr_array, np.ndarray | None]:
    """K, and (n, 2) the node and degree of freedom of each row where the file says them."""
    rows = _rows(path)
    unknowns, place = np.unique(np.vstack(np.hsplit(rows[:, :-1], 2)), axis=0, return_inverse=True)
    i, j = place.reshape(2, -1)
    n = len(unknowns)
    if twice := len(rows) - len(np.unique(i * n + j)):
        raise InputError.one(path, "entries that are there already", twice, "each row and column once")
    K = sp.csr_array(sp.coo_array((rows[:, -1], (i, j)), shape=(n, n)))
    if len(np.unique(np.minimum(i, j) * n + np.maximum(i, j))) == len(rows):  # one of (i, j) and (j, i)
        K = K + K.T - sp.diags_array(K.diagonal())
    labels = unknowns.astype(np.intp) if unknowns.shape[1] == 2 else None
    return sp.csr_array(K), labels


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
            elif not all(map(float.is_integer, row[:-1])):
                faults.append(Fault(str(path), f"line {number}", line.strip(), "whole numbers but the last"))
            else:
                rows.append(row)
    if not rows and not faults:
        faults.append(Fault(str(path), "lines", 0, "at least one"))
    if faults:
        raise InputError(faults)
    return np.array(rows)
