"""Nastran DMIG cards by pyyeti: matrices K (symmetric) and A, F, G (rectangular); ten digits per number.

The unknowns are points 1 … n with component 0 (scalar points). Cards hold no zeros, so missing rows
are zeros at the points of K, and a load or gap that is zero everywhere is not written at all.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from problems.errors import InputError
from problems.formats import Data, pyyeti

if TYPE_CHECKING:
    import pandas as pd  # slow to import

DESCRIPTION = "a file .pch (Nastran DMIG), 10 digits"
SUFFIXES = (".pch", ".bdf", ".nas", ".dat")


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
    found = pyyeti(path).rddmig(str(path))
    if "k" not in found:  # other names, with the rows present
        return {name: frame.to_numpy() for name, frame in found.items()}
    points = found["k"].index
    data = {"K": found["k"].to_numpy(), "f": _column(found.get("f"), points)}
    if "a" in found:
        contacts = np.arange(1, int(found["a"].columns.max()) + 1)
        data["A"] = found["a"].reindex(index=points, columns=contacts, fill_value=0.0).to_numpy()
        data["g"] = _column(found.get("g"), _points(len(contacts)))
    return data


def _points(count: int) -> pd.MultiIndex:
    import pandas as pd

    return pd.MultiIndex.from_product([range(1, count + 1), [0]], names=["id", "dof"])


def _column(frame: Any, index: pd.MultiIndex) -> np.ndarray:
    if frame is None:
        return np.zeros(len(index))
    return np.asarray(frame.reindex(index, fill_value=0.0).to_numpy(), dtype=float).ravel()
