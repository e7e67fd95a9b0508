"""The interface of a joint, of plates or of superelements, to effects, pictures and commands."""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Indices, Mask, Matrix, Vector

from .joint import Faults, Pair
from .plate import Plate


class AnyJoint(Protocol):
    """Parts whose displacements x (n,) may touch at m contacts: x_a − x_b ≤ g, along the normal from a to b.

    Points (k, 2) are in the plane of the junction, mm.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the parts."""

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The contacts (a, b); b may be "tool"."""

    @property
    def size(self) -> tuple[int, int]:
        """(n, m)."""

    @property
    def bounds(self) -> Matrix:
        """(2, 2) the lower and the upper corner of the junction."""

    @property
    def thinnest(self) -> float:
        """The least thickness of its plates, mm; infinite if that is not known."""

    @property
    def shortest(self) -> float:
        """The least correlation length of a random field, mm."""

    @property
    def content(self) -> Any:
        """The data that determine K and A without effects, as JSON, for keys."""

    @property
    def shown(self) -> sp.csr_array | None:
        """D (d, n): Dx are the normal displacements at the nodes, part by part; None if x is that."""

    @property
    def ids(self) -> tuple[Indices, Indices] | None:
        """The ids of the nodes at which Dx is given, and of the node of each contact; None without ids."""

    def with_contacts(self, pairs: tuple[Pair, ...]) -> "AnyJoint":
        """The same joint with these contacts."""

    def unknowns(self, part: str) -> slice:
        """The part's displacements, as a slice of x."""

    def span(self, pair: Pair) -> slice:
        """The contacts of a pair, as a slice of g and λ."""

    def places(self, pair: Pair) -> Matrix:
        """(c, 2) the points of a pair's contacts."""

    def nodes_of(self, part: str) -> Matrix:
        """The nodes (c, 2) at which Dx is given."""

    def covers(self, parts: tuple[str, ...], points: Matrix) -> Mask:
        """(k,) which points are on all of these parts."""

    def deflection(self, part: str, points: Matrix, along: str = "") -> sp.csr_array:
        """W (k, unknowns of the part): Wu are the part's displacements at points, Wᵀp the nodal forces of
        forces p there, both along the normal of the part `along`, by default of `part`. Raises InputError if
        a point is off one of them.
        """

    def areas(self, part: str) -> Vector:
        """(unknowns of the part,) forces of a pressure of 1 N/mm² along its normals."""

    def contact_areas(self, pair: Pair) -> Vector:
        """(c,) mm², the tributary areas of a pair's contacts on the first part, in the plane."""

    def rigid_motion(self, part: str, pair: Pair, shift: float, slopes: Vector) -> Vector:
        """(c,) how far a part that is shifted and tilted moves along the normals of a pair's contacts, mm.

        shift : mm, along the normal of the junction. slopes (2,) : along x and y, about its centre.
        """

    def grid(self, correlation_length: float) -> tuple[Vector, Vector]:
        """x and y of a grid over the junction on which a random field of that length is drawn."""

    def grid_weights(self, points: Matrix, correlation_length: float) -> tuple[Any, Any]:
        """Wx (k, len(x)) and Wy (k, len(y)), sparse or not: a field z (len(y), len(x)) on that grid has the
        value Σ_ij Wy_ki z_ij Wx_kj at point k of points (k, 2), mm.
        """

    def from_grid(self, pair: Pair, values: Matrix) -> Vector:
        """(c,) the values at the contacts of a pair of a field (len(y), len(x)) on that grid."""

    def plate_of(self, part: str) -> Plate | None:
        """The finite elements of a part; None of a superelement."""

    def outline(self, part: str) -> tuple[list[float], tuple[str, ...]]:
        """[west, east, south, north] of the whole part, mm, and its edges that are clamped."""

    def contact_matrix(self) -> sp.csc_array:
        """A (n, m)."""

    def faults(self) -> Faults:
        """Yield the faults that the types cannot catch: key, value, what is allowed."""

    def unusual(self) -> Faults:
        """Yield values that are possible but rarely meant: key, value, what is usual."""


def extent(bounds: Matrix) -> str:
    """The ranges of x and y between two corners (2, 2), for messages."""
    (west, south), (east, north) = bounds
    return f"{west:g} … {east:g} × {south:g} … {north:g} mm"


def on_part(plate: Plate) -> str:
    """The words for the points of a part, for messages."""
    return f"on the part, {extent(plate.bounds)}"


def on_junction(joint: AnyJoint) -> str:
    """The words for the points of a junction, for messages."""
    bays = "" if joint.plate_of(joint.names[0]) else ", not in a bay or a hole of a part"
    return f"on the junction, {extent(joint.bounds)}{bays}"


def across(joint: AnyJoint, rows: Mapping[str, sp.sparray], count: int) -> sp.csr_array:
    """(count, n) rows over all unknowns, from rows (count, unknowns of the part) on some parts."""
    spans = {part: joint.unknowns(part) for part in joint.names}
    none = {part: sp.csr_array((count, span.stop - span.start)) for part, span in spans.items()}
    return sp.csr_array(sp.hstack([rows.get(part, none[part]) for part in joint.names]))


def places_of(joint: AnyJoint, pairs: Iterable[Pair]) -> Matrix:
    """(k, 2) the places of the contacts of some pairs, mm."""
    return np.concatenate([np.zeros((0, 2)), *map(joint.places, pairs)])
