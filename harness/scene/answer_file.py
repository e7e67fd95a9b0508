"""An answer that was computed elsewhere: x or λ from a .npy, .npz, .csv, .txt or .mtx file."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Vector
from problems.input.bounded import regular_file
from problems.input.matrix_files import read_mtx

MIB = 1024
#: The headings of a column of displacements and of contact forces, in a table with several.
HEADINGS = {"x": ("x", "displacement_mm"), "lam": ("lam", "force_N")}
ALLOWED = "a .npy, .npz, .csv, .txt or .mtx file with numbers"


def read_answer(path: Path) -> dict[str, Vector]:
    """What the file holds: "x" (displacements), "lam" (contact forces), or "" for a vector without a name.

    An .npz has arrays x or displacement_mm, lam or force_N, never both of a pair, or one alone; a .csv has a
    header with such columns (as in nodes.csv and contacts.csv of `solve`), or one column of numbers.
    Raises InputError.
    """
    regular_file(path, "file", MIB)
    try:
        found = _read(path)
    except InputError:
        raise
    except Exception as error:  # numpy, zipfile, csv and scipy raise kinds of their own
        raise InputError.one(path, "file", f"{type(error).__name__}: {error}", ALLOWED) from error
    for name, vector in found.items():
        wrong = np.flatnonzero(~np.isfinite(vector))
        if len(wrong):
            key = f"{name or 'entry'}[{wrong[0]}]"
            allowed = f"must be finite; {len(wrong)} of {len(vector)} are not"
            raise InputError.one(path, key, float(vector[wrong[0]]), allowed)
    return found


def _read(path: Path) -> dict[str, Vector]:
    match path.suffix.lower():
        case ".npy":
            return {"": _vector(np.load(path, allow_pickle=False))}
        case ".npz":
            with np.load(path, allow_pickle=False) as archive:
                return _named(path, archive.files, archive.__getitem__)
        case ".csv":
            return _columns(path)
        case ".txt":
            return {"": _vector(np.loadtxt(path, dtype=float, ndmin=1))}
        case ".mtx":
            found = read_mtx(path)
            if sp.issparse(found):  # whose size no file bounds
                raise ValueError("coordinates, not an array")
            return {"": _vector(found)}
    raise InputError.one(path, "suffix", path.suffix, ALLOWED)


def _columns(path: Path) -> dict[str, Vector]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        first, *rest = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    heading = [cell.strip() for cell in first]
    if len(heading) == 1 and _is_number(heading[0]):
        return {"": np.array([float(row[0]) for row in (first, *rest)])}
    return _named(path, heading, lambda name: [float(row[heading.index(name)]) for row in rest])


def _named(path: Path, names: list[str], read: Callable[[str], object]) -> dict[str, Vector]:
    """Those of HEADINGS, else the only one."""
    found = {}
    for name, headings in HEADINGS.items():
        known = [each for each in headings if each in names]
        if len(known) > 1:
            allowed = "one of them alone: the other is not what is judged"
            raise InputError.one(path, "columns", ", ".join(known), allowed)
        if known:
            found[name] = _vector(read(known[0]))
    if not found and len(names) != 1:
        wanted = " or ".join(each for headings in HEADINGS.values() for each in headings)
        raise InputError.one(path, "names", names, f"{wanted}, or one alone")
    return found or {"": _vector(read(names[0]))}


def _vector(array: object) -> Vector:
    values = np.asarray(array)
    if values.dtype.kind not in "fiu":
        raise ValueError(f"an array of {values.dtype}")
    if values.size != max(values.shape, default=1):
        raise ValueError(f"an array of shape {values.shape}, not a vector")
    return values.astype(float).ravel()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
