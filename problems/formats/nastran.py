"""Nastran's files by pyyeti: OUTPUT4, binary in double precision (k, a, f, g), and DMIG cards, ten digits.

DMIG: matrices K (symmetric) and A, F, G (rectangular); the unknowns are points 1 … n with component 0 (scalar
points). Cards hold no zeros, so missing rows are zeros at the points of K, and a load or gap that is zero
everywhere is not written at all. Without K in the file, a matrix must have all its rows, 1 … r, unless rows
and columns are the same points.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from problems.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd  # slow to import


def pyyeti(path: Path) -> Any:
    """pyyeti.nastran. Raises InputError if it is not installed."""
    try:
        with np.printoptions():  # which its import changes for good: text files would have 12 digits
            from pyyeti import nastran
    except ModuleNotFoundError:
        allowed = "Nastran's formats need pyyeti: pip install 'rivetbench[nastran]'"
        raise InputError.one(path, "format", path.suffix, allowed) from None
    return nastran


def write_op4(path: Path, data: dict[str, Any]) -> None:
    columns = {name: data[name][:, None] for name in "fg"}
    matrices = {"k": data["K"].toarray(), "a": data["A"].toarray()} | columns
    pyyeti(path).op4.OP4().write(str(path), matrices, binary=True)


def read_op4(path: Path) -> dict[str, Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # such as a premature end
        found = pyyeti(path).op4.OP4().dctload(str(path), justmatrix=True, sparse=None)
    return {name.upper() if name in "ka" else name: matrix for name, matrix in found.items()}


def write_dmig(path: Path, data: dict[str, Any]) -> None:
    import pandas as pd

    n, m = data["A"].shape
    if m == 0:
        allowed = "at least one: DMIG has no matrix without columns; use another format"
        raise InputError.one(path, "contacts", m, allowed)
    points, contacts, one = _points(n), _points(m), pd.Index([1])
    frames = {
        "K": pd.DataFrame(data["K"].toarray(), index=points, columns=points),
        "A": pd.DataFrame(data["A"].toarray(), index=points, columns=pd.Index(np.arange(1, m + 1))),
        "F": pd.DataFrame(data["f"][:, None], index=points, columns=one),
        "G": pd.DataFrame(data["g"][:, None], index=contacts, columns=one),
    }
    pyyeti(path).wtdmig(str(path), {name: frame for name, frame in frames.items() if frame.values.any()})


def read_dmig(path: Path) -> dict[str, Any]:
    """K, A, f, g as far as they are in the file. Raises InputError naming rows at points that K lacks."""
    found = pyyeti(path).rddmig(str(path))
    if "k" not in found:
        return {name: _whole(path, name, frame) for name, frame in found.items()}
    points = found["k"].index
    if not points.equals(found["k"].columns):
        raise InputError.one(path, "K", "other points in rows than in columns", "a square matrix")
    data = {"K": found["k"].to_numpy()}
    if "f" in found:
        data["f"] = _column(path, "F", found["f"], points)
    if "a" in found:
        A = _over(path, "A", found["a"], points)
        if stray := [column for column in map(int, A.columns) if column < 1]:
            raise InputError.one(path, f"A, column {stray[0]}", stray[0], "the contacts are 1 … m")
        contacts = np.arange(1, int(A.columns.max()) + 1)
        data["A"] = A.reindex(columns=contacts, fill_value=0.0).to_numpy()
        if "g" in found:
            data["g"] = _column(path, "G", found["g"], _points(len(contacts)), "contacts of A")
    elif "g" in found:
        data["g"] = _whole(path, "g", found["g"])
    return data


def labelled_dmig(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """K, or the only matrix of a file, and (n, 2) the point and component of each row."""
    found = pyyeti(path).rddmig(str(path))
    if "k" not in found and len(found) != 1:
        raise InputError.one(path, "matrices", list(found), "a matrix K, or one matrix alone")
    frame = found.get("k", next(iter(found.values())))
    if not frame.index.equals(frame.columns):
        raise InputError.one(path, "K", "other points in rows than in columns", "a square matrix")
    return frame.to_numpy(), np.array([*map(tuple, frame.index)], dtype=np.intp)


def _points(count: int) -> pd.MultiIndex:
    import pandas as pd

    return pd.MultiIndex.from_product([range(1, count + 1), [0]], names=["id", "dof"])


def _whole(path: Path, name: str, frame: pd.DataFrame) -> np.ndarray:
    """A matrix of a file without K: rows that are missing cannot be told from rows that are not there."""
    if not frame.index.equals(frame.columns):
        frame = _over(path, name.upper(), frame, _points(len(frame)), f"rows, as {len(frame)} are present")
    return np.asarray(frame.to_numpy())


def _over(
    path: Path, name: str, frame: pd.DataFrame, index: pd.MultiIndex, what: str = "points of K"
) -> pd.DataFrame:
    """The frame with a row for each entry of the index. Raises InputError naming rows beyond it."""
    if beyond := [row for row in frame.index if row not in index]:
        keys = [f"{name}, point {point}, component {component}" for point, component in beyond]
        raise InputError([Fault(str(path), key, "a row", f"not among the {what}") for key in keys])
    return frame.reindex(index, fill_value=0.0)


def _column(
    path: Path, name: str, frame: pd.DataFrame, index: pd.MultiIndex, what: str = "points of K"
) -> np.ndarray:
    if frame.shape[1] != 1:
        raise InputError.one(path, f"columns of {name}", frame.shape[1], "must be 1")
    return np.asarray(_over(path, name, frame, index, what).to_numpy(dtype=float))
