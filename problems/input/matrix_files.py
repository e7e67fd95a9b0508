"""Reads and writes files of matrices, .npz and Matrix Market, and estimates the precision of their entries.

In an .npz a sparse matrix X is its compressed columns, X_data, X_indices, X_indptr and X_shape; SciPy's own
files of one sparse matrix are read too.
"""

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Vector

from .matrix_entries import contradictions, from_entries, read_entries, refuse_twice
from .text_files import read_bytes

NUMBERS, TEXT = [*"fiubc"], [*"US"]  # kinds of the entries of arrays
PARTS = ("data", "indices", "indptr", "shape")
LARGEST_MIB = 16_384  # of a text file of one matrix
LARGEST_SIZE = 10**8  # rows or columns
KINDS = {"real": float, "double": float, "integer": np.int64, "unsigned-integer": np.uint64}
#: By the symmetry in the header, the sign with which (i, j) stands for (j, i), too.
SIGNS = {"general": None, "symmetric": 1, "hermitian": 1, "skew-symmetric": -1}
BANNER = "%%matrixmarket"
HEADER = re.compile(rf"{BANNER}\s+matrix\s+(coordinate|array)\s+(\S+)\s+({'|'.join(SIGNS)})")
#: The numbers of a line.
LAYOUTS = {"coordinate": ("row", "column", "entry"), "array": ("entry",)}
Choose = Callable[[Sequence[str]], Sequence[str]]


@contextmanager
def reading(path: Path, key: str, allowed: str) -> Iterator[None]:
    """Within it, whatever a library raises about a damaged file is an InputError, with this key."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # numpy, zipfile and others raise kinds of their own
        raise InputError.one(path, key, _damage(error), allowed) from error


def _damage(error: Exception) -> str:
    """The words for what is wrong with a file, free of the Python terms in a library's exceptions."""
    if isinstance(error, MemoryError):
        return "more than the memory holds, or damaged"
    plain = isinstance(error, ValueError | OSError | Warning) and not isinstance(error, UnicodeError)
    if not plain or any(words in str(error) for words in ("invalid literal", "pickled", "itemsize")):
        return "damaged, or of another format"
    return getattr(error, "strerror", None) or str(error)


