"""The joint: the junction strip, the parts that meet there, and the contacts between them.

y = width + north.length   ┌──────────────┐   far edge, may be clamped
                           │   fragment   │
y = width                  ├──────────────┤
                           │   junction   │   all parts have nodes here
y = 0                      ├──────────────┤
                           │     wing     │
y = −south.length          └──────────────┘
                           x = 0 … length
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import scipy.sparse as sp
from pydantic import BaseModel, ConfigDict, Field, field_validator

from problems.forms.assembly import Mask, Matrix, Vector
from problems.input.bounded_types import PLAIN, Name, Positive, with_units

from .plate import Plate
from .surface import SAME, Grid, refuse_off

MOST, MOST_NODES = 100_000, 10**7  # mesh lines, nodes; what fits in memory is another question
NodeCount = Annotated[int, Field(ge=2, le=MOST), PLAIN]
SHORT = 20.0  # mm, a junction that may have been given in metres
SLENDER = 50.0  # an element's longer side to its shorter
SOFT, STIFF = 1e3, 1e6  # N/mm², around the moduli of plastics and metals
TOOL = "tool"  # the second of a contact pair: a rigid surface
Pair = tuple[str, str]
#: (key, value, what is allowed)
Faults = Iterator[tuple[str, object, str]]


class Table(BaseModel):
    """A table of a TOML file; unknown keys in it are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_extra=with_units)


class Junction(Table):
    """The strip where the parts meet: length along x and width along y in mm, nodes along each."""

    length: Annotated[Positive, "mm"]
    width: Annotated[Positive, "mm"]
    nodes: tuple[NodeCount, NodeCount]

    @field_validator("nodes")
    @classmethod
    def _not_too_many(cls, nodes: tuple[int, int]) -> tuple[int, int]:
        if nodes[0] * nodes[1] > MOST_NODES:
            raise ValueError(f"must be at most {MOST_NODES} nodes")
        return nodes


class Extension(Table):
    """The part's plate beyond the junction: its length in mm and its elements across that length."""

    length: Annotated[Positive, "mm"]
    elements: Annotated[int, Field(ge=1, le=MOST), PLAIN]


class Part(Table):
    """A plate: the junction strip and an optional extension on either side.

    thickness in mm, young in N/mm²; clamped names the far edges where the part is built in.
    """

    name: Name
    thickness: Annotated[Positive, "mm"]
    young: Annotated[Positive, "N/mm²"] = 70e3
    poisson: Annotated[float, Field(ge=0, lt=0.5), PLAIN] = 0.33
    south: Extension | None = None
    north: Extension | None = None
    clamped: tuple[Literal["south", "north"], ...] = ()


