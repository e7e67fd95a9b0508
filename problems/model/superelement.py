"""One part as a superelement: its stiffness K on the unknowns that another program kept, and their nodes.

K u = f with u the kept displacements and rotations, N and mm. A row of K is a degree of freedom of a node: 1,
2, 3 displacements along x, y, z; 4, 5, 6 rotations about them. Files with labels (DMIG, Abaqus' text) say
which; in other files the order of the rows does (`superelement_rows`).

A rigid motion of the nodes, r = t + ω × (p − p₀), is free if Kr = 0: only springs to other parts hold it.
"""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Protocol

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from pydantic import Field, field_validator, model_validator

from problems import storage
from problems.errors import InputError
from problems.formats import read_stiffness
from problems.forms.assembly import Indices, Matrix
from problems.input import matrix_files
from problems.input.bounded_types import PLAIN, Name, regular_file
from problems.input.user_matrices import UNCHANGED, checked, is_large_sparse
from problems.storage import fingerprint

from .joint import Table
from .node_table import Nodes, listed, read_nodes
from .superelement_rows import NORMAL_ALONE, Order, rows_of

LARGEST_MIB = 16_384
LOST = 0.05  # the largest share of a normal along degrees of freedom that K does not keep
FREE = 1e-9  # of max |K||r|: a smaller Kr is no force; held parts have 1e-4 and more, free ones 1e-12
SHARE = 0.3  # of a motion's largest component: smaller components do not name it
DIRECTIONS = "xyz"
Dof = Annotated[int, Field(ge=1, le=6), PLAIN]


class SuperelementTable(Table):
    """A [[joint.part]]: the files of K and of its nodes.

    matrix : the name of K in a file with several. rows, dofs : which node and degree of freedom each row of K
    is, if the file of K has no labels; dofs is (3,) by default. stress, stress_points : see stress_recovery.
    """

    name: Name
    superelement: str
    nodes: str
    matrix: Annotated[str, Field(min_length=1)] | None = None
    rows: Order | None = None
    dofs: Annotated[tuple[Dof, ...], Field(min_length=1, max_length=6)] | None = None
    stress: str | None = None
    stress_points: str | None = None

    @field_validator("dofs")
    @classmethod
    def _each_once(cls, dofs: tuple[Dof, ...] | None) -> tuple[Dof, ...] | None:
        if dofs and len(set(dofs)) < len(dofs):
            raise ValueError("must name each once")
        return dofs

    @model_validator(mode="after")
    def _both_or_none(self) -> "SuperelementTable":
        if (self.stress is None) != (self.stress_points is None):
            raise ValueError("must have both of stress and stress_points, or none")
        return self


class StiffnessSource(Protocol):
    """The origin of a part's K: a file, or a plate that is condensed here."""

    @property
    def key(self) -> str:
        """The hash of what determines K, and of the code that makes it."""

    def stored(self) -> storage.Entry:
        """K and facts on it, from the cache or made now. Raises InputError."""


@dataclass(frozen=True)
class StiffnessFile:
    """K of a file. content : the hash of its bytes. matrix : the name of K in a file with several."""

    path: Path
    content: str
    matrix: str | None

    @property
    def key(self) -> str:
        code = fingerprint([Path(__file__)], within=("problems/formats", "problems/input"))
        return storage.digest("superelement", self.content, self.matrix, code)

    def stored(self) -> storage.Entry:
        """K, checked, and the labels of its rows if the file has any."""
        return storage.load_or_make(self.key, self._read)

    def _read(self) -> storage.Entry:
        path = self.path
        as_read, labels, unread = read_stiffness(path, self.matrix)
        n = as_read.shape[0]
        nothing = {"A": sp.csc_array((n, 0)), "f": np.zeros(n), "g": np.zeros(0)}
        sparse = is_large_sparse(as_read)
        assembly, _ = checked({"K": as_read} | nothing, dict.fromkeys("KAfg", str(path)), sparse=True)
        if _hash(path) != self.content:
            raise InputError.one(path, "superelement", "changed", UNCHANGED)
        K, notes = assembly.K.matrix, list(assembly.notes)
        if unread:
            notes.append(f"Not read of {path.name}: {', '.join(unread)}")
        arrays = matrix_files.packed({"K": K if sparse else K.toarray(order="F")})
        if labels is not None:
            arrays["labels"] = labels
        return arrays, {"notes": notes, "sparse": bool(sparse)}


