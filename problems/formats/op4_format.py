"""Nastran OUTPUT4, binary and in double precision, by pyyeti: matrices k, a, f, g."""

from __future__ import annotations

import warnings
from pathlib import Path

from problems.formats import Data, pyyeti, vector

DESCRIPTION = "a file .op4 (Nastran OUTPUT4, binary), bit for bit"
SUFFIXES = (".op4",)


def write(path: Path, data: Data) -> None:
    op4 = pyyeti(path).op4
    columns = {name: data[name][:, None] for name in "fg"}
    op4.OP4().write(str(path), {"k": data["K"].toarray(), "a": data["A"].toarray()} | columns, binary=True)


def read(path: Path) -> Data:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # such as a premature end
        found = pyyeti(path).op4.OP4().dctload(str(path), justmatrix=True, sparse=None)
    data = {name.upper() if name in "ka" else name: matrix for name, matrix in found.items()}
    return {name: vector(M) if name in "fg" else M for name, M in data.items()}
