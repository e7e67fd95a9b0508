"""The node and the degree of freedom of each row of a part's K, from the file's labels or the order of rows.

A wrong order shows in K. The rows with the largest |K_ij| / √(K_ii K_jj) belong to nodes near that of row i.
The rank of such a node is its place among all nodes sorted by their distance from that of row i; the median
rank over a sample of rows is small if the order is right.
"""

from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Indices

from .node_table import Nodes, listed

Order = Literal["table", "ids", "directions"]
Rows = tuple[Indices, Indices]
NORMAL_ALONE = (3,)  # dofs, if neither the file of K nor the scene says them
ORDERS = """Say in the part how rows go through the nodes: all dofs of a node together, as in the table \
("table") or by ascending ids ("ids"); or one of the dofs after the other, as in the table ("directions")"""
FIRST = 7  # rows printed by validate
SAMPLE, STRONGEST = 64, 4  # rows examined; nodes of the largest coupling per row
BETTER, FAR = 3.0, 10  # times the rank of another order; the rank of nodes at random is half their number
NAMES = ("x", "y", "z", "about x", "about y", "about z")


def by_order(order: Order, nodes: Nodes, dofs: tuple[int, ...]) -> Rows:
    """The node and degree of freedom of each row in that order. dofs : those of each node."""
    count, every = len(nodes.ids), np.array(dofs)
    if order == "directions":
        return np.tile(nodes.table, len(dofs)), np.repeat(every, count)
    own = nodes.table if order == "table" else np.arange(count)
    return np.repeat(own, len(dofs)), np.tile(every, count)


def rows_of(
    path: Path, table: Path, nodes: Nodes, arrays: Any, dofs: tuple[int, ...] | None, order: Order | None
) -> Rows:
    """The node and degree of freedom of each row of K, of the file `path`, packed in arrays.

    dofs, order : those of the scene, None if it does not say them. Raises InputError.
    """
    if "labels" in arrays:
        if order:
            raise InputError.one(path, "rows", order, "leave it out: this file says which row is which node")
        node, dof = _labelled(path, table, nodes, arrays["labels"], dofs or NORMAL_ALONE)
        if dofs and {*dofs} != (there := {*dof.tolist()}):
            allowed = f"leave it out: the labels of this file are dofs {sorted(there)}"
            raise InputError.one(path, "dofs", list(dofs), allowed)
        return node, dof
    dofs = dofs or NORMAL_ALONE
    count = int(arrays["K_shape"][0]) if "K_shape" in arrays else len(arrays["K"])
    if count != len(nodes.ids) * len(dofs):
        rows = f"{len(nodes.ids)} nodes of {table} with the dofs {list(dofs)} are"
        raise InputError.one(path, "rows of K", count, f"{rows} {len(nodes.ids) * len(dofs)} rows")
    ascending = bool((nodes.table == np.arange(len(nodes.ids))).all())
    if not order and not (ascending and len(dofs) == 1):
        why = "has several dofs" if ascending else "has ids that do not ascend"
        allowed = f'"table", "ids" or "directions": this file has no labels, and {table} {why}. '
        raise InputError.one(path, "rows", order, allowed + ORDERS)
    return by_order(order or "table", nodes, dofs)


def _labelled(path: Path, table: Path, nodes: Nodes, labels: Any, dofs: tuple[int, ...]) -> Rows:
    ids, dof = np.array(labels).T
    node = np.minimum(np.searchsorted(nodes.ids, ids), len(nodes.ids) - 1)
    if missing := dict.fromkeys(ids[nodes.ids[node] != ids].tolist()):
        raise InputError.one(path, "nodes of K", listed(map(str, missing)), f"ids of {table}")
    if len(dofs) == 1:
        dof = np.where(dof == 0, dofs[0], dof)  # scalar points
    if not ((dof >= 1) & (dof <= 6)).all():
        wrong = sorted(set(dof.tolist()) - set(range(1, 7)))
        raise InputError.one(path, "degrees of freedom of K", wrong, "1 … 6; scalar points need one dof")
    rows, counts = np.unique(np.column_stack([ids, dof]), axis=0, return_counts=True)
    if (counts > 1).any():
        twice = listed(f"node {at}, dof {k}" for at, k in rows[counts > 1].tolist())
        raise InputError.one(path, "rows of K", twice, f"each once; scalar points are dof {list(dofs)}")
    return node.astype(np.intp), dof.astype(np.intp)


def first_rows(nodes: Nodes, rows: Rows) -> str:
    """The node and the degree of freedom of the first rows, in words."""
    named = zip(nodes.ids[rows[0][:FIRST]].tolist(), rows[1].tolist(), strict=False)
    return ", ".join(f"node {at} {NAMES[dof - 1]}" for at, dof in named)


def misfit(K: Any, nodes: Nodes, rows: Rows, dofs: tuple[int, ...]) -> tuple[float, str] | None:
    """The median rank, and what is usual, if rows (node, dof) do not fit K; None if they fit."""
    here = _rank(K, nodes, rows[0])
    if len(nodes.ids) * len(dofs) == len(rows[0]):
        ranks = {order: _rank(K, nodes, by_order(order, nodes, dofs)[0]) for order in get_args(Order)}
        best = min(ranks, key=ranks.__getitem__)
        if here > BETTER * max(ranks[best], 1.0):
            return here, f'{ranks[best]:g}, as if the rows were in the order "{best}"'
    if here > max(FAR, len(nodes.ids) / 4):
        return here, "a few: are the nodes of the table those of K?"
    return None


def _rank(K: Any, nodes: Nodes, node: Indices) -> float:
    """The median rank; 0 if no row is coupled to another node."""
    size = np.sqrt(abs(K.diagonal()))
    ranks = []
    for i in np.unique(np.linspace(0, len(node) - 1, SAMPLE).astype(int)):
        row = K[:, [i]].toarray().ravel() if sp.issparse(K) else K[:, i]
        coupling = np.zeros(len(nodes.ids))
        np.maximum.at(coupling, node, np.divide(abs(row), size, out=np.zeros(len(row)), where=size > 0))
        coupling[node[i]] = 0.0
        strongest = np.argsort(-coupling, kind="stable")[:STRONGEST]
        away = np.linalg.norm(nodes.xyz - nodes.xyz[node[i]], axis=1)
        ranks += [(away < away[j] * (1 - 1e-9)).sum() for j in strongest if coupling[j] > 0]
    return float(np.median(ranks)) if ranks else 0.0
