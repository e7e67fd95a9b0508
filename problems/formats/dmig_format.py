"""Nastran DMIG cards by pyyeti: matrices K (symmetric) and A, F, G (rectangular); ten digits per number.

The unknowns are points 1 … n with component 0 (scalar points). Cards hold no zeros, so missing rows
are zeros at the points of K, and a load or gap that is zero everywhere is not written at all. Without K in
the file, a matrix must have all its rows, 1 … r, unless rows and columns are the same points.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from problems.errors import Fault, InputError
from problems.formats import Data, pyyeti, vector

if TYPE_CHECKING:
    import pandas as pd  # slow to import

DESCRIPTION = "a file .pch (Nastran DMIG), 10 digits"
SUFFIXES = (".pch", ".bdf", ".nas", ".dat")
OMITS_ZEROS = True


def write(path: Path, data: Data) -> None:
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


def read(path: Path) -> Data:
    """K, A, f, g as far as they are in the file. Raises InputError naming rows at points that K lacks."""
    found = pyyeti(path).rddmig(str(path))
    if "k" not in found:
        return {name: _whole(path, name, frame) for name, frame in found.items()}
    points = found["k"].index
    if not points.equals(found["k"].columns):
        raise InputError.one(path, "K", "other points in rows than in columns", "a square matrix")
    data = {"K": found["k"].to_numpy()}
    if "f" in found:
        data["f"] = _vector(path, "F", found["f"], points)
    if "a" in found:
        contacts = np.arange(1, int(found["a"].columns.max()) + 1)
        A = _over(path, "A", found["a"], points)
        if stray := [column for column in map(int, A.columns) if column < 1]:
            raise InputError.one(path, f"A, column {stray[0]}", stray[0], "the contacts are 1 … m")
        data["A"] = A.reindex(columns=contacts, fill_value=0.0).to_numpy()
        if "g" in found:
            data["g"] = _vector(path, "G", found["g"], _points(len(contacts)), "contacts of A")
    elif "g" in found:
        data["g"] = _whole(path, "g", found["g"]).ravel()
    return data


def _whole(path: Path, name: str, frame: pd.DataFrame) -> np.ndarray:
    """A matrix of a file without K: rows that are missing cannot be told from rows that are not there."""
    if not frame.index.equals(frame.columns):
        frame = _over(path, name.upper(), frame, _points(len(frame)), f"rows, as {len(frame)} are present")
    return np.asarray(frame.to_numpy())


def _points(count: int) -> pd.MultiIndex:
    import pandas as pd

    return pd.MultiIndex.from_product([range(1, count + 1), [0]], names=["id", "dof"])


def _over(
    path: Path, name: str, frame: pd.DataFrame, index: pd.MultiIndex, what: str = "points of K"
) -> pd.DataFrame:
    """The frame with a row for each entry of the index. Raises InputError naming rows beyond it."""
    if beyond := [row for row in frame.index if row not in index]:
        keys = [f"{name}, point {point}, component {component}" for point, component in beyond]
        raise InputError([Fault(str(path), key, "a row", f"not among the {what}") for key in keys])
    return frame.reindex(index, fill_value=0.0)


def _vector(
    path: Path, name: str, frame: pd.DataFrame, index: pd.MultiIndex, what: str = "points of K"
) -> np.ndarray:
    if frame.shape[1] != 1:
        raise InputError.one(path, f"columns of {name}", frame.shape[1], "must be 1")
    return vector(_over(path, name, frame, index, what).to_numpy(dtype=float))
