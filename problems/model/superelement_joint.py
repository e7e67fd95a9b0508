"""A joint of superelements: the plane of its junction, its contacts by projection, the weights of points.

The plane is the x-y plane if the mean normal of the first part is within 10° of z. Otherwise it is normal to
that mean normal, and its x is the global x projected onto it (y, if the normal is nearly along x).

A contact of the pair (a, b) is a contact node of a at p, with the normal n towards b, and its foot on b at
p + tn. With the weights w of b's nodes at the foot, the parts do not overlap if

    n·u_a − Σ w_j n·u_b,j ≤ g.

The distance t is not part of the gap g, which comes from the effects.
"""

import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import scipy.sparse as sp
from pydantic import Field

from problems.errors import read_all
from problems.forms.assembly import Indices, Mask, Matrix, Vector
from problems.input.bounded_types import Positive

from .contact_pairing import Face, Pairing, paired, with_tool
from .interface import across
from .joint import TOOL, Faults, Pair, Table, wrong_contacts
from .node_table import listed, outliers
from .plate import Plate
from .superelement import Superelement, SuperelementTable
from .superelement_rows import misfit
from .surface import SAME, refuse_off, surface_of

LEVEL = np.cos(np.radians(10.0))
STEEP = 0.1  # the least cosine between a normal and that of the plane
PER_LENGTH, FEWEST, MOST = 6, 4, 1000  # lines of a grid for random fields: per correlation length; in all


class PairingTable(Table):
    """[joint.pairing]. distance : the largest distance, mm, of a node from its foot on the other part."""

    distance: Annotated[Positive, "mm"] = 5.0


class SuperelementJointTable(Table):
    """The table [joint] of a joint whose parts are superelements."""

    pairing: PairingTable = PairingTable()
    part: Annotated[tuple[SuperelementTable, ...], Field(min_length=1, max_length=100)]
    contacts: Annotated[tuple[Pair, ...], Field(min_length=1)] = ()


