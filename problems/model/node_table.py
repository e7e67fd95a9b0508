"""The table of a superelement's nodes, a CSV: places, normals, and which are of the contact surface."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from problems.errors import Fault, InputError
from problems.forms.assembly import Indices, Mask, Matrix, Vector
from problems.input.tables import headings, read_columns

from .surface import SAME

NORMAL = ("nx", "ny", "nz")
UNIT = 1e-3  # by which the length of a normal may miss 1
FARTHEST = 1e9  # mm from the origin: beyond, doubles hardly tell places apart by SAME
FAR = 10.0  # times the distances beside it
SHOWN = 10  # nodes of a message


@dataclass(frozen=True)
class Nodes:
    """By ascending ids, so that nothing depends on the order of the table.

    ids (N,); xyz (N, 3) mm; normal (N, 3), of length 1; contact (N,) which are of the contact surface.
    table (N,) : the nodes in the order of the table.
    """

    ids: Indices
    xyz: Matrix
    normal: Matrix
    contact: Mask
    table: Indices


def read_nodes(path: Path) -> Nodes:
    """A CSV with the columns id, x, y, z; nx, ny, nz, by default 0, 0, 1; contact, 1 (the default) or 0.

    Raises InputError with all faults.
    """
    there = headings(path)
    curved, of_surface = any(name in there for name in NORMAL), "contact" in there
    names = ["id", "x", "y", "z", *(NORMAL if curved else ()), *(["contact"] if of_surface else [])]
    read = read_columns(path, {name: name for name in names})
    if read.faults:
        raise InputError(read.faults)
    rows = np.array(read.rows)
    normal = rows[:, 4:7] if curved else np.tile([0.0, 0.0, 1.0], (len(rows), 1))
    contact = rows[:, -1] == 1 if of_surface else np.ones(len(rows), dtype=bool)
    ids, length = rows[:, 0], np.linalg.norm(normal, axis=1)
    found = list(_wrong_nodes(ids, rows[:, 1:4], length, rows[:, -1] if of_surface else contact, contact))
    if found:
        raise InputError([Fault(str(path), *fault) for fault in found])
    own = np.argsort(ids)
    unit = normal[own] / length[own, None]
    return Nodes(ids[own].astype(np.intp), rows[own, 1:4], unit, contact[own], np.argsort(own))


def _wrong_nodes(
    ids: Vector, xyz: Matrix, length: Vector, given: Vector | Mask, contact: Mask
) -> Iterable[tuple[str, object, str]]:
    from scipy.spatial import cKDTree

    if (wrong := ids[(ids != np.round(ids)) | (abs(ids) > 2**53)]).size:
        yield "id", listed(f"{each:g}" for each in wrong), "whole numbers"
        return
    names, counts = np.unique(ids, return_counts=True)
    if (counts > 1).any():
        yield "id", _ids(names[counts > 1]), "each id once"
    if (wrong := ids[~np.isin(given, (0, 1))]).size:
        yield "contact", f"ids {_ids(wrong)}", "0 or 1"
    if (wrong := ids[abs(length - 1) > UNIT]).size:
        yield "nx, ny, nz", f"ids {_ids(wrong)}", "a normal of length 1"
    if (wrong := ids[abs(xyz).max(axis=1) > FARTHEST]).size:
        yield "x, y, z", f"ids {_ids(wrong)}", f"at most {FARTHEST:g} mm"
        return
    own = np.flatnonzero(contact)
    if len(own) < 3:
        yield "contact", len(own), "at least three nodes of the contact surface"
        return
    pairs = cKDTree(xyz[own]).query_pairs(SAME, output_type="ndarray")
    if len(pairs):
        twice = listed(f"{ids[own[i]]:.0f} and {ids[own[j]]:.0f}" for i, j in pairs)
        yield "x, y, z", f"ids {twice}", "one node at each place of the contact surface"


def outliers(xyz: Matrix) -> Indices:
    """The nodes whose nearest one is far away beside the distance that it has to its own nearest one."""
    from scipy.spatial import cKDTree

    away, nearest = (each[:, 1] for each in cKDTree(xyz).query(xyz, k=2))
    return np.flatnonzero(away > FAR * away[nearest])


def _ids(ids: Vector) -> str:
    return listed(f"{each:.0f}" for each in ids)


def listed(items: Iterable[str]) -> str:
    """The first ten, and how many more."""
    every = list(items)
    more = f" and {len(every) - SHOWN} more" if len(every) > SHOWN else ""
    return ", ".join(every[:SHOWN]) + more
