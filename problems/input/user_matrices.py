"""A user's own K, A, f, g: from one .npz, from Matrix Market files, or as arrays."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.forms.alteration import Alteration
from problems.forms.assembly import Assembly, LoadCase
from problems.stiffness.operator import Stiffness, dense_blocks

from . import sparse_npz
from .bounded import LARGEST

U = 2.0**-53  # relative rounding error of float64
SCALE = 1e50  # of K and of each contact; beyond it products such as AᵀK⁻¹A overflow or underflow
LONGEST_LINE = 60  # characters quoted in a message
SYMMETRY = 1e-10  # largest |K − Kᵀ| / max|K| attributed to rounding


def read_matrices(files: dict[str, Path], sparse: bool = False) -> tuple[Assembly, LoadCase]:
    """Read and check K, A, f, g.

    files : {"problem": x.npz} with arrays K (n, n), A (n, m), f (n,), g (m,) and optionally
        nodes (n, 2); or {"K": …, "A": …, "f": …, "g": …} Matrix Market files (.mtx).
    K is one `sparse` block, or a few dense ones, of bodies. What does not fit into float64
    is rounded, and K that is not quite symmetric is replaced by (K + Kᵀ)/2; `Assembly.altered` bounds the
    differences. Raises InputError with all faults.
    """
    where = {key: str(path) for key, path in files.items()}
    if "problem" in files:
        data = _read_npz(files["problem"])
        where = {key: str(files["problem"]) for key in (*"KAfg", "nodes")}
    else:
        data = {key: _read_mtx(path, key) for key, path in files.items()}
    return checked(data, where, sparse)


def checked(
    data: Mapping[str, Any], where: Mapping[str, str], sparse: bool = False
) -> tuple[Assembly, LoadCase]:
    """K, A (dense or sparse), f, g and perhaps nodes as an assembly and a load case.

    where : the file or the argument that each comes from. Raises InputError with all faults.
    """
    faults = [Fault(where.get(key, "matrices"), key, None, "is missing") for key in "KAfg" if key not in data]
    if faults:
        raise InputError(faults)
    for key, values in data.items():
        if values.dtype.kind not in "fiub" or (key in "KA" and values.ndim != 2):
            found = f"{values.dtype} array of shape {values.shape}"
            faults.append(
                Fault(where.get(key, "matrices"), key, found, "real numbers; K and A must be matrices")
            )
    if faults:
        raise InputError(faults)
    K, A = (sp.csr_array(data[key], dtype=float) for key in "KA")
    f, g = (np.asarray(data[key], dtype=float).ravel() for key in "fg")
    nodes = np.asarray(data["nodes"], dtype=float) if "nodes" in data else None

    n, m = K.shape[0], A.shape[1]
    if n == 0:
        raise InputError.one(where["K"], "K.shape", K.shape, "at least one unknown")
    shapes = {"K": (K.shape, (n, n)), "A": (A.shape, (n, m)), "f": (f.shape, (n,)), "g": (g.shape, (m,))}
    if nodes is not None:
        shapes["nodes"] = (nodes.shape, (n, 2))
    for key, (found, wanted) in shapes.items():
        if found != wanted:
            faults.append(Fault(where[key], f"{key}.shape", found, f"must be {wanted}"))
    for key, values in {"K": K.data, "A": A.data, "f": f, "g": g}.items():
        if not np.isfinite(values).all():
            faults.append(Fault(where[key], key, "NaN or infinity", "every entry must be finite"))
    if nodes is not None and not (abs(nodes) <= LARGEST).all():
        faults.append(Fault(where["nodes"], "nodes", "NaN or too far away", f"mm, at most {LARGEST:g}"))
    if faults:
        raise InputError(faults)
    untouched = np.flatnonzero(abs(A).sum(axis=0) == 0)
    if untouched.size:
        raise InputError.one(where["A"], f"A[:, {untouched[0]}]", 0.0, "each contact must involve an unknown")
    for key, sizes in {"K": [abs(K).max()], "A": abs(A).max(axis=0).toarray() if m else []}.items():
        if wrong := [float(size) for size in sizes if not 1 / SCALE <= size <= SCALE]:
            allowed = f"must be between {1 / SCALE:g} and {SCALE:g}: choose other units"
            faults.append(Fault(where[key], f"max|{key}|", wrong[0], allowed))
    if faults:
        raise InputError(faults)
    skew = abs(K - K.T).max()
    asymmetry = skew / max(abs(K).max(), np.finfo(float).tiny)
    if asymmetry > SYMMETRY:
        raise InputError.one(where["K"], "max|K − Kᵀ| / max|K|", float(asymmetry), f"must be ≤ {SYMMETRY:g}")
    off_K, off_A, off_f, off_g = (
        _rounding(data[key], v) for key, v in {"K": K, "A": A, "f": f, "g": g}.items()
    )
    K.eliminate_zeros()
    if skew:
        given, K = K, sp.csr_array(K / 2 + K.T / 2)
        off_K = off_K + abs(K - given)
        off_K = off_K.maximum(off_K.T)
    sums = (off_K.sum(1), off_A.sum(1), off_A.sum(0), off_f.sum(1), off_g.sum(1))
    above = 1 + 2 * max(n, m, 4) * U  # for rounding in these sums themselves
    altered = Alteration(*(above * np.asarray(each, dtype=float).ravel() for each in sums))
    made = Stiffness.of(*([sp.csc_array(K)] if sparse else dense_blocks(K)), nodes=nodes)
    names = tuple(f"part {k + 1}" for k in range(len(made.blocks)))
    return Assembly(made, sp.csc_array(A), nodes, names, altered if altered else None), LoadCase(f, g)


def _rounding(given: Any, read: Any) -> sp.csr_array:
    """|given − read| from above, where `read` is what was given in float64; f and g as columns."""
    shape = (read.shape[0], read.shape[1] if read.ndim == 2 else 1)
    if not sp.issparse(given):
        if given.dtype.kind == "b" or given.dtype in (np.float16, np.float32, np.float64):
            return sp.csr_array(shape)
        given = np.asarray(given).reshape(shape)
    values = sp.coo_array(given)
    exact, rounded = values.data, values.data.astype(float)
    lost = np.zeros(len(exact))
    if exact.dtype.kind == "f":  # extended precision, if the machine has it
        difference = abs(exact - rounded.astype(exact.dtype))
        lost[difference > 0] = np.nextafter(difference[difference > 0].astype(float), np.inf)
    elif exact.dtype.kind in "iu":
        with np.errstate(invalid="ignore"):
            same = (abs(rounded) < 2.0**63) & (rounded.astype(exact.dtype) == exact)
        lost[~same] = U * abs(rounded[~same])
    count, size, off = (
        sp.csr_array(sp.coo_array((v, values.coords), shape=shape))
        for v in (lost * 0 + 1, abs(rounded), lost)
    )
    count.data -= 1  # entries that are given several times are added
    off = sp.csr_array(off + 2 * U * count.multiply(size))
    off.eliminate_zeros()
    return off


def _read_npz(path: Path) -> dict[str, Any]:
    try:
        return sparse_npz.read(path, (*"KAfg", "nodes"))
    except (OSError, ValueError, EOFError, KeyError) as error:
        raise InputError.one(path, "file", str(error), "a readable .npz with K, A, f, g") from error
    except Exception as error:  # zipfile and pickle raise their own kinds
        raise InputError.one(path, "file", repr(error), "a readable .npz with K, A, f, g") from error


def _read_mtx(path: Path, key: str) -> Any:
    try:
        found = read_mtx(path)
        return found.toarray() if sp.issparse(found) and key in "fg" else found
    except (OSError, ValueError) as error:
        raise InputError.one(path, key, str(error), "a readable Matrix Market file") from error


Kind = Callable[[bytes], float]  # int or float
CHUNK = 2**20  # bytes of lines that are checked at once
#: Most lines of most files: two indices and a decimal number, or a number alone.
PLAIN = {
    "coordinate": re.compile(rb"(?:\d++ ++\d++ ++[-+]?+\d++(?:\.\d*+)?+(?:[eE][-+]?+\d++)?+\n)++"),
    "array": re.compile(rb"(?:[-+]?+\d++(?:\.\d*+)?+(?:[eE][-+]?+\d++)?+\n)++"),
}


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
        if layout == "array":
            entries = rows * columns if symmetry == "general" else rows * (rows + 1) // 2
        _refuse_wrong_lines(path, entries, layout, field)
        return scipy.io.mmread(path) if rows * columns else np.zeros((rows, columns))
    except OverflowError as error:
        raise ValueError(str(error)) from error


def _refuse_wrong_lines(path: Path, entries: int, layout: str, field: str) -> None:
    """Raise ValueError unless the lines after the sizes are `entries` entries, with indices if sparse."""
    values: dict[str, list[Kind]] = {"pattern": [], "integer": [int], "complex": [float, float]}
    kinds = ([int, int] if layout == "coordinate" else []) + values.get(field, [float])
    found, before = -1, 0  # the size line is none
    with path.open("rb") as file:
        while lines := file.readlines(CHUNK):
            if found >= 0 and field == "real" and PLAIN[layout].fullmatch(b"".join(lines)):
                found, before = found + len(lines), before + len(lines)
                continue
            for number, line in enumerate(lines, start=before + 1):
                words = line.split()
                if not words or line.startswith(b"%"):
                    continue
                found += 1
                if found:
                    _refuse_wrong_line(number, line, words, kinds)
            before += len(lines)
    if found != entries:
        raise ValueError(f"truncated: {found} of {entries} entries")


def _refuse_wrong_line(number: int, line: bytes, words: list[bytes], kinds: list[Kind]) -> None:
    try:
        for kind, word in zip(kinds, words, strict=True):
            kind(word)
        if b"_" in line:
            raise ValueError
    except ValueError:
        text = line[:LONGEST_LINE].decode(errors="replace").rstrip()
        raise ValueError(f"line {number}: {text!r}; each line must hold one entry") from None
