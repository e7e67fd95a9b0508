"""A user's own K, A, f, g: from one .npz, from Matrix Market files, or as arrays."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.stiffness.dense import dense_blocks
from problems.stiffness.operator import Stiffness

from . import sparse_npz
from .bounded import LARGEST
from .dependent_contacts import refuse_dependent

NAMES = ("K", "A", "f", "g", "nodes")
SCALE = 1e50  # of K and of each contact; beyond it products such as AᵀK⁻¹A overflow or underflow
LONGEST_LINE = 60  # characters quoted in a message
SYMMETRY = 1e-10  # largest |K − Kᵀ| / max|K| attributed to rounding


def read_matrices(files: dict[str, Path], sparse: bool = False) -> tuple[Assembly, LoadCase]:
    """Read and check K, A, f, g.

    files : {"problem": x.npz} with arrays K (n, n), A (n, m), f (n,), g (m,) and optionally
        nodes (n, 2); or {"K": …, "A": …, "f": …, "g": …} Matrix Market files (.mtx).
    K is one `sparse` block, or a few dense ones, of bodies. The problem is the one in the nearest float64,
    with (K + Kᵀ)/2 for a K that is symmetric but for rounding; `Assembly.notes` say so. Raises InputError
    with all faults.
    """
    data: dict[str, Any] = {}
    for key, path in files.items():
        try:
            found = sparse_npz.read(path, NAMES) if key == "problem" else {key: read_mtx(path)}
        except Exception as error:  # zipfile and pickle raise their own kinds
            kind = ".npz with K, A, f, g" if key == "problem" else "Matrix Market file"
            where = "file" if key == "problem" else key
            raise InputError.one(path, where, str(error), f"a readable {kind}") from error
        data |= found
    data |= {key: data[key].toarray() for key in "fg" if sp.issparse(data.get(key))}
    return checked(data, {key: str(files.get("problem") or files.get(key)) for key in NAMES}, sparse)


def checked(
    data: Mapping[str, Any], where: Mapping[str, str], sparse: bool = False
) -> tuple[Assembly, LoadCase]:
    """K, A (dense or sparse), f, g and perhaps nodes as an assembly and a load case.

    where : the file or the argument that each comes from. Raises InputError with all faults.
    """

    def refuse(faults: Iterable[tuple[str, str, object, str]]) -> None:
        """Raise InputError, if there are faults: matrix, key, value, what is allowed."""
        found = [Fault(where.get(matrix, "matrices"), *fault) for matrix, *fault in faults]  # type: ignore
        if found:
            raise InputError(found)

    refuse((key, key, None, "is missing") for key in "KAfg" if key not in data)
    refuse(_wrong_kinds(data))
    K, A = (sp.csr_array(data[key], dtype=float) for key in "KA")
    f, g = (np.asarray(data[key], dtype=float).ravel() for key in "fg")
    nodes = np.asarray(data["nodes"], dtype=float) if "nodes" in data else None
    refuse([("K", "K.shape", K.shape, "at least one unknown")] if K.shape[0] == 0 else [])
    refuse(_wrong_entries(K, A, f, g, nodes))
    refuse(_wrong_units(K, A))
    skew = abs(K - K.T).max()
    asymmetry = float(skew / abs(K).max())
    allowed = f"must be ≤ {SYMMETRY:g}"
    refuse([("K", "max|K − Kᵀ| / max|K|", asymmetry, allowed)] if asymmetry > SYMMETRY else [])
    notes = []
    if rounded := [key for key in "KAfg" if not _fits(data[key])]:
        notes.append(f"Numbers of {', '.join(rounded)} that float64 cannot hold were rounded to the nearest")
    K.eliminate_zeros()
    if skew:
        K = sp.csr_array(K / 2 + K.T / 2)
        notes.append(f"K, asymmetric by {skew:.1e} N/mm, was replaced by (K + Kᵀ)/2")
    A = sp.csc_array(A)
    refuse_dependent(A, where.get("A", "matrices"))
    made = Stiffness.of(*([sp.csc_array(K)] if sparse else dense_blocks(K)), nodes=nodes)
    names = tuple(f"part {k + 1}" for k in range(len(made.blocks)))
    return Assembly(made, A, nodes, names, tuple(notes)), LoadCase(f, g)


Faults = Iterator[tuple[str, str, object, str]]


def _wrong_kinds(data: Mapping[str, Any]) -> Faults:
    for key, values in data.items():
        if values.dtype.kind not in "fiub" or (key in "KA" and values.ndim != 2):
            found = f"{values.dtype} array of shape {values.shape}"
            yield key, key, found, "real numbers; K and A must be matrices"


def _wrong_entries(K: sp.csr_array, A: sp.csr_array, f: Vector, g: Vector, nodes: Matrix | None) -> Faults:
    n, m = K.shape[0], A.shape[1]
    shapes = {"K": (K.shape, (n, n)), "A": (A.shape, (n, m)), "f": (f.shape, (n,)), "g": (g.shape, (m,))}
    if nodes is not None:
        shapes["nodes"] = (nodes.shape, (n, 2))
    for key, (found, wanted) in shapes.items():
        if found != wanted:
            yield key, f"{key}.shape", found, f"must be {wanted}"
    for key, values in {"K": K.data, "A": A.data, "f": f, "g": g}.items():
        if not np.isfinite(values).all():
            yield key, key, "NaN or infinity", "every entry must be finite"
    if nodes is not None and not (abs(nodes) <= LARGEST).all():
        yield "nodes", "nodes", "NaN or too far away", f"mm, at most {LARGEST:g}"


def _wrong_units(K: sp.csr_array, A: sp.csr_array) -> Faults:
    sizes = abs(A).max(axis=0).toarray().ravel() if A.shape[1] else np.zeros(0)
    if (untouched := np.flatnonzero(sizes == 0)).size:
        yield "A", f"A[:, {untouched[0]}]", 0.0, "each contact must involve an unknown"
        return
    allowed = f"must be between {1 / SCALE:g} and {SCALE:g}: choose another unit of"
    if not 1 / SCALE <= (size := float(abs(K).max())) <= SCALE:
        yield "K", "max|K|", size, f"{allowed} force"
    if (wrong := np.flatnonzero(~((sizes >= 1 / SCALE) & (sizes <= SCALE)))).size:
        j = wrong[0]
        yield "A", f"max|A[:, {j}]|", float(sizes[j]), f"{allowed} this contact's gap"


def _fits(given: Any) -> bool:
    """Whether float64 holds each of these finite numbers exactly."""
    values = sp.coo_array(given).data if sp.issparse(given) else given
    if values.dtype == float or values.dtype.itemsize < 8:
        return True
    nearest = values.astype(float)
    if values.dtype.kind == "f":
        return bool((nearest == values).all())  # compared in the wider of the two
    inside = nearest < float(np.iinfo(values.dtype).max)  # 2⁶³ or 2⁶⁴, which would not convert back
    return bool(inside.all() and (nearest.astype(values.dtype) == values).all())


CHUNK = 2**20  # bytes of lines that are checked at once
INTEGER = rb"[-+]?+\d++"
REAL = rb"(?:[-+]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?+\d++)?+|[-+]?+(?i:nan|inf(?:inity)?+))"
#: The number of an entry, by the field in the header.
NUMBER = {"real": [REAL], "double": [REAL], "complex": [REAL, REAL], "integer": [INTEGER], "pattern": []}


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
