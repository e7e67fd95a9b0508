"""A user's own K, A, f, g: from an .npz, Matrix Market files, or arrays; checked once, then cached."""

import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems import storage
from problems.errors import Fault, InputError
from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.stiffness.dense_block import dense_blocks
from problems.stiffness.operator import Stiffness
from problems.storage import fingerprint

from . import matrix_files
from .bounded_types import LARGEST
from .matrix_entries import DENSEST, refuse_no_stiffness

Files = Mapping[str, Path]
#: (matrix, key, value, what is allowed)
Faults = Iterable[tuple[str, str, object, str]]
NAMES = ("K", "A", "f", "g", "nodes")
SCALE = 1e50  # of K and of each contact; beyond it products such as AᵀK⁻¹A overflow or underflow
SMALL = 2000  # unknowns up to which a K is solved in the dense forms
UNCHANGED = "the file that it was when the scene was read"


def stored_matrices(files: Files, files_key: str, sparse: bool) -> tuple[Assembly, LoadCase, float, str]:
    """The assembly and the load case of files, the seconds that reading took, and the key of the assembly.

    files_key : `content_key` of the files. sparse : whether K's blocks are sparse, else dense and
    memory-mapped. Raises InputError.
    """
    code = fingerprint([Path(__file__)], within=("problems/input",))
    key = storage.digest("own", files_key, sparse, code)

    def made() -> storage.Entry:
        start = time.perf_counter()
        assembly, load = read_matrices(files, sparse)
        if content_key(files) != files_key:
            raise InputError.one(next(iter(files.values())), "matrices", "changed", UNCHANGED)
        arrays = {f"K{k}": matrix for k, matrix in enumerate(assembly.K.matrices)}
        arrays |= {"A": assembly.A, "f": load.f, "g": load.g}
        if assembly.nodes is not None:
            arrays["nodes"] = assembly.nodes
        facts = {"parts": assembly.parts, "notes": assembly.notes, "seconds": time.perf_counter() - start}
        return matrix_files.packed(arrays), facts

    arrays, facts = storage.load_or_make(key, made)
    nodes, names = arrays.get("nodes"), [f"K{k}" for k in range(len(facts["parts"]))]
    K = Stiffness.of(*(matrix_files.unpacked(arrays, k) if sparse else arrays[k] for k in names), nodes=nodes)
    A = matrix_files.unpacked(arrays, "A")
    assembly = Assembly(K, A, nodes, tuple(facts["parts"]), tuple(facts["notes"]))
    return assembly, LoadCase(np.array(arrays["f"]), np.array(arrays["g"])), facts["seconds"], key


def content_key(files: Files) -> str:
    """The hash of the content of files of matrices."""
    return storage.digest(list(files), *(path.read_bytes() for path in files.values()))


def is_large_sparse(K: Any) -> bool:
    """Whether K is stored as a sparse matrix, large and not full of entries, and stays one."""
    return bool(sp.issparse(K) and K.shape[0] > SMALL and K.nnz <= DENSEST * K.shape[0] ** 2)


def holds_sparse(files: Files) -> bool:
    """Whether K is stored as a large sparse matrix; False if the file cannot be read."""
    try:
        if "problem" in files:
            with np.load(files["problem"]) as archive:
                return "K_shape" in archive.files and archive["K_shape"][0] > SMALL
        (layout, _, _), sizes, _, _ = matrix_files.mtx_header(files["K"])
        return layout == "coordinate" and sizes[0] > SMALL
    except Exception:  # zipfile and pickle raise their own kinds; whoever reads it says what is wrong
        return False


def read_matrices(files: Files, sparse: bool = False) -> tuple[Assembly, LoadCase]:
    """Read and check K, A, f, g.

    files : {"problem": x.npz} with arrays K (n, n), A (n, m), f (n,), g (m,) and optionally
        nodes (n, 2); or {"K": …, "A": …, "f": …, "g": …} Matrix Market files (.mtx).
    K is one `sparse` block, or a few dense ones, of bodies. The problem is the one in the nearest float64,
    with (K + Kᵀ)/2 for a K that is symmetric but for rounding; `Assembly.notes` say so. Raises InputError
    with all faults.
    """
    data: dict[str, Any] = {}
    for key, path in files.items():
        one = key == "problem"
        kind, where = (".npz with K, A, f, g", "file") if one else ("Matrix Market file", key)
        with matrix_files.reading(path, where, f"a readable {kind}"):
            data |= matrix_files.read(path, list, NAMES) if one else {key: matrix_files.read_mtx(path)}
    return checked(data, {key: str(files.get("problem") or files.get(key)) for key in NAMES}, sparse)


