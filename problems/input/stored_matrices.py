"""A user's matrices, read and checked once, then from the cache."""

from __future__ import annotations

import time
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from problems.forms.alteration import Alteration
from problems.forms.assembly import Assembly, LoadCase
from problems.stiffness.operator import Stiffness
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from . import user_matrices

ALTERED = tuple(field.name for field in fields(Alteration))
PARTS = ("data", "indices", "indptr")
SMALL = 2000  # unknowns up to which a K is solved in the dense forms


def stored_matrices(
    files: dict[str, Path], files_key: str, sparse: bool
) -> tuple[Assembly, LoadCase, float, str]:
    """The assembly, its blocks dense and memory-mapped or `sparse`, the load case, the seconds that reading
    took, and the key.

    files_key : a hash of the files' content. Raises InputError.
    """
    code = fingerprint([Path(__file__), Path(user_matrices.__file__)])
    key = cache.digest("own", files_key, sparse, code)

    def made() -> cache.Entry:
        start = time.perf_counter()
        assembly, load = user_matrices.read_matrices(files, sparse)
        arrays, facts = _packed(assembly, load, sparse)
        return arrays, facts | {"seconds": time.perf_counter() - start}

    arrays, facts = cache.load_or_make(key, made)
    nodes = arrays.get("nodes")
    blocks = [_matrix(arrays, "K")] if sparse else [arrays[f"K{k}"] for k in range(len(facts["parts"]))]
    altered = Alteration(*(arrays[f"altered_{name}"] for name in ALTERED)) if facts["altered"] else None
    A = _matrix(arrays, "A", facts["shape"])
    assembly = Assembly(Stiffness.of(*blocks, nodes=nodes), A, nodes, tuple(facts["parts"]), altered)
    return assembly, LoadCase(np.array(arrays["f"]), np.array(arrays["g"])), facts["seconds"], key


def holds_sparse(files: dict[str, Path]) -> bool:
    """Whether K is stored as a sparse matrix, and large; a file that cannot be read does not."""
    try:
        if "problem" in files:
            with np.load(files["problem"]) as archive:
                return "K_shape" in archive.files and archive["K_shape"][0] > SMALL
        rows, _, _, layout, _, _ = scipy.io.mminfo(files["K"])
        return bool(layout == "coordinate" and rows > SMALL)
    except Exception:  # zipfile, pickle and mminfo raise their own kinds; whoever reads it says what is wrong
        return False


def _packed(assembly: Assembly, load: LoadCase, sparse: bool) -> cache.Entry:
    arrays: dict[str, Any] = {f"A_{part}": getattr(assembly.A, part) for part in PARTS}
    arrays |= {"f": load.f, "g": load.g}
    if assembly.nodes is not None:
        arrays["nodes"] = assembly.nodes
    if sparse:
        arrays |= {f"K_{part}": getattr(assembly.K.matrix, part) for part in PARTS}
    else:
        arrays |= {f"K{k}": block.matrix for k, block in enumerate(assembly.K.blocks)}
    if assembly.altered:
        arrays |= {f"altered_{name}": getattr(assembly.altered, name) for name in ALTERED}
    return arrays, {"parts": assembly.parts, "shape": assembly.A.shape, "altered": bool(assembly.altered)}


def _matrix(arrays: Any, name: str, shape: Any = None) -> sp.csc_array:
    data, indices, indptr = (np.array(arrays[f"{name}_{part}"]) for part in PARTS)
    return sp.csc_array((data, indices, indptr), shape=shape or (len(indptr) - 1,) * 2)
