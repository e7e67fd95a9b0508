"""Files of matrices: several in one .npz, or one in Matrix Market's format; and the apparent precision of a
matrix's entries, with its effect on the displacements.

In an .npz a sparse matrix X is its compressed columns, X_data, X_indices, X_indptr and X_shape; SciPy's own
files of one sparse matrix are read too.
"""

import io
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Vector
from problems.forms.prepared import Prepared

from .entries import from_entries, refuse_twice
from .text_files import read_bytes

PARTS = ("data", "indices", "indptr", "shape")
MIB = 16_384  # of a text file of one matrix
CHUNK = 2**20  # bytes of lines that are checked at once
INTEGER = rb"[-+]?+\d++"
REAL = rb"(?:[-+]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?+\d++)?+|[-+]?+(?i:nan|inf(?:inity)?+))"
#: The number of an entry, by the field in the header.
NUMBER = {"real": REAL, "double": REAL, "integer": INTEGER, "unsigned-integer": INTEGER}
#: By the symmetry in the header, the sign with which (i, j) stands for (j, i), too.
SIGNS = {"general": None, "symmetric": 1, "hermitian": 1, "skew-symmetric": -1}
BANNER = "%%matrixmarket"
LAYOUTS = {"coordinate": 2, "array": 1}  # spaces in the line of sizes
Choose = Callable[[Sequence[str]], Sequence[str]]


def damage(error: Exception) -> str:
    """What is wrong with a file, in words: without Python's, which a library raises for whatever it meets."""
    plain = isinstance(error, ValueError | OSError | Warning) and not isinstance(error, UnicodeError)
    if not plain or any(words in str(error) for words in ("invalid literal", "pickled")):
        return "damaged, or of another format"
    return getattr(error, "strerror", None) or str(error)


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


def read(path: Path, choose: Choose, expected: Sequence[str]) -> dict[str, Any]:
    """The arrays of a file that are chosen from all names in it; SciPy's matrix is named by the file's stem.

    expected : names that are there whatever they hold; others need numbers, and a dimension.
    Raises ValueError if the parts of a sparse matrix do not fit together, InputError if one lists an entry
    twice, and what NumPy and zipfile raise.
    """
    with np.load(path) as archive:
        files = set(archive.files)
        if {"format", "shape", "data"} <= files and not files & set(expected):
            M = {path.stem: sp.load_npz(path)}
            found = {name: M[name] for name in choose(list(M))}
        else:
            stems = [name.removesuffix("_indptr") for name in archive.files if name.endswith("_indptr")]
            stems = [name for name in stems if all(f"{name}_{part}" in files for part in PARTS)]
            parts = {f"{name}_{part}" for name in stems for part in PARTS}
            plain = [name for name in archive.files if name not in parts]
            names = stems + [name for name in plain if name in expected or _numeric(archive, name)]
            found = {
                name: unpacked(archive, name) if name in stems else archive[name] for name in choose(names)
            }
    for name, M in found.items():
        if sp.issparse(M):
            _refuse_damaged(name, M)
            refuse_twice(path, name, M)
    return found


def _numeric(archive: Any, name: str) -> bool:
    """Whether an array has numbers and a dimension."""
    try:
        return bool(archive[name].dtype.kind in "fiubc" and archive[name].ndim)
    except ValueError:  # of objects
        return False


def _refuse_damaged(name: str, M: Any) -> None:
    if M.format in ("csc", "csr", "bsr"):
        M.check_format(full_check=True)  # an index out of range would end the process
    elif M.format == "coo":
        for axis, (index, size) in enumerate(zip(M.coords, M.shape, strict=True)):
            if index.size and not 0 <= index.min() <= index.max() < size:
                raise ValueError(f"{name}: an index of axis {axis} is not below {size}")


def mtx_header(path: Path) -> tuple[list[str], list[int], int, bytes]:
    """Of a Matrix Market file: layout, field and symmetry, the sizes, their line, and all lines after them.

    Raises InputError.
    """
    content = read_bytes(path, "file", MIB)
    lines, number = io.BytesIO(content), 1
    banner = lines.readline()
    words = banner.decode("latin-1").lower().split()
    if words[:2] != [BANNER, "matrix"] or len(words) != 5 or words[4] not in SIGNS or words[2] not in LAYOUTS:
        _refuse_line(path, 1, banner, "the header is %%MatrixMarket matrix LAYOUT FIELD SYMMETRY")
    for number, line in enumerate(lines, start=2):
        if line.strip() and not line.startswith(b"%"):
            if not re.fullmatch(rb"\s*+\d++(?:[ \t]++\d++){%d}\s*+" % LAYOUTS[words[2]], line):
                _refuse_line(path, number, line, "the sizes are ROWS COLUMNS, and ENTRIES if coordinate")
            return words[2:], [*map(int, line.split())], number, content[lines.tell() :]
    raise InputError.one(path, "lines", number, "truncated: the line of sizes is missing")


