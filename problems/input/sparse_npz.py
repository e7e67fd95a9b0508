"""Arrays and sparse matrices in one .npz: of a sparse matrix X, the compressed columns as X_data, X_indices,
X_indptr and X_shape; SciPy's own files of one sparse matrix are read too.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

PARTS = ("data", "indices", "indptr", "shape")


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
