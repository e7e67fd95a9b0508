"""File formats of K, A, f, g: one file NAME_format.py each, found by its name. It holds

    DESCRIPTION          what is written: a file, or a folder with one file per matrix
    SUFFIXES             of the files that are read
    write(path, data)
    read(path)           the matrices of a file
    accepts(path)        whether a file's content is of this format; only if another format shares a suffix
    OMITS_ZEROS          True if f and g that are zero everywhere are not written; else it may be missing

Data are a dict: K (n, n) and A (n, m) sparse, f (n,), g (m,), and nodes (n, 2) if known. Libraries are
imported when a file is read or written.
"""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import Fault, InputError

Data = dict[str, Any]
NAMES = ("K", "A", "f", "g", "nodes")


def names() -> list[str]:
    """The formats, by their files."""
    found = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return [name.removesuffix("_format") for name in found if name.endswith("_format")]


def description(name: str) -> str:
    """What the format writes."""
    return str(_module(name).DESCRIPTION)


def suffix(name: str) -> str:
    """The suffix of what the format writes; "" if that is a folder."""
    module = _module(name)
    return "" if module.DESCRIPTION.startswith("a folder") else str(module.SUFFIXES[0])


def write(name: str, path: Path, data: Data) -> None:
    """Write data in the format of that name."""
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
    except Exception as error:  # of the libraries, which raise whatever a damaged file leads to
        raise InputError.one(
            path, "file", f"{type(error).__name__}: {error}", "a readable matrix file"
        ) from error


def omits_zeros(path: Path) -> bool:
    """Whether an f or g that a readable file lacks may be zero."""
    return getattr(module_of(path), "OMITS_ZEROS", False)


def module_of(path: Path) -> ModuleType:
    """The format of a file, from its suffix and, if that is ambiguous, its content."""
    modules, suffix = [_module(name) for name in names()], path.suffix.lower()
    alike = [module for module in modules if suffix in module.SUFFIXES]
    for module in alike:
        if len(alike) == 1 or module.accepts(path):
            return module
    allowed = ", ".join(dict.fromkeys(known for module in modules for known in module.SUFFIXES))
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
    """A row or column of a matrix file, dense or sparse, as a vector."""
    return np.ravel(values.toarray() if sp.issparse(values) else values)
