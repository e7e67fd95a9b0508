"""Files of matrices: several in one .npz, or one in Matrix Market's format; and the apparent precision of a
matrix's entries, with its effect on the displacements.

In an .npz a sparse matrix X is its compressed columns, X_data, X_indices, X_indptr and X_shape; SciPy's own
files of one sparse matrix are read too.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.forms.prepared import Prepared

PARTS = ("data", "indices", "indptr", "shape")
LONGEST_LINE = 60  # characters quoted in a message
CHUNK = 2**20  # bytes of lines that are checked at once
INTEGER = rb"[-+]?+\d++"
REAL = rb"(?:[-+]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?+\d++)?+|[-+]?+(?i:nan|inf(?:inity)?+))"
#: The number of an entry, by the field in the header.
NUMBER = {"real": [REAL], "double": [REAL], "complex": [REAL, REAL], "integer": [INTEGER], "pattern": []}


def packed(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Arrays by name, of sparse matrices their parts."""
    found: dict[str, Any] = {}
    for name, M in arrays.items():
        if sp.issparse(M):
            columns = sp.csc_array(M)
            found |= {f"{name}_{part}": np.asarray(getattr(columns, part)) for part in PARTS}
        else:
            found[name] = M
    return found


def unpacked(arrays: Mapping[str, Any], name: str) -> sp.csc_array:
    """The sparse matrix of that name among packed arrays."""
    data, indices, indptr, shape = (np.array(arrays[f"{name}_{part}"]) for part in PARTS)
    return sp.csc_array((data, indices, indptr), shape=tuple(shape.tolist()))


def write(path: Path, arrays: Mapping[str, Any]) -> None:
    """Arrays and sparse matrices by name."""
    with path.open("wb") as file:
        np.savez(file, **packed(arrays))


def read(path: Path, names: Sequence[str]) -> dict[str, Any]:
    """Those of the names that are there; the only matrix of a file of SciPy's is named by the file's stem.

    Raises ValueError if the parts of a sparse matrix do not fit together, and what NumPy and zipfile raise.
    """
    found: dict[str, Any] = {}
    with np.load(path) as archive:
        for name in names:
            if name in archive.files:
                found[name] = archive[name]
            elif all(f"{name}_{part}" in archive.files for part in PARTS):
                found[name] = unpacked(archive, name)
        of_scipy = {"format", "shape", "data"} <= set(archive.files)
    if not found and of_scipy:
        found[path.stem] = sp.load_npz(path)
    for name, M in found.items():
        if sp.issparse(M):
            _refuse_damaged(name, M)
    return found


def _refuse_damaged(name: str, M: Any) -> None:
    if M.format in ("csc", "csr", "bsr"):
        M.check_format(full_check=True)  # an index out of range would end the process
    elif M.format == "coo":
        for axis, (index, size) in enumerate(zip(M.coords, M.shape, strict=True)):
            if index.size and not 0 <= index.min() <= index.max() < size:
                raise ValueError(f"{name}: an index of axis {axis} is not below {size}")


def read_mtx(path: Path) -> Any:
    """A Matrix Market file, array or sparse.

    Raises ValueError if entries are missing, a line holds anything else than one entry, a number is out of
    range, or a symmetric matrix is not square. mmread would take missing entries for zeros, read 3,5 and 3D5
    as 3, and crash on a NUL, on an array without entries, and on a symmetric one that is not square.
    """
    try:
        rows, columns, entries, layout, field, symmetry = scipy.io.mminfo(path)
        if symmetry != "general" and rows != columns:
            raise ValueError(f"{symmetry}, and not square: {rows} × {columns}")
        words = NUMBER[field]
        if layout == "array":
            entries = rows * columns if symmetry == "general" else rows * (rows + 1) // 2
        else:
            words = [INTEGER, INTEGER, *words]
        _refuse_wrong_lines(path, entries, rb"[ \t]++".join(words))
        return scipy.io.mmread(path) if rows * columns else np.zeros((rows, columns))
    except OverflowError as error:
        raise ValueError(str(error)) from error


def _refuse_wrong_lines(path: Path, entries: int, entry: bytes) -> None:
    """Raise ValueError unless the lines after the sizes are `entries` times `entry`, or empty."""
    line = rb"[ \t]*+(?:%b)?+[ \t\r]*+\n" % entry
    one, many = re.compile(line), re.compile(rb"(?:%b)*+" % line)
    with path.open("rb") as file:
        before = 1 + next(k for k, text in enumerate(file) if text.strip() and not text.startswith(b"%"))
        found = 0
        while lines := file.readlines(CHUNK):
            lines[-1] = lines[-1].removesuffix(b"\n") + b"\n"
            if not many.fullmatch(b"".join(lines)):
                number, wrong = next((k, text) for k, text in enumerate(lines) if not one.fullmatch(text))
                text = wrong[:LONGEST_LINE].decode(errors="replace").rstrip()
                raise ValueError(f"line {before + number + 1}: {text!r}; each line must hold one entry")
            found += sum(map(bool, map(bytes.strip, lines)))
            before += len(lines)
    if found != entries:
        raise ValueError(f"truncated: {found} of {entries} entries")


SAMPLE_SIZE = 20_000
DOUBLE, SINGLE = 16, 7  # significant digits of the two floating-point formats
DRAWS = 3


def apparent_digits(values: Vector) -> int:
    """The smallest d with every value equal to itself rounded to d significant digits, at most 16.

    7 if all values are in single precision. Examines a sample of 20 000.
    """
    v = values[values != 0]
    if len(v) > SAMPLE_SIZE:
        v = np.random.default_rng(0).choice(v, SAMPLE_SIZE, replace=False)
    some = v.tolist()
    for d in range(1, DOUBLE):
        if all(float(f"{value:.{d - 1}e}") == value for value in some):
            return d
    return SINGLE if np.array_equal(v, v.astype(np.float32)) else DOUBLE


def expected_error(prepared: Prepared, x: Vector, lam: Vector, digits: int) -> float:
    """max|δx|, mm, caused by rounding K to `digits` significant digits, to first order.

    δx = (K⁻¹ − K⁻¹A_C Q_CC⁻¹ A_CᵀK⁻¹) δK x with C the closed contacts, λ > 0, and δK symmetric, each entry
    uniform within half a unit of its last digit; the largest of three random draws.
    """
    assembly = prepared.assembly
    random = np.random.default_rng(0)
    closed = np.flatnonzero(lam > 0)
    A_C, Q_CC = assembly.A[:, closed], prepared.compliance.submatrix(closed).toarray()
    worst = 0.0
    for _ in range(DRAWS):
        force = np.zeros(assembly.n)
        for block, own in zip(assembly.K.blocks, assembly.K.slices, strict=True):
            upper = sp.coo_array(sp.triu(sp.coo_array(block.matrix)))
            size = 0.5 * 10.0 ** (np.floor(np.log10(abs(upper.data))) + 1 - digits)
            drawn = sp.csr_array(
                (random.uniform(-1, 1, size.shape) * size, upper.coords), shape=block.matrix.shape
            )
            force[own] = (drawn + sp.triu(drawn, 1).T) @ x[own]
        dx = assembly.K.solve(force)
        if closed.size:
            dx -= assembly.K.solve(A_C @ np.linalg.solve(Q_CC, A_C.T @ dx))
        worst = max(worst, float(abs(dx).max(initial=0.0)))
    return worst