class Joint(Table):
    """Junction, parts and contacts. A contact (a, b) means x_a − x_b ≤ g at every junction node."""

    shortest: ClassVar[float] = 0.0
    shown: ClassVar[None] = None
    ids: ClassVar[None] = None
    junction: Junction
    part: Annotated[tuple[Part, ...], Field(min_length=1, max_length=100)]
    contacts: Annotated[tuple[Pair, ...], Field(min_length=1)] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.name for part in self.part)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The contacts; by default each part with the next one, so none if there is one part."""
        return self.contacts or tuple(itertools.pairwise(self.names))

    def with_contacts(self, pairs: tuple[Pair, ...]) -> Self:
        return self.model_copy(update={"contacts": pairs})

    @property
    def content(self) -> Any:
        return self.model_dump(mode="json")

    @property
    def node_count(self) -> int:
        nx, ny = self.junction.nodes
        return nx * ny

    @property
    def size(self) -> tuple[int, int]:
        return len(self.part) * self.node_count, len(self.pairs) * self.node_count

    @property
    def x(self) -> np.ndarray:
        return np.linspace(0.0, self.junction.length, self.junction.nodes[0])

    @property
    def y(self) -> np.ndarray:
        return np.linspace(0.0, self.junction.width, self.junction.nodes[1])

    @property
    def nodes(self) -> Matrix:
        """(node_count, 2) coordinates of the junction nodes in mm, x running fastest."""
        X, Y = np.meshgrid(self.x, self.y)
        return np.column_stack([X.ravel(), Y.ravel()])

    @property
    def bounds(self) -> Matrix:
        return np.array([[0.0, 0.0], [self.junction.length, self.junction.width]])

    @property
    def thinnest(self) -> float:
        return min(part.thickness for part in self.part)

    @property
    def surface(self) -> Grid:
        return Grid(self.x, self.y)

    def weights(self, points: Matrix) -> sp.csr_array:
        """W (k, node_count) of points (k, 2), mm, bilinear on each element; see `surface`."""
        return self.surface.weights(points)

    def deflection(self, part: str, points: Matrix, along: str = "") -> sp.csr_array:
        """The weights of the points, as all normals are that of the junction. Raises InputError beyond it."""
        refuse_off(points, Grid(self.x, self.y, same=SAME).covers(points))
        return self.weights(points)

    def covers(self, parts: tuple[str, ...], points: Matrix) -> Mask:
        return self.surface.covers(points)

    def areas(self, part: str) -> Vector:
        return self.surface.areas

    def contact_areas(self, pair: Pair) -> Vector:
        return self.surface.areas

    def unknowns(self, part: str) -> slice:
        index = self.names.index(part)
        return slice(index * self.node_count, (index + 1) * self.node_count)

    def span(self, pair: Pair) -> slice:
        start = self.pairs.index(pair) * self.node_count
        return slice(start, start + self.node_count)

    def places(self, pair: Pair) -> Matrix:
        return self.nodes

    def nodes_of(self, part: str) -> Matrix:
        return self.nodes

    def rigid_motion(self, part: str, pair: Pair, shift: float, slopes: Vector) -> Vector:
        return np.asarray(shift + (self.nodes - self.bounds.mean(axis=0)) @ slopes)

    def grid(self, correlation_length: float) -> tuple[Vector, Vector]:
        return self.x, self.y

    def grid_weights(self, points: Matrix, correlation_length: float) -> tuple[Any, Any]:
        """The bilinear weights, summed over y and over x."""
        W, (nx, ny) = self.weights(points), self.junction.nodes
        over_y = sp.kron(np.ones((ny, 1)), sp.eye_array(nx))
        return W @ over_y, W @ sp.kron(sp.eye_array(ny), np.ones((nx, 1)))

    def from_grid(self, pair: Pair, values: Matrix) -> Vector:
        return values.ravel()

    def plate_of(self, part: str) -> Plate | None:
        return self.plate(self.part[self.names.index(part)])

    def outline(self, part: str) -> tuple[list[float], tuple[str, ...]]:
        own = self.part[self.names.index(part)]
        y = self.plate(own).y
        return [0.0, self.junction.length, y[0], y[-1]], own.clamped

    def contact_matrix(self) -> sp.csc_array:
        """A, (n, m): +1 for the first part of a pair, −1 for the second unless that is the tool."""
        A = sp.csc_array(sp.kron(signs(self.names, self.pairs).T, sp.eye_array(self.node_count)))
        A.sort_indices()
        return A

    def plate(self, part: Part) -> Plate:
        """The finite-element model of a part: the mesh lines of the junction and those of its extensions."""
        y = [self.y]
        if part.south:
            y.insert(0, np.linspace(-part.south.length, 0.0, part.south.elements + 1)[:-1])
        if part.north:
            end = self.junction.width + part.north.length
            y.append(np.linspace(self.junction.width, end, part.north.elements + 1)[1:])
        return Plate(self.x, np.concatenate(y), part.thickness, part.young, part.poisson)

    def faults(self) -> Faults:
        for part in self.part:
            for edge in part.clamped:
                if getattr(part, edge) is None:
                    yield f"part.{part.name}.clamped", edge, f"needs an extension to the {edge}"
        yield from wrong_contacts(self.names, self.contacts, self.pairs)

    def unusual(self) -> Faults:
        length, width = self.junction.length, self.junction.width
        if max(length, width) < SHORT:
            yield "junction.length", length, f"at least {SHORT:g} mm: are these metres?"
        hx, hy = self.x[1], self.y[1]
        if max(hx, hy) > SLENDER * min(hx, hy):
            sides = f"elements about as long as wide, not {hx:.3g} x {hy:.3g} mm"
            yield "junction.nodes", list(self.junction.nodes), sides
        for part in self.part:
            y = self.plate(part).y
            if part.thickness > (side := min(length, y[-1] - y[0])):
                yield f"part.{part.name}.thickness", part.thickness, f"far less than the part's {side:g} mm"
            if not SOFT <= part.young <= STIFF:
                metals = f"{SOFT:g} … {STIFF:g} N/mm²; aluminium has 70e3"
                yield f"part.{part.name}.young", part.young, metals


def signs(names: Sequence[str], pairs: Sequence[Pair]) -> Matrix:
    """(pairs, parts): +1 for the first part of a pair, −1 for the second, 0 for the others."""
    rows = [[float(name == a) - (name == b) for name in names] for a, b in pairs]
    return np.array(rows).reshape(len(pairs), len(names))


def wrong_contacts(
    names: Sequence[str], contacts: Sequence[Pair], pairs: Sequence[Pair], at_one_place: bool = True
) -> Faults:
    """Yield the faults of names of parts and of contacts.

    contacts : the pairs that the scene names. pairs : all pairs, the default ones and those of effects too.
    at_one_place : whether all pairs meet at the same nodes. One pair of a closed chain then follows from the
    others, and Q = AᵀK⁻¹A is singular.
    """
    parts = list(names)
    if len(set(parts)) < len(parts) or TOOL in parts:
        yield "part.name", parts, f'each part needs a unique name other than "{TOOL}"'
    for pair in contacts:
        if pair[0] not in parts or pair[1] not in (*parts, TOOL) or pair[0] == pair[1]:
            yield "contacts", list(pair), f'two different parts of {parts}; the second may be "{TOOL}"'
    sides = signs(parts, pairs)
    if len(np.unique(abs(sides), axis=0)) < len(pairs):
        yield "contacts", [list(pair) for pair in pairs], "no pair twice"
    elif at_one_place and pairs and np.linalg.matrix_rank(sides) < len(pairs):
        yield "contacts", [list(pair) for pair in pairs], "no closed chain of pairs"
