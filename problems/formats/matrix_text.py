"""Matrices as text: Matrix Market, and Abaqus' text of *MATRIX OUTPUT.

Matrix Market is a folder with K.mtx, A.mtx, f.mtx, g.mtx; 17 digits keep every bit. Abaqus has no text format
for A, f, g, which stay Matrix Market files; its stiffness are lines of numbers, one triangle of K or both:

    row node, row dof, column node, column dof, value      FORMAT=MATRIX INPUT
    row, column, value                                     FORMAT=COORDINATE
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.errors import InputError
from problems.input.matrix_entries import from_entries, mirrored, one_sided, read_entries
from problems.input.matrix_files import BANNER, LARGEST_MIB, Choose, read_mtx
from problems.input.text_files import read_bytes

NORMAL = 3  # the degree of freedom under which displacements are written to Abaqus
ELEMENT = re.compile(rb"(?mi)^\*[ \t]*(?:USER[ \t]*ELEMENT|MATRIX[ \t]*,[ \t]*TYPE).*$")
SCALED = re.compile(rb"(?mi)^\*[ \t]*MATRIX[ \t]*INPUT\b.*SCALE[ \t]*FACTOR.*$")
COMMENT = re.compile(rb"(?m)^\*.*$")  # and keywords, such as *MATRIX ASSEMBLE
BY_ROWS, BY_NODES = ("row", "column", "value"), ("node", "dof", "node", "dof", "value")
ASK = "*MATRIX OUTPUT, STIFFNESS, FORMAT=MATRIX INPUT or COORDINATE: ask Abaqus for that"
#: Keywords of a matrix that is not K, or not as it is listed, and what is allowed.
REFUSED = {
    ELEMENT: f"is of a user element; what is read is {ASK}",
    SCALED: "is not applied: multiply the entries by the factor, and leave it out",
}


def is_matrix_market(path: Path) -> bool:
    start = read_bytes(path, "file", LARGEST_MIB)[: len(BANNER)]
    return start.decode("latin-1").lower() == BANNER


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


def stem(path: Path) -> str:
    """The name of a file without its suffixes, as K of K.mtx.gz."""
    return Path(path.name.removesuffix(".gz")).stem


def read_matrix_market(path: Path, choose: Choose) -> dict[str, tuple[Any, np.ndarray | None]]:
    return {name: (read_mtx(path), None) for name in choose([stem(path)])}


def write_abaqus(path: Path, data: dict[str, Any]) -> None:
    write_matrix_market(path, {name: data[name] for name in "Afg"})
    lower = sp.coo_array(sp.tril(data["K"]))
    lines = (
        f"{i + 1},{NORMAL},{j + 1},{NORMAL},{value!r}\n"
        for i, j, value in zip(*lower.coords, lower.data.tolist(), strict=True)
    )
    with (path / "K.mtx").open("w", encoding="ascii") as file:
        file.writelines(lines)


def read_abaqus(path: Path, choose: Choose) -> dict[str, tuple[sp.csr_array, np.ndarray | None]]:
    """Read K, with the node and dof of each row (n, 2) if the file has labels. Raises InputError."""
    return {name: _read(path) for name in choose([stem(path)])}


def _read(path: Path) -> tuple[sp.csr_array, np.ndarray | None]:
    content = read_bytes(path, "file", LARGEST_MIB)
    for pattern, allowed in REFUSED.items():
        if found := pattern.search(content):
            number, line = content.count(b"\n", 0, found.start()) + 1, found[0].decode("latin-1")
            raise InputError.one(path, f"line {number}", line, allowed)
    body = COMMENT.sub(b"", content).replace(b",", b" ")
    by_rows = len(body.strip().partition(b"\n")[0].split()) == len(BY_ROWS)
    places, values, line_of = read_entries(path, body, 0, BY_ROWS if by_rows else BY_NODES)
    if not len(values):
        raise InputError.one(path, "lines", 0, "at least one")
    unknowns, place = np.unique(np.vstack(np.hsplit(places, 2)), axis=0, return_inverse=True)
    i, j = place.reshape(2, -1)
    n, last = len(unknowns), unknowns[-1, 0]
    if unknowns[0, 0] < 1:
        allowed = "1 or more: what is below is made by Abaqus, such as a multiplier, and no unknown of a part"
        raise InputError.one(path, "nodes or rows", int(unknowns[0, 0]), allowed)
    if by_rows and n < last:
        missing = 1 + int(np.argmax(unknowns[:, 0] != np.arange(1, n + 1)))
        raise InputError.one(path, f"row {missing}", None, f"rows are 1 … {last}, none left out")
    K = from_entries(path, (values, i, j), (n, n), line_of)
    return (mirrored(K) if one_sided(K) else K), None if by_rows else unknowns