def read_mtx(path: Path) -> Any:
    """A Matrix Market file, array or sparse.

    Raises InputError if an entry is listed twice or a line holds anything else than one entry, or ValueError
    if entries are missing, a number is out of range, or a symmetric matrix is not square. mmread would take
    missing entries for zeros, read 3,5 and 3D5 as 3, add up what is listed twice, and crash on a NUL.
    """
    (layout, field, symmetry), sizes, number, body = mtx_header(path)
    (rows, columns), sign = sizes[:2], SIGNS[symmetry]
    if sign and rows != columns:
        raise ValueError(f"{symmetry}, and not square: {rows} × {columns}")
    if field not in NUMBER:
        raise ValueError(f"{field} entries, where real numbers are needed")
    words = [NUMBER[field]]
    if layout == "coordinate":
        words = [INTEGER, INTEGER, *words]
    elif sign:  # its lower triangle, column by column
        sizes = [rows * (rows + sign) // 2, 1]
    count = sizes[-1] if layout == "coordinate" else sizes[0] * sizes[1]
    _refuse_wrong_lines(path, body, number, count, rb"[ \t]++".join(words))
    if not rows * columns:
        return np.zeros((rows, columns))
    banner = f"%%MatrixMarket matrix {layout} {field} general\n"
    header = banner + "%\n" * (number - 2) + " ".join(map(str, sizes)) + "\n"
    try:
        M = scipy.io.mmread(io.BytesIO(header.encode() + body))
    except OverflowError as error:
        raise ValueError(str(error)) from error
    if layout == "coordinate":
        return from_entries(path, (M.data, *M.coords), M.shape, partial(_line_of, body, number), sign)
    if sign:
        j, i = np.triu_indices(rows, k=int(sign < 0))
        listed, M = M.ravel(), np.zeros((rows, rows), dtype=M.dtype)
        M[i, j], M[j, i] = listed, sign * listed
    return M


def _line_of(body: bytes, before: int, k: int) -> str:
    """The line of entry k, in words."""
    filled = (number for number, line in enumerate(io.BytesIO(body), start=before + 1) if line.strip())
    return f"line {next(islice(filled, k, None))}"


def _refuse_wrong_lines(path: Path, body: bytes, before: int, entries: int, entry: bytes) -> None:
    """Raise InputError for a line that holds anything but an entry, or ValueError if there are too few."""
    line = rb"[ \t]*+(?:%b)?+[ \t]*+\n" % entry
    one, many = re.compile(line), re.compile(rb"(?:%b)*+" % line)
    file, found, number = io.BytesIO(body), 0, before
    while lines := file.readlines(CHUNK):
        lines[-1] = lines[-1].removesuffix(b"\n") + b"\n"
        if not many.fullmatch(b"".join(lines)):
            at, wrong = next((k, text) for k, text in enumerate(lines) if not one.fullmatch(text))
            _refuse_line(path, number + at + 1, wrong, "each line must hold one entry")
        found += sum(map(bool, map(bytes.strip, lines)))
        number += len(lines)
    if found < entries:
        raise ValueError(f"truncated: {found} of {entries} entries")
    if found > entries:
        key, allowed = _line_of(body, before, entries), f"at most {entries}, as the line of sizes says"
        raise InputError.one(path, key, f"entry {entries + 1}", allowed)


def _refuse_line(path: Path, number: int, line: bytes, allowed: str) -> NoReturn:
    raise InputError.one(path, f"line {number}", line.decode(errors="replace").rstrip(), allowed)


SAMPLE_SIZE = 20_000
DOUBLE, SINGLE = 16, 7  # significant digits of the two floating-point formats
FEWEST = 6  # digits that a program prints
DRAWS = 3


def apparent_digits(values: Vector) -> int:
    """The smallest d with every value equal to itself rounded to d significant digits, at most 16.

    7 if all values are in single precision, also as decimals of more digits. 16 for integers, unless all end
    in zeros after six digits or more. Examines a sample of 20 000.
    """
    v = values[values != 0]
    if len(v) > SAMPLE_SIZE:
        v = np.random.default_rng(0).choice(v, SAMPLE_SIZE, replace=False)
    digits = next((d for d in range(1, DOUBLE) if _are_rounded(v, v, d)), DOUBLE)
    with np.errstate(over="ignore"):
        single = v.astype(np.float32)
    if digits > SINGLE and _are_rounded(v, single, digits):
        return SINGLE
    exact = np.array_equal(v, np.rint(v)) and (digits < FEWEST or abs(v).max(initial=0) < 10.0**digits)
    return DOUBLE if exact else digits


def _are_rounded(values: Vector, exact: Vector, digits: int) -> bool:
    """Whether the values are exact ones rounded to so many significant digits; at 16 not rounded at all."""
    if digits == DOUBLE:
        return np.array_equal(values, exact)
    pairs = zip(values.tolist(), exact.tolist(), strict=True)
    return all(float(f"{b:.{digits - 1}e}") == a for a, b in pairs)


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