def checked(
    data: Mapping[str, Any], where: Mapping[str, str], sparse: bool = False
) -> tuple[Assembly, LoadCase]:
    """K, A (dense or sparse), f, g and perhaps nodes as an assembly and a load case.

    where : the file or the argument of each matrix. Raises InputError with all faults.
    """

    def refuse(faults: Faults) -> None:
        if wrong := [Fault(where.get(matrix, "matrices"), *fault) for matrix, *fault in faults]:  # type: ignore
            raise InputError(wrong)

    refuse((key, key, None, "is missing") for key in "KAfg" if key not in data)
    data = {k: M.toarray() if k in ("f", "g", "nodes") and sp.issparse(M) else M for k, M in data.items()}
    refuse(_wrong_kinds(data))
    K, A = (sp.csr_array(data[key], dtype=float, copy=True) for key in "KA")
    for M in (K, A):
        M.sum_duplicates()
        M.eliminate_zeros()  # a contact is at the first unknown of its column
    f, g = (np.array(data[key], dtype=float).ravel() for key in "fg")
    nodes = np.array(data["nodes"], dtype=float) if "nodes" in data else None
    refuse([("K", "K.shape", K.shape, "at least one unknown")] if K.shape[0] == 0 else [])
    refuse(_wrong_entries(K, A, f, g, nodes))
    refuse(_wrong_units(K, A))
    strays = [key for key in data if key not in NAMES]
    refuse(_wrong_strays({key: data[key] for key in strays}, A.shape))
    refuse_no_stiffness(where.get("K", "matrices"), K, "K")
    skew = abs(K - K.T).max()
    notes = []
    if strays:
        notes.append(f"Not read: {', '.join(strays)}; a problem is K, A, f, g and nodes")
    if rounded := [key for key in "KAfg" if not _fits(data[key])]:
        notes.append(f"Numbers of {', '.join(rounded)} that float64 cannot hold were rounded to the nearest")
    if skew:
        K = sp.csr_array((K + K.T) / 2)
        notes.append(f"K, asymmetric by {skew:.1e} N/mm, was replaced by (K + Kᵀ)/2")
    A = sp.csc_array(A)
    made = Stiffness.of(*([sp.csc_array(K)] if sparse else dense_blocks(K)), nodes=nodes)
    names = tuple(f"part {k + 1}" for k in range(len(made.blocks)))
    return Assembly(made, A, nodes, names, tuple(notes)), LoadCase(f, g)


def _wrong_kinds(data: Mapping[str, Any]) -> Faults:
    for key, values in data.items():
        sides = sum(side > 1 for side in values.shape)
        if values.dtype.kind not in "fiub" or (
            values.ndim != 2 if key in "KA" else key in "fg" and sides > 1
        ):
            found = f"{values.dtype} array of shape {values.shape}"
            yield key, key, found, "real numbers; K and A must be matrices, f and g vectors"
        elif np.ma.is_masked(values):
            yield key, key, "a masked array", "a number in each place; some are masked"


def _wrong_entries(K: sp.csr_array, A: sp.csr_array, f: Vector, g: Vector, nodes: Matrix | None) -> Faults:
    n = K.shape[0]
    m = A.shape[1] if A.shape[0] == n else len(g)
    shapes = {"K": (K.shape, (n, n)), "A": (A.shape, (n, m)), "f": (f.shape, (n,)), "g": (g.shape, (m,))}
    if nodes is not None:
        shapes["nodes"] = (nodes.shape, (n, 2))
    for key, (found, wanted) in shapes.items():
        if found != wanted:
            yield key, f"{key}.shape", found, f"must be {wanted}"
    for key, values in {"K": K, "A": A, "f": f, "g": g}.items():
        listed = sp.coo_array(values)
        if (wrong := np.flatnonzero(~np.isfinite(listed.data))).size:
            at = ", ".join(str(index[wrong[0]]) for index in listed.coords)
            yield key, f"{key}[{at}]", "NaN or infinity", "every entry must be finite"
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


def _wrong_strays(data: Mapping[str, Any], shape: tuple[int, int]) -> Faults:
    """Yield the arrays that may be meant as a part of a problem with A (n, m) of this shape."""
    allowed = "is no part of a problem: a bound is a column of A with its g; take out what is not meant"
    for key, M in data.items():
        if key not in ("x", "lam") and (M.ndim == 2 or M.dtype.kind in "fc") and {*M.shape} & {*shape}:
            yield "K", key, f"array of shape {M.shape}", allowed


def _fits(numbers: Any) -> bool:
    """Whether float64 holds each of these finite numbers exactly."""
    values = sp.coo_array(numbers).data if sp.issparse(numbers) else numbers
    if values.dtype == float or values.dtype.itemsize < 8:
        return True
    nearest = values.astype(float)
    if values.dtype.kind == "f":
        return bool((nearest == values).all())  # compared in the wider of the two
    inside = nearest < float(np.iinfo(values.dtype).max)  # 2⁶³ or 2⁶⁴, which would not convert back
    return bool(inside.all() and (nearest.astype(values.dtype) == values).all())