@dataclass(frozen=True, eq=False)
class Superelement:
    """A part with its nodes and the meaning of its unknowns.

    file : that of K, or the scene, for messages. content : a hash of its data, without that of code.
    dofs : the degrees of freedom of each node, for a K without labels.
    node, dof (n,) : the node, an index into `nodes`, and the degree of freedom of each unknown.
    stress_files : the recovery matrix and its points, or none; in no key.
    """

    name: str
    file: Path
    content: str
    source: StiffnessSource
    dofs: tuple[int, ...]
    nodes: Nodes
    node: Indices
    dof: Indices
    stress_files: tuple[Path, ...] = ()

    @classmethod
    def of(cls, folder: Path, table: SuperelementTable) -> "Superelement":
        """Read a part's files. Raises InputError with all faults of them."""
        path, faults, nodes, entry = folder / table.superelement, [], None, None
        try:
            nodes = read_nodes(folder / table.nodes)
        except InputError as error:
            faults += error.faults
        try:
            source = StiffnessFile(path, _hash(path), table.matrix)
            entry = source.stored()
        except InputError as error:
            faults += error.faults
        if nodes is None or entry is None:
            raise InputError(faults)
        node, dof = rows_of(path, folder / table.nodes, nodes, entry[0], table.dofs, table.rows)
        content = [array.tolist() for array in (nodes.xyz, nodes.normal, nodes.contact, node, dof)]
        dofs, key = table.dofs or NORMAL_ALONE, storage.digest((source.content, source.matrix), content)
        files = tuple(folder / each for each in (table.stress, table.stress_points) if each is not None)
        part = cls(table.name, path, key, source, dofs, nodes, node, dof, files)
        if (lost := part._lost).size:
            where = f"{len(lost)} nodes of the contact surface, ids {listed(map(str, nodes.ids[lost]))}"
            allowed = "K must keep the displacement along the normal of each; contact = 0 excepts a node"
            raise InputError.one(folder / table.nodes, "nodes", where, allowed)
        return part

    @property
    def key(self) -> str:
        """The hash of its data and of the code that makes K of them."""
        return storage.digest(self.source.key, self.content)

    @property
    def size(self) -> int:
        return len(self.dof)

    @property
    def stiffness(self) -> Any:
        """K (n, n): dense by columns and memory-mapped, or a csc_array."""
        arrays, facts = self.source.stored()
        return matrix_files.unpacked(arrays, "K") if facts["sparse"] else arrays["K"]

    @property
    def notes(self) -> list[str]:
        """Sentences on what reading K has changed or left out."""
        return [f"{self.name}: {note}" for note in self.source.stored()[1]["notes"]]

    @property
    def sparse(self) -> bool:
        return bool(self.source.stored()[1]["sparse"])

    @cached_property
    def recovery(self) -> Any:
        """The StressRecovery, of no point without files. Raises InputError."""
        from .stress_recovery import StressRecovery  # only what a scene calls for

        return StressRecovery.of(self.stress_files, self.size)

    @cached_property
    def contacts(self) -> Indices:
        """The nodes of the contact surface."""
        return np.flatnonzero(self.nodes.contact)

    @cached_property
    def contact_ids(self) -> Indices:
        """The ids of the nodes of the contact surface."""
        return self.nodes.ids[self.contacts]

    def displacements(self, direction: int) -> sp.csr_array:
        """(contact nodes, n) picks the displacements along x, y or z (0, 1, 2); 0 where K keeps none."""
        place = np.full(len(self.nodes.ids), -1)
        place[self.contacts] = np.arange(len(self.contacts))
        unknowns = np.flatnonzero((self.dof == direction + 1) & (place[self.node] >= 0))
        entries = np.ones(len(unknowns)), (place[self.node[unknowns]], unknowns)
        return sp.csr_array(entries, shape=(len(self.contacts), self.size))

    @property
    def _lost(self) -> Indices:
        """The contact nodes whose displacement along the normal is not kept by K."""
        kept = np.zeros((len(self.nodes.ids), 6), dtype=bool)
        kept[self.node, self.dof - 1] = True
        lost = np.linalg.norm(np.where(kept[:, :3], 0.0, self.nodes.normal), axis=1)
        return np.flatnonzero(self.nodes.contact & (lost > LOST))

    @cached_property
    def rigid(self) -> Matrix:
        """(n, 6): translations along x, y, z, and rotations about them by the angle 1/size of the part."""
        p = self.nodes.xyz - self.nodes.xyz.mean(axis=0)
        size = np.sqrt((p**2).sum(axis=1).mean()) or 1.0
        R = np.zeros((self.size, 6))
        for axis in range(3):
            turned = np.cross(np.eye(3)[axis], p) / size
            for k in range(3):
                along, about = self.dof == k + 1, self.dof == k + 4
                R[along, axis] = k == axis
                R[along, 3 + axis] = turned[self.node[along], k]
                R[about, 3 + axis] = (k == axis) / size
        return R

    @cached_property
    def free(self) -> Matrix:
        """(n, r) an orthonormal basis of the free rigid motions, Kr = 0."""
        U, s, _ = np.linalg.svd(self.rigid, full_matrices=False)
        K, Q = self.stiffness, U[:, s > 1e-9 * s[0]]
        _, V = np.linalg.eigh(Q.T @ (K @ Q))
        R = Q @ V
        none = abs(K @ R).max(axis=0) <= FREE * (abs(K) @ abs(R)).max(axis=0)
        return np.asarray(R[:, none])

    def named(self, motions: Matrix) -> str:
        """The words for motions (n, r), orthonormal and rigid: translation along z, rotation about x, …"""
        R = self.rigid
        sizes = np.linalg.norm(R, axis=0)
        inside = np.linalg.norm(R - motions @ (motions.T @ R), axis=0) <= 1e-6 * sizes
        shares = abs(sla.lstsq(R, motions)[0]).max(axis=1)
        chosen = inside & (sizes > 0)
        if not chosen.any():
            chosen = shares > SHARE * shares.max()
            if chosen[3:].any():  # about an axis somewhere else
                chosen[:3] = False
        words = [f"{kind} {axis}" for kind in ("translation along", "rotation about") for axis in DIRECTIONS]
        return ", ".join(word for word, one in zip(words, chosen, strict=True) if one)


def _hash(path: Path) -> str:
    """The hash of a file's bytes, as two files of one size and time may differ. Raises InputError."""
    try:
        with regular_file(path, "superelement", LARGEST_MIB).open("rb") as file:
            return storage.digest(path.suffixes[-2:], hashlib.file_digest(file, "sha256").hexdigest())
    except OSError as error:
        raise InputError.one(path, "superelement", error.strerror, "a readable file") from error
