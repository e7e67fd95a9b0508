"""Matrices from entries as files list them: one rule for every format and for K, A, f and g.

An entry that is listed twice is refused. Where a file says that (i, j) stands for (j, i) too, both may be
listed if they agree; where it does not, a triangle alone is refused. |K_ij − K_ji| ≤ SYMMETRY · √(K_ii K_jj).
"""

import re
import warnings
from collections.abc import Callable, Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.forms.assembly import Indices

DENSEST = 0.25  # of K's entries: a denser K gains nothing from sparse storage
SYMMETRY = 1e-10  # largest |K_ij − K_ji| / √(K_ii K_jj) attributed to rounding
HELD = 1e36  # N/mm, what Abaqus writes on the diagonal for a degree of freedom that is held
Place = Callable[[int], str]
BLANK = b" \t\n\r\v\f\x1c\x1d\x1e\x1f\x85\xa0"  # what NumPy takes for a blank, too
ONCE = "each entry must be listed once"


def from_entries(
    where: object,
    entries: tuple[Any, Indices, Indices],
    shape: tuple[int, int],
    place: Place,
    sign: int | None = None,
) -> sp.csr_array:
    """The sparse matrix with these entries (values, rows, columns); entries of value 0 are kept.

    place : names entry k in messages, as its line. sign : ±1 if (i, j) stands for (j, i) too, with that sign;
    None if not. Raises InputError naming two entries at one place, or two that contradict each other.
    """
    values, i, j = entries
    M = sp.csr_array(sp.coo_array((values, (i, j)), shape=shape))
    if M.nnz < len(values):
        order = np.lexsort((j, i))
        first = np.flatnonzero((np.diff(i[order]) == 0) & (np.diff(j[order]) == 0))[0]
        at = order[first : first + 2]
        raise InputError.one(where, " and ".join(map(place, at.tolist())), values[at].tolist(), ONCE)
    if sign is not None:
        M = mirrored(M, sign)
        for row, column in contradictions(M, sign)[:1]:
            at = np.flatnonzero(((i == row) & (j == column)) | ((i == column) & (j == row)))
            allowed = "must be equal: the file says that one stands for both"
            allowed = allowed if sign == 1 else "must be opposite, and zero on the diagonal: skew-symmetric"
            raise InputError.one(where, " and ".join(map(place, at.tolist())), values[at].tolist(), allowed)
    return M


def read_entries(
    path: Path, body: bytes, lines_above: int, fields: Sequence[str], kind: type = float
) -> tuple[Any, Any, Place]:
    """The entries in lines of whole numbers and a last number, one entry per line.

    body : the rest of the file, after `lines_above` lines. Returns the whole numbers (k, …), the values (k,),
    and a function that names the line of an entry. Raises InputError naming the first line of another form.
    """
    count = len(fields) - 1

    def line_of(k: int) -> tuple[str, str]:
        numbered = enumerate(body.split(b"\n"), start=lines_above + 1)
        lines = ((number, line) for number, line in numbered if line.strip(BLANK))
        number, line = next(islice(lines, k, None))
        return f"line {number}", line.decode("latin-1").strip()

    if not body.strip(BLANK):
        return np.zeros((0, count), dtype=np.int64), np.zeros(0), str
    dtype = np.dtype([*[("places", np.int64, (count,))][:count], ("values", kind)])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # NumPy before 2.3 reads 1.5 as 1
            rows = np.loadtxt(BytesIO(body), dtype, comments=None, ndmin=1)
    except ValueError as error:  # it says "row 0, column 3", but "row 1;" of the first row if it has too few
        k, sign = re.findall(r" row (\d+)([,;])", str(error))[0]
        key, line = line_of(int(k) - (sign == ";"))
        whole = "whole numbers but the last" if kind is float else "whole numbers"
        allowed = f"each line must hold {', '.join(fields)}: {whole}, none out of range"
        raise InputError.one(path, key, line, allowed) from error
    return rows["places"] if count else None, rows["values"], lambda k: line_of(k)[0]


def refuse_twice(where: object, name: str, M: Any) -> None:
    """Raise InputError naming an entry that a sparse matrix lists twice."""
    if not getattr(M, "has_canonical_format", True):
        listed = sp.coo_array(M)
        i, j = listed.coords
        from_entries(where, (listed.data, i, j), M.shape, lambda k: f"{name}[{i[k]}, {j[k]}]")


def one_sided(K: sp.csr_array) -> bool:
    """Whether K has entries off the diagonal, but never both (i, j) and (j, i)."""
    pairs = _pattern(K).multiply(_pattern(K).T)
    return bool(pairs.nnz == np.count_nonzero(_pattern(K).diagonal()) < K.nnz)


def mirrored(M: sp.csr_array, sign: int = 1) -> sp.csr_array:
    """M with each entry that only one side of the diagonal has copied to the other side, times `sign`."""
    alone = _pattern(M) - _pattern(M).multiply(_pattern(M).T)
    return sp.csr_array(M + sign * M.multiply(alone).T)


def contradictions(K: sp.csr_array, sign: int = 1) -> list[tuple[int, int]]:
    """The pairs (i, j), i ≤ j, whose two entries differ by more than rounding, in the order of their rows."""
    apart = sp.coo_array(sp.triu(K - K.T if sign == 1 else K + K.T))  # sign * K.T would be a copy of K
    sizes = np.sqrt(abs(K.diagonal().astype(float)))
    i, j = apart.coords
    wrong = abs(apart.data) > SYMMETRY * sizes[i] * sizes[j]
    return sorted(zip(i[wrong].tolist(), j[wrong].tolist(), strict=True))


def refuse_no_stiffness(where: object, K: sp.csr_array, name: str, rows: Sequence[str] | None = None) -> None:
    """Raise InputError if K (n, n), finite, is asymmetric, or has a zero or Abaqus' mark on its diagonal.

    name, rows : the names of the matrix and of its rows in messages.
    """

    def entry(i: int, j: int) -> str:
        return f"{name}, {rows[i]}, column {rows[j]}" if rows else f"{name}[{i}, {j}]"

    pairs, held = contradictions(K), np.flatnonzero(np.isclose(K.diagonal(), HELD, rtol=1e-6, atol=0))
    faults = [
        Fault(str(where), entry(k, k), 0.0, "K needs an entry on the diagonal: is the file cut off?")
        for k in np.flatnonzero(K.diagonal() == 0).tolist()[:1]
    ]
    for i, j in pairs[:1]:
        allowed = f"K must be symmetric, both within {SYMMETRY:g} √(K_ii K_jj)"
        if one_sided(K):
            allowed += ": only a triangle is there; write both, or in a format that says that K is symmetric"
        values = [float(K[i, j]), float(K[j, i])]
        faults.append(Fault(str(where), f"{entry(i, j)} and {entry(j, i)}", values, allowed))
    if 0 < len(held) < K.shape[0]:
        allowed = "Abaqus' mark of a degree of freedom that is held: leave its row and column out"
        faults.append(Fault(str(where), entry(int(held[0]), int(held[0])), HELD, allowed))
    if faults:
        raise InputError(faults)


def _pattern(M: sp.csr_array) -> sp.csr_array:
    return sp.csr_array((np.ones(len(M.data), dtype=np.int8), M.indices, M.indptr), shape=M.shape)
