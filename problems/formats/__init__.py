"""File formats of K, A, f, g, by name; libraries are imported when a file is read or written.

Data are a dict: K (n, n) and A (n, m) sparse, f (n,), g (m,), and nodes (n, 2) if known.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.input import matrix_files
from problems.input.user_matrices import NAMES, SMALL

from . import nastran, text

Data = dict[str, Any]
Labels = np.ndarray | None
T = TypeVar("T")
DENSEST = 0.25  # of K's entries: a sparser one of some size is stored so


@dataclass(frozen=True)
class Format:
    """description : of what is written, a file or a folder of one per matrix. suffixes : of files to read.

    read : the matrices of a file by their names in it; a single one by the file's stem. accepts : whether a
    file is of this format, where another has its suffix. omits_zeros : f and g that are zero everywhere.
    labelled : K of a file, and the node and degree of freedom of each row (n, 2), None if it does not say so.
    """

    description: str
    suffixes: tuple[str, ...]
    write: Callable[[Path, Data], None]
    read: Callable[[Path], Data]
    accepts: Callable[[Path], bool] = lambda path: True
    omits_zeros: bool = False
    labelled: Callable[[Path], tuple[Any, Labels]] | None = None

    @property
    def suffix(self) -> str:
        """Of what it writes; "" if that is a folder."""
        return "" if self.description.startswith("a folder") else self.suffixes[0]


def _write_npz(path: Path, data: Data) -> None:
    """The format that scenes open; K and A of a sparse problem as compressed columns."""
    n = data["K"].shape[0]
    if n <= SMALL or data["K"].nnz > DENSEST * n**2:
        data = data | {name: data[name].toarray() for name in "KA"}
    matrix_files.write(path, data)


FORMATS = {
    "abaqus": Format(
        "a folder: K as Abaqus matrix text, the others as Matrix Market, bit for bit",
        (".mtx",),
        text.write_abaqus,
        text.read_abaqus,
        lambda path: not text.is_matrix_market(path),
        labelled=text.labelled_abaqus,
    ),
    "dmig": Format(
        "a file .pch (Nastran DMIG), 10 digits",
        (".pch", ".bdf", ".nas", ".dat"),
        nastran.write_dmig,
        nastran.read_dmig,
        omits_zeros=True,
        labelled=nastran.labelled_dmig,
    ),
    "mtx": Format(
        "a folder of Matrix Market files, bit for bit",
        (".mtx",),
        text.write_matrix_market,
        text.read_matrix_market,
        text.is_matrix_market,
    ),
    "npz": Format(
        "a file .npz, bit for bit", (".npz",), _write_npz, lambda path: matrix_files.read(path, NAMES)
    ),
    "op4": Format(
        "a file .op4 (Nastran OUTPUT4, binary), bit for bit", (".op4",), nastran.write_op4, nastran.read_op4
    ),
}


def read(path: Path) -> Data:
    """The matrices of a file, by their names in it; a file that holds one matrix names it by its stem.

    Raises InputError if it is not readable.
    """
    if not path.is_file():
        raise InputError.one(path, "file", str(path), "no such file")
    found = _read(path, format_of(path).read)
    return {name: vector(M) if name in ("f", "g") else M for name, M in found.items()}


def read_stiffness(path: Path) -> tuple[Any, Labels]:
    """K of a file, or its only matrix, and the node and degree of freedom of each row, if the file says them.

    Raises InputError.
    """
    if path.is_file() and (labelled := format_of(path).labelled):
        return _read(path, labelled)
    found = read(path)
    if "K" not in found and len(found) != 1:
        raise InputError.one(path, "matrices", list(found), "a matrix K, or one matrix alone")
    return found.get("K", next(iter(found.values()))), None


def _read(path: Path, read: Callable[[Path], T]) -> T:
    try:
        return read(path)
    except InputError:
        raise
    except Exception as error:  # of the libraries, which raise whatever a damaged file leads to
        said = f"{type(error).__name__}: {error}"
        raise InputError.one(path, "file", said, "a readable matrix file") from error


def format_of(path: Path) -> Format:
    """The format of a file, from its suffix and, if that is ambiguous, its content."""
    for each in FORMATS.values():
        if path.suffix.lower() in each.suffixes and each.accepts(path):
            return each
    allowed = ", ".join(dict.fromkeys(known for each in FORMATS.values() for known in each.suffixes))
    raise InputError.one(path, "suffix", path.suffix, allowed)


def vector(values: Any) -> np.ndarray:
    """A row or column of a matrix file, dense or sparse, as a vector."""
    return np.ravel(values.toarray() if sp.issparse(values) else values)