@dataclass(frozen=True, eq=False)
class SuperelementJoint:
    """A joint of superelements; x are the kept unknowns of all parts, part after part. See `AnyJoint`."""

    thinnest: ClassVar[float] = np.inf
    parts: tuple[Superelement, ...]
    distance: float
    contacts: tuple[Pair, ...] = ()

    @classmethod
    def of(cls, folder: Path, table: SuperelementJointTable) -> "SuperelementJoint":
        """Read the parts. Raises InputError with all faults of all files."""
        parts = read_all(lambda part: Superelement.of(folder, part), table.part)
        return cls(tuple(parts), table.pairing.distance, table.contacts)

    def __getstate__(self) -> dict[str, Any]:
        """The data for a copy in another process, which computes the cached properties anew."""
        return {name: getattr(self, name) for name in ("parts", "distance", "contacts")}

    def with_contacts(self, pairs: tuple[Pair, ...]) -> "SuperelementJoint":
        return replace(self, contacts=pairs)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.name for part in self.parts)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        return self.contacts or tuple(itertools.pairwise(self.names))

    @property
    def content(self) -> Any:
        keys = [[part.name, part.content] for part in self.parts]
        return {"superelements": keys, "pairs": self.pairs, "distance": self.distance}

    @property
    def size(self) -> tuple[int, int]:
        return sum(part.size for part in self.parts), sum(len(self.places(pair)) for pair in self.pairs)

    @cached_property
    def axes(self) -> Matrix:
        """(3, 3) the directions of x, y and the normal of the plane, row by row."""
        normal = self._normals[self.names[0]].sum(axis=0)
        normal /= np.linalg.norm(normal) or 1.0
        if normal[2] >= LEVEL:
            return np.eye(3)
        x = np.eye(3)[int(abs(normal[0]) > LEVEL)]
        x = x - (x @ normal) * normal
        x /= np.linalg.norm(x)
        return np.array([x, np.cross(normal, x), normal])

    @cached_property
    def _normals(self) -> dict[str, Matrix]:
        """The normals (c, 3) of the contact nodes of each part, in the global axes."""
        return {part.name: part.nodes.normal[part.contacts] for part in self.parts}

    @cached_property
    def _of(self) -> dict[str, Superelement]:
        return {part.name: part for part in self.parts}

    @cached_property
    def faces(self) -> dict[str, Face]:
        """The face of each part in the axes of the plane. Raises ValueError if its nodes are on one line."""
        faces = {}
        for part in self.parts:
            xyz = part.nodes.xyz[part.contacts] @ self.axes.T
            faces[part.name] = Face(xyz, self._normals[part.name] @ self.axes.T, surface_of(xyz[:, :2]))
        return faces

    @cached_property
    def pairings(self) -> dict[Pair, Pairing]:
        faces, distance = self.faces, self.distance
        return {
            (a, b): with_tool(faces[a]) if b == TOOL else paired(faces[a], faces[b], distance)
            for a, b in self.pairs
        }

    def faults(self) -> Faults:
        """Yield the faults of the contacts; faults of files are raised when these are read."""
        from scipy.spatial import cKDTree

        wrong = list(wrong_contacts(self.names, self.contacts, self.pairs, at_one_place=False))
        for part in self.parts:
            steep = part.nodes.normal[part.contacts] @ self.axes[2] < STEEP
            if steep.any():
                value = f"normals of {steep.sum()} nodes, ids {listed(map(str, part.contact_ids[steep]))}"
                allowed = "reversed? All normals point the same way, from the first part to the second"
                wrong.append((f"part.{part.name}.nodes", value, allowed))
            in_plane = (part.nodes.xyz[part.contacts] @ self.axes.T)[:, :2]
            if twins := cKDTree(in_plane).query_pairs(SAME):
                ids = " and ".join(map(str, part.contact_ids[list(min(twins))]))
                allowed = "one contact node at a place of the junction: contact = 0 for the other face"
                wrong.append((f"part.{part.name}.nodes", f"ids {ids}, one above the other", allowed))
        if not wrong:
            try:
                _ = self.faces
            except ValueError as error:
                wrong.append(("part.nodes", str(error), "at least three contact nodes off a line"))
        yield from wrong or itertools.chain.from_iterable(map(self._wrong_pairing, self.pairs))

    def _wrong_pairing(self, pair: Pair) -> Faults:
        pairing, ids = self.pairings[pair], self._of[pair[0]].contact_ids
        key = f"contacts, {' – '.join(pair)}"
        if not len(pairing.nodes):
            nothing = f"no node of {pair[0]} has a foot on {pair[1]}: {pairing.beyond} are beyond its surface"
            near = f", {len(pairing.far)} too far: {self._distances(pair)}" if pairing.far else ""
            yield key, nothing + near, f"pairing.distance = {self.distance:g} mm or more"
        if pairing.lost:
            lost = f"no foot found of ids {listed(map(str, ids[list(pairing.lost)]))}"
            yield key, lost, f"normals along which a line meets {pair[1]}"
        if pairing.crossed:
            crossed = listed(" and ".join(map(str, ids[list(corners)])) for corners in pairing.crossed)
            yield key, f"ids {crossed}", "neighbours whose feet are neighbours the same way round"

    def _distances(self, pair: Pair) -> str:
        ids, far = self._of[pair[0]].contact_ids, self.pairings[pair].far
        return listed(f"{ids[k]} ({t:.3g} mm)" for k, t in far.items())

    def unusual(self) -> Faults:
        if self.axes[2, 2] <= -LEVEL:
            yield "y of points", f"-y of nodes, as normals of {self.names[0]} are along -z", "y of nodes"
        for part in self.parts:
            if rank := misfit(part.stiffness, part.nodes, (part.node, part.dof), part.dofs):
                what = "median rank by distance of the nodes that a row of K ties most"
                yield f"part.{part.name}, {what}", *rank
            if len(far := outliers(part.nodes.xyz[part.contacts])):
                usual = f"none: is this their place? Ids {listed(map(str, part.contact_ids[far]))}"
                yield f"part.{part.name}, nodes far from all others", len(far), usual
        for pair, pairing in self.pairings.items():
            name = " – ".join(pair)
            if pairing.far:
                usual = f"none: they are no contacts: {self._distances(pair)}"
                yield f"{name}, nodes farther apart than {self.distance:g} mm", len(pairing.far), usual
            if pairing.over_bays:
                usual = f"none, unless {pair[1]} is open there: they are no contacts"
                yield f"{name}, nodes over a bay or a hole of {pair[1]}", pairing.over_bays, usual
            if len(pairing.apart) and (apart := float(np.median(pairing.apart))) < -self.distance / 100:
                usual = f"0 or more, with {pair[1]} on the side of {pair[0]} to which its normals point"
                yield f"{name}, median distance along the normal", apart, usual

    @cached_property
    def _box(self) -> Matrix:
        """(2, 3) the lower and the upper corner of all contact nodes, in the axes of the plane, mm."""
        every = np.concatenate([face.xyz for face in self.faces.values()])
        return np.array([every.min(axis=0), every.max(axis=0)])

    @property
    def bounds(self) -> Matrix:
        return self._box[:, :2]

    @property
    def shortest(self) -> float:
        return PER_LENGTH * float(np.diff(self.bounds, axis=0).max()) / MOST

    def unknowns(self, part: str) -> slice:
        return _slice([each.size for each in self.parts], self.names.index(part))

    def span(self, pair: Pair) -> slice:
        return _slice([len(self.places(each)) for each in self.pairs], self.pairs.index(pair))

    @property
    def ids(self) -> tuple[Indices, Indices]:
        contacts = (self._of[a].contact_ids[self.pairings[a, b].nodes] for a, b in self.pairs)
        nodes = np.concatenate([part.contact_ids for part in self.parts])
        return nodes, np.concatenate([np.zeros(0, np.intp), *contacts])

    def contact_name(self, index: int) -> str:
        """The pair and the node of a contact, by its place in λ."""
        pair = next(pair for pair in self.pairs if index < self.span(pair).stop)
        return f"{' – '.join(pair)} at node {self.ids[1][index]}"

    def places(self, pair: Pair) -> Matrix:
        return self.faces[pair[0]].xyz[self.pairings[pair].nodes, :2]

    def nodes_of(self, part: str) -> Matrix:
        return self.faces[part].xyz[:, :2]

    def covers(self, parts: tuple[str, ...], points: Matrix) -> Mask:
        inside = np.ones(len(points), dtype=bool)
        for part in parts:
            inside &= self.faces[part].surface.covers(points)
        return inside

    def _along(self, part: str, W: sp.csr_array, normals: Matrix) -> sp.csr_array:
        """(k, unknowns of the part) of Σ_j w_ij n_i·u_j. W (k, contact nodes) : w. normals (k, 3) : n."""
        moves = map(self._of[part].displacements, range(3))
        terms = (sp.diags_array(n) @ W @ move for n, move in zip(normals.T, moves, strict=True))
        W_n = sp.csr_array(sum(terms))
        W_n.eliminate_zeros()
        return W_n

    def deflection(self, part: str, points: Matrix, along: str = "") -> sp.csr_array:
        names = dict.fromkeys((part, along or part))
        refuse_off(points, self.covers(tuple(names), points))
        W = {name: self.faces[name].surface.weights(points) for name in names}
        normals = W[along or part] @ self._normals[along or part]
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        if along not in ("", part):  # on the other part at the foot along that normal, if there is one
            (start, end), n = (
                (W[name] @ self.faces[name].xyz[:, 2] for name in (along, part)),
                normals @ self.axes.T,
            )
            feet = points + ((end - start) * n[:, 2])[:, None] * n[:, :2]
            there = np.where(self.covers((part,), feet)[:, None], feet, points)
            W[part] = self.faces[part].surface.weights(there)
        return self._along(part, W[part], normals)

    def areas(self, part: str) -> Vector:
        normals = self._normals[part]
        tilted = self.faces[part].surface.areas / (normals @ self.axes[2])
        return np.asarray(self._own_normals(part).T @ tilted)

    def contact_areas(self, pair: Pair) -> Vector:
        return self.faces[pair[0]].surface.areas[self.pairings[pair].nodes]

    def _own_normals(self, part: str) -> sp.csr_array:
        return self._along(part, sp.eye_array(len(self.faces[part].xyz), format="csr"), self._normals[part])

    @cached_property
    def shown(self) -> sp.csr_array | None:
        D = sp.csr_array(sp.block_diag([self._own_normals(name) for name in self.names]))
        alike = D.shape[0] == D.shape[1] and abs(D - sp.eye_array(D.shape[0])).max() == 0
        return None if alike else D

    def rigid_motion(self, part: str, pair: Pair, shift: float, slopes: Vector) -> Vector:
        pairing, face = self.pairings[pair], self.faces[pair[0]]
        at = face.xyz[pairing.nodes] if part == pair[0] else pairing.W @ self.faces[part].xyz
        xy, z = np.split(at - self._box.mean(axis=0), [2], axis=1)
        moved = np.column_stack([-z * slopes, shift + xy @ slopes])
        return np.asarray((face.normals[pairing.nodes] * moved).sum(axis=1))

    def grid(self, correlation_length: float) -> tuple[Vector, Vector]:
        def lines(start: float, stop: float) -> Vector:
            count = int(np.ceil(PER_LENGTH * (stop - start) / correlation_length - 1e-9)) + 1
            return np.linspace(start, stop, max(count, FEWEST))

        low, high = self.bounds
        return lines(low[0], high[0]), lines(low[1], high[1])

    def grid_weights(self, points: Matrix, correlation_length: float) -> tuple[Any, Any]:
        """The weights of the cubic splines of `from_grid`."""
        from scipy.interpolate import make_interp_spline

        lines = self.grid(correlation_length)
        Wx, Wy = (make_interp_spline(at, np.eye(len(at)))(points[:, k]) for k, at in enumerate(lines))
        return Wx, Wy

    def from_grid(self, pair: Pair, values: Matrix) -> Vector:
        from scipy.interpolate import RectBivariateSpline

        low, high = self.bounds
        x, y = (np.linspace(low[k], high[k], values.shape[1 - k]) for k in (0, 1))
        places = self.places(pair)
        return np.asarray(RectBivariateSpline(y, x, values)(places[:, 1], places[:, 0], grid=False))

    def plate_of(self, part: str) -> Plate | None:
        return None

    def outline(self, part: str) -> tuple[list[float], tuple[str, ...]]:
        nodes = self.nodes_of(part)
        return np.column_stack([nodes.min(axis=0), nodes.max(axis=0)]).ravel().tolist(), ()

    def contact_matrix(self) -> sp.csc_array:
        columns = [sp.csr_array((0, self.size[0]))]
        for (a, b), pairing in self.pairings.items():
            normals = self._normals[a][pairing.nodes]
            one = sp.eye_array(len(self.faces[a].xyz), format="csr")[pairing.nodes]
            rows = {a: self._along(a, one, normals)}
            if b != TOOL:
                rows[b] = -self._along(b, pairing.W, normals)
            columns.append(across(self, rows, len(pairing.nodes)))
        A = sp.csc_array(sp.vstack(columns).T)
        A.sort_indices()
        return A


def _slice(sizes: list[int], index: int) -> slice:
    """The numbers of one of consecutive groups of these sizes."""
    start = sum(sizes[:index])
    return slice(start, start + sizes[index])