def packed(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Arrays by name; a sparse matrix becomes its four parts."""
    flat: dict[str, Any] = {}
    for name, M in arrays.items():
        if sp.issparse(M):
            columns = sp.csc_array(M)
            flat |= {f"{name}_{part}": np.asarray(getattr(columns, part)) for part in PARTS}
        else:
            flat[name] = M
    return flat


def unpacked(arrays: Mapping[str, Any], name: str) -> sp.csc_array:
    """The sparse matrix of that name among packed arrays."""
    data, indices, indptr, shape = (np.array(arrays[f"{name}_{part}"]) for part in PARTS)
    return sp.csc_array((_supported(data), indices, indptr), shape=tuple(shape.tolist()))


def _supported(numbers: Any) -> Any:
    """Numbers as SciPy's sparse matrices take them: of this machine's byte order, none of 16 bits."""
    least = np.dtype(np.float32) if numbers.dtype.kind == "f" else numbers.dtype
    return numbers.astype(np.promote_types(numbers.dtype, least), copy=False)


def write(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays and sparse matrices, by name, into an .npz, where X_format says that X is by columns."""
    layouts = {f"{name}_format": "csc" for name, M in arrays.items() if sp.issparse(M)}
    with path.open("wb") as file:
        np.savez(file, **packed(arrays) | layouts)


def read(path: Path, choose: Choose, expected: Sequence[str]) -> dict[str, Any]:
    """Read the arrays of an .npz that `choose` picks from their names; SciPy's matrix has the file's stem.

    expected : names that are offered whatever the array holds; other arrays must hold numbers.
    Raises ValueError if the parts of a sparse matrix do not fit together, InputError if one lists an entry
    twice, and what NumPy and zipfile raise.
    """
    with np.load(path) as archive:
        files = set(archive.files)
        if {"format", "shape", "data"} <= files and not files & set(expected):
            M = {path.stem: sp.load_npz(path)}
            chosen = {name: M[name] for name in choose(list(M))}
        else:
            stems = [name.removesuffix("_indptr") for name in archive.files if name.endswith("_indptr")]
            stems = [name for name in stems if all(f"{name}_{part}" in files for part in PARTS)]
            parts = {f"{name}_{part}" for name in stems for part in PARTS}
            plain = [name for name in archive.files if name not in parts]
            for name in stems:
                if name in plain:
                    allowed = "one of the two: the matrix alone, or its four parts"
                    raise InputError.one(path, name, [name, f"{name}_data"], allowed)
                layout = f"{name}_format"
                if layout in files and (said := np.asarray(archive[layout]).astype(str).item()) != "csc":
                    allowed = f"csc: the parts are read as compressed columns; save those of {name}.tocsc()"
                    raise InputError.one(path, layout, said, allowed)
            names = stems + [name for name in plain if name in expected or _kind(archive, name) in NUMBERS]
            wanted = choose(names)
            chosen = {
                name: unpacked(archive, name) if name in stems else _supported(np.atleast_1d(archive[name]))
                for name in wanted
            }
    for name, M in chosen.items():
        if sp.issparse(M):
            _refuse_damaged(name, M)
            refuse_twice(path, name, M)
            unsaid = {f"{name}_indptr", f"{name}_format"} & files == {f"{name}_indptr"} and name != "K"
            if unsaid and M.shape[0] == M.shape[1] and contradictions(sp.csr_array(M.real, dtype=float)):
                allowed = "'csc', if the parts are its columns: a square matrix may be either"
                raise InputError.one(path, f"{name}_format", None, allowed)
    return chosen


def texts_of(path: Path) -> list[str]:
    """The names of the arrays of text in an .npz, but for the X_format of a sparse X."""
    if path.suffix.lower() != ".npz":
        return []
    with np.load(path) as archive:
        texts = [name for name in archive.files if _kind(archive, name) in TEXT]
        return [name for name in texts if f"{name.removesuffix('_format')}_indptr" not in archive.files]


def _kind(archive: Any, name: str) -> str:
    """The kind of an array's entries; "" if it has no dimension, or holds objects."""
    try:
        array = np.asarray(archive[name])  # bytes, if a file that is no array was put into it
    except ValueError:  # of objects
        return ""
    return array.dtype.kind if array.ndim else ""


def _refuse_damaged(name: str, M: Any) -> None:
    if M.format in ("csc", "csr", "bsr"):
        M.check_format(full_check=True)  # an index out of range would end the process
    elif M.format == "coo":
        for axis, (index, size) in enumerate(zip(M.coords, M.shape, strict=True)):
            if index.size and not 0 <= index.min() <= index.max() < size:
                raise ValueError(f"{name}: an index of axis {axis} is not below {size}")


def mtx_header(path: Path) -> tuple[list[str], list[int], int, bytes]:
    """The header of a Matrix Market file: layout, field and symmetry; the sizes, their line, the lines after.

    Raises InputError.
    """
    lines, number, text, words = io.BytesIO(read_bytes(path, "file", LARGEST_MIB)), 1, "", None
    allowed = "the header is %%MatrixMarket matrix LAYOUT FIELD SYMMETRY"
    for number, line in enumerate(lines, start=1):
        text = line.decode("latin-1").strip()
        if number == 1:
            if not (words := HEADER.fullmatch(text.lower())):
                break
            allowed = "the sizes are ROWS COLUMNS, and ENTRIES of a coordinate layout"
        elif words and text and not text.startswith("%"):
            sizes = [int(word) for word in text.split() if word.isdecimal()]
            if len(sizes) != len(text.split()) or len(sizes) != (3 if words[1] == "coordinate" else 2):
                break
            return [*words.groups()], sizes, number, lines.read()
    raise InputError.one(path, f"line {number}", text, allowed)


def read_mtx(path: Path) -> Any:
    """Read a Matrix Market file, as an array or a sparse matrix.

    Raises InputError for a line that does not hold one entry, or one of an entry that is listed twice, and
    ValueError if entries are missing or of another kind. SciPy's reader takes missing entries for zeros,
    reads 3,5 and 3D5 as 3, adds up what is listed twice, and crashes on a NUL.
    """
    (layout, field, symmetry), sizes, number, body = mtx_header(path)
    (rows, columns), sign = sizes[:2], SIGNS[symmetry]
    if sign and rows != columns:
        raise ValueError(f"{symmetry}, and not square: {rows} × {columns}")
    if field not in KINDS:
        raise ValueError(f"{field} entries, where real numbers are needed")
    if max(sizes[:2]) > LARGEST_SIZE:
        raise ValueError(f"{rows} × {columns} is out of range: at most {LARGEST_SIZE:g} rows and columns")
    triangle = rows * (rows + sign) // 2 if sign else rows * columns
    count = sizes[2] if layout == "coordinate" else triangle
    places, values, line = read_entries(path, body, number, LAYOUTS[layout], KINDS[field])
    if len(values) < count:
        raise ValueError(f"truncated: {len(values)} of {count} entries")
    if len(values) > count:
        raise InputError.one(path, line(count), "an entry", f"at most {count}, as the line of sizes says")
    if layout == "coordinate":
        for k in np.flatnonzero(((places < 1) | (places > sizes[:2])).any(axis=1))[:1]:
            raise InputError.one(path, line(k), places[k].tolist(), f"rows 1 … {rows}, columns 1 … {columns}")
        return from_entries(path, (values, *(places.T - 1)), (rows, columns), line, sign)
    if not sign:
        return values.reshape(columns, rows).T
    j, i = np.triu_indices(rows, k=int(sign < 0))  # the lower triangle, column by column
    M = np.zeros((rows, rows), dtype=values.dtype)
    M[i, j], M[j, i] = values, sign * values
    return M


SAMPLE_SIZE = 20_000
DOUBLE, SINGLE = 16, 7  # significant digits of the two floating-point formats
FEWEST = 6  # digits that a program prints


def apparent_digits(values: Vector) -> int:
    """The number d ≤ 16 of significant digits: the smallest d to which rounding leaves all values unchanged.

    It is 7 if all values are in single precision, also as decimals of more digits. It is 16 for integers,
    unless all end in zeros after six digits or more. A sample of 20 000 values is examined.
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
    """Whether rounding `exact` to so many significant digits gives the values; 16 digits are no rounding."""
    if digits == DOUBLE:
        return np.array_equal(values, exact)
    pairs = zip(values.tolist(), exact.tolist(), strict=True)
    return all(float(f"{b:.{digits - 1}e}") == a for a, b in pairs)
