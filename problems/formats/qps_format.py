"""Quadratic MPS (.qps), as the Maros and Mészáros test set is written; numbers in 17 digits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import scipy.sparse as sp

from problems.formats import Data

from . import qps_reader

DESCRIPTION = "a file .qps (quadratic MPS), bit for bit"
SUFFIXES = (".qps", ".mps")

read = qps_reader.read


def write(path: Path, data: Data) -> None:
    path.write_text("".join(f"{line}\n" for line in _lines(data)), "ascii")


def _lines(data: Data) -> Iterator[str]:
    A, K, f, g = sp.csr_array(data["A"]), sp.coo_array(data["K"]), data["f"], data["g"]
    yield from ("NAME RIVETBENCH", "ROWS", " N OBJ", *(f" L R{j + 1}" for j in range(A.shape[1])), "COLUMNS")
    for i in range(A.shape[0]):
        yield f" X{i + 1} OBJ {-float(f[i])!r}"
        entries = slice(A.indptr[i], A.indptr[i + 1])
        for j, value in zip(A.indices[entries], A.data[entries], strict=True):
            yield f" X{i + 1} R{j + 1} {float(value)!r}"
    yield from ("RHS", *(f" RHS R{j + 1} {float(value)!r}" for j, value in enumerate(g)))
    yield from ("BOUNDS", *(f" FR BND X{i + 1}" for i in range(A.shape[0])), "QUADOBJ")
    lower = K.row >= K.col
    for i, j, value in zip(K.row[lower], K.col[lower], K.data[lower], strict=True):
        yield f" X{j + 1} X{i + 1} {float(value)!r}"
    yield "ENDATA"
