"""The table of a superelement's nodes, a CSV: places, normals, and whether each is on the contact surface."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from problems.errors import Fault, InputError
from problems.forms.assembly import Indices, Mask, Matrix, Vector
from problems.input.tables import read_columns

from .surface import SAME

NORMAL = ("nx", "ny", "nz")
UNIT = 1e-3  # by which the length of a normal may miss 1
FARTHEST = 1e9  # mm from the origin: beyond, doubles hardly tell places apart by SAME
FAR = 10.0  # times the distance between its neighbours
SHOWN = 10  # nodes of a message


@dataclass(frozen=True)
class Nodes:
    """The nodes of a part by ascending ids, so that nothing depends on the order of the table.

    ids (N,); xyz (N, 3) mm; normal (N, 3), of length 1; contact (N,), whether on the contact surface.
    table (N,) : the nodes in the order of the table.
    """

    ids: Indices
    xyz: Matrix
    normal: Matrix
    contact: Mask
    table: Indices


def read_nodes(path: Path) -> Nodes:
    """Read a CSV with the columns id, x, y, z; nx, ny, nz, by default 0, 0, 1; contact, 1 (default) or 0.

    Raises InputError with all faults.
    """
    read = read_columns(path, ("id", "x", "y", "z"), optional=(*NORMAL, "contact"))
    if read.faults:
        raise InputError(read.faults)
    values = dict(zip(read.columns, np.array(read.rows).T, strict=True))
    ids, xyz = values["id"], np.column_stack([values[name] for name in "xyz"])
    default = 0.0, 0.0, float(not values.keys() & {*NORMAL})
    columns = [values.get(name, np.full(len(ids), one)) for name, one in zip(NORMAL, default, strict=True)]
    normal = np.column_stack(columns)
    contact, length = values.get("contact", np.ones(len(ids))), np.linalg.norm(normal, axis=1)
    if faults := list(_wrong_nodes(ids, xyz, length, contact)):
        raise InputError([Fault(str(path), *fault) for fault in faults])
    order = np.argsort(ids)
    unit = normal[order] / length[order, None]
    return Nodes(ids[order].astype(np.intp), xyz[order], unit, contact[order] == 1, np.argsort(order))


def _wrong_nodes(
    ids: Vector, xyz: Matrix, length: Vector, contact: Vector
) -> Iterable[tuple[str, object, str]]:
    """Yield the faults of a table of nodes. length : of their normals."""
    from scipy.spatial import cKDTree

    if (wrong := ids[(ids != np.round(ids)) | (abs(ids) > 2**53)]).size:
        yield "id", listed(f"{number:g}" for number in wrong), "whole numbers"
        return
    names, counts = np.unique(ids, return_counts=True)
    if (counts > 1).any():
        yield "id", _ids(names[counts > 1]), "each id once"
    if (wrong := ids[~np.isin(contact, (0, 1))]).size:
        yield "contact", f"ids {_ids(wrong)}", "0 or 1"
    if (wrong := ids[abs(length - 1) > UNIT]).size:
        yield "nx, ny, nz", f"ids {_ids(wrong)}", "a normal of length 1"
    if (wrong := ids[abs(xyz).max(axis=1) > FARTHEST]).size:
        yield "x, y, z", f"ids {_ids(wrong)}", f"at most {FARTHEST:g} mm"
        return
    touching = np.flatnonzero(contact == 1)
    if len(touching) < 3:
        yield "contact", len(touching), "at least three nodes of the contact surface"
        return
    pairs = touching[cKDTree(xyz[touching]).query_pairs(SAME, output_type="ndarray")]
    if len(pairs):
        twice = listed(f"{ids[i]:.0f} and {ids[j]:.0f}" for i, j in pairs)
        yield "x, y, z", f"ids {twice}", "one node at each place of the contact surface"


def outliers(xyz: Matrix) -> Indices:
    """The nodes ten times farther from their nearest neighbour than that is from its own nearest one."""
    from scipy.spatial import cKDTree

    away, nearest = (column[:, 1] for column in cKDTree(xyz).query(xyz, k=2))
    return np.flatnonzero(away > FAR * away[nearest])


def _ids(ids: Vector) -> str:
    return listed(f"{number:.0f}" for number in ids)


def listed(items: Iterable[str]) -> str:
    """The first ten items, and the number of the others."""
    texts = list(items)
    more = f" and {len(texts) - SHOWN} more" if len(texts) > SHOWN else ""
    return ", ".join(texts[:SHOWN]) + more
