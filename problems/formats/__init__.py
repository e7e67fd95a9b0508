"""The file formats of K, A, f, g, by name; libraries are imported when a file is read or written.

`Data` is a dict: K (n, n) and A (n, m) sparse, f (n,), g (m,), and nodes (n, 2) if they are known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.input import matrix_files
from problems.input.matrix_entries import refuse_no_stiffness, refuse_twice
from problems.input.matrix_files import Choose
from problems.input.user_matrices import NAMES, is_large_sparse

from . import dmig, matrix_text, nastran

Data = dict[str, Any]
Labels = np.ndarray | None
Read = dict[str, tuple[Any, Labels]]


@dataclass(frozen=True)
class Format:
    """A format of files, and the functions that read and write it.

    description : what is written, as `list formats` and `export` show it.
    suffixes : the suffixes of files to read; the first is that of the file written.
    write : writes a file, or a folder with a file per matrix if `is_folder`.
    read : returns the chosen matrices of a file by their names in it, a single one by the file's stem, and
        the labels of the rows of each: (n, 2) node and degree of freedom, None if the file has no labels.
    accepts : tells two formats of one suffix apart by the file's content.
    omits_zeros : whether f and g are not written if they are zero everywhere.
    words : the format's words for a node and a degree of freedom.
    """

    description: str
    suffixes: tuple[str, ...]
    write: Callable[[Path, Data], None]
    read: Callable[[Path, Choose], Read]
    accepts: Callable[[Path], bool] = lambda path: True
    is_folder: bool = False
    omits_zeros: bool = False
    words: tuple[str, str] = ("node", "dof")


def _stored(data: Data) -> Data:
    """The data with K and A as they are stored: sparse if K is large and sparse, else dense."""
    if is_large_sparse(data["K"]):
        return data
    return data | {name: data[name].toarray() for name in "KA"}


def _write_npz(path: Path, data: Data) -> None:
    """Write the .npz that scenes open; K and A of a sparse problem as compressed columns."""
    matrix_files.write(path, _stored(data))


def _write_op4(path: Path, data: Data) -> None:
    nastran.write_op4(path, _stored(data))


def _read_npz(path: Path, choose: Choose) -> Read:
    return {name: (M, None) for name, M in matrix_files.read(path, choose, NAMES).items()}


FORMATS = {
    "abaqus": Format(
        "a folder: K as Abaqus matrix text, the others as Matrix Market, bit for bit",
        (".mtx",),
        matrix_text.write_abaqus,
        matrix_text.read_abaqus,
        lambda path: not matrix_text.is_matrix_market(path),
        is_folder=True,
    ),
    "dmig": Format(
        "a file .pch (Nastran DMIG), 10 digits",
        (".pch", ".bdf", ".nas", ".dat"),
        dmig.write_dmig,
        dmig.read_dmig,
        omits_zeros=True,
        words=("point", "component"),
    ),
    "mtx": Format(
        "a folder of Matrix Market files, bit for bit",
        (".mtx",),
        matrix_text.write_matrix_market,
        matrix_text.read_matrix_market,
        is_folder=True,
    ),
    "npz": Format("a file .npz, bit for bit", (".npz",), _write_npz, _read_npz),
    "op4": Format("a binary file .op4, bit for bit", (".op4",), _write_op4, nastran.read_op4),
}


def read_stiffness(path: Path, matrix: str | None = None, name: str = "K") -> tuple[Any, Labels, list[str]]:
    """Read one matrix of a file: the one called `matrix`, or else `name`, or the only one.

    Returns the matrix, the node and degree of freedom of each row (n, 2) if the file has labels, and the
    names of the other arrays in the file. Raises InputError.
    """
    others: list[str] = []

    def choose(names: Sequence[str]) -> list[str]:
        others.extend(names)
        hits = [one for one in names if one == (matrix or name)]
        if not hits:
            hits = [one for one in names if not matrix or one.lower() == matrix.lower()]
        if len(hits) == 1:
            return hits
        wanted = matrix or f"{name}, or one matrix alone"
        how = f'; choose one by matrix = "NAME" in a part, {name}=FILE:NAME for import' * (name in NAMES)
        raise InputError.one(path, "matrices", list(names), f"a matrix {wanted}{how}")

    ((chosen, (M, labels)),) = read_labelled(path, choose).items()
    with matrix_files.reading(path, "file", "a readable matrix file"):
        others += matrix_files.texts_of(path)
    return M, labels, [one for one in others if one != chosen]


def read_labelled(path: Path, choose: Choose = list) -> Read:
    """Read the chosen matrices of a file by their names, with the labels of their rows.

    A nameless one has the file's stem as its name. Raises InputError.
    """
    if not path.is_file():
        raise InputError.one(path, "file", str(path), "no such file")
    format = format_of(path)
    with matrix_files.reading(path, "file", "a readable matrix file"):
        read = format.read(path, choose)
    for name, (M, labels) in read.items():
        if sp.issparse(M):
            refuse_twice(path, name, M)
        if labels is not None and np.isfinite(M.data).all():
            node, dof = format.words
            rows = [f"{node} {at}, {dof} {k}" for at, k in labels.tolist()]
            refuse_no_stiffness(path, sp.csr_array(M), name, rows)
    return read


def format_of(path: Path) -> Format:
    """The format of a file by its suffix and, if that is ambiguous, its content. Raises InputError."""
    suffix = Path(path.name.lower().removesuffix(".gz")).suffix
    for file_format in FORMATS.values():
        if suffix in file_format.suffixes and file_format.accepts(path):
            return file_format
    allowed = ", ".join(
        dict.fromkeys(known for file_format in FORMATS.values() for known in file_format.suffixes)
    )
    raise InputError.one(path, "suffix", path.suffix, allowed)


def vector(values: Any) -> np.ndarray:
    """A row or column of a matrix file, dense or sparse, as a vector; what is neither as it is."""
    dense = np.asarray(values.toarray() if sp.issparse(values) else values)
    return dense if min(dense.shape, default=1) > 1 else dense.ravel()
