"""File formats of K, A, f, g: one file each, with `write(path, data)` and `read(path)`.

Data are a dict: K (n, n) and A (n, m) sparse, f (n,), g (m,), and nodes (n, 2) if known. A format is imported
when a file of its kind is read or written. A new one is one file here and a line in WRITERS and `module_of`.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any
from zipfile import BadZipFile

import numpy as np

from problems.errors import Fault, InputError

Data = dict[str, Any]
NAMES = ("K", "A", "f", "g", "nodes")

#: What each writes: a file, or a folder with one file per matrix.
WRITERS = {
    "npz": "a file .npz, bit for bit",
    "mtx": "a folder of Matrix Market files, bit for bit",
    "op4": "a file .op4 (Nastran OUTPUT4, binary), bit for bit",
    "dmig": "a file .pch (Nastran DMIG), 10 digits",
    "abaqus": "a folder: K as Abaqus matrix text, the others as Matrix Market, bit for bit",
    "qpsolvers": "a file .npz that qpsolvers.Problem.load reads, bit for bit",
}
DMIG_SUFFIXES = (".pch", ".bdf", ".nas", ".dat")


def write(name: str, path: Path, data: Data) -> None:
    """Write data in a format of WRITERS."""
    _module(name).write(path, data)


def read(path: Path) -> Data:
    """The matrices of a file, by their names in it; a file that holds one matrix names it by its stem.

    Raises InputError if it is not readable.
    """
    if not path.is_file():
        raise InputError.one(path, "file", str(path), "no such file")
    try:
        return module_of(path).read(path)
    except InputError:
        raise
    except (OSError, ValueError, KeyError, IndexError, RuntimeError, EOFError, BadZipFile) as error:
        raise InputError.one(
            path, "file", f"{type(error).__name__}: {error}", "a readable matrix file"
        ) from error


def module_of(path: Path) -> ModuleType:
    """The format of a file, from its suffix and, if that is ambiguous, its content."""
    match path.suffix.lower():
        case ".npz":
            with np.load(path) as archive:
                return _module("qpsolvers" if "P" in archive.files else "npz")
        case ".mtx":
            with path.open("rb") as file:
                return _module("mtx" if file.read(14) == b"%%MatrixMarket" else "abaqus")
        case ".op4":
            return _module("op4")
        case suffix if suffix in DMIG_SUFFIXES:
            return _module("dmig")
    allowed = f".npz, .mtx, .op4, {', '.join(DMIG_SUFFIXES)}"
    raise InputError.one(path, "suffix", path.suffix, allowed)


def _module(name: str) -> ModuleType:
    return importlib.import_module(f"problems.formats.{name}_format")


def pyyeti(path: Path) -> Any:
    """pyyeti.nastran, which reads and writes Nastran's files. Raises InputError if it is not installed."""
    try:
        with np.printoptions():  # which its import changes for good: text files would have 12 digits
            from pyyeti import nastran
    except ModuleNotFoundError:
        allowed = "Nastran's formats need pyyeti: pip install 'rivetbench[nastran]'"
        raise InputError([Fault(str(path), "format", path.suffix, allowed)]) from None
    return nastran


def vector(values: Any) -> np.ndarray:
    """A row or column of a matrix file as a vector."""
    return np.asarray(values, dtype=float).ravel()
