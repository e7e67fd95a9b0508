"""What an effect is: its parameters and the term that it adds.

An effect `kind = "some_effect"` in a scene is the class SomeEffect of problems/effects/some_effect.py.
Its module is imported only when a scene names it.

    StiffnessEffect   to the stiffness of one part, before condensation
    ForceEffect       forces on the junction nodes
    Positions         (positions.py) forces at points of the junction
    PartLoadEffect    (part.py) a load anywhere on one part, condensed onto its junction nodes
    GapEffect         to the initial gap; it may add the contact that it acts on
    SpringEffect         springs between the junction nodes of two parts, and their installation forces

One that acts on a part is a PartEffect as well, one that acts on contacts a ContactEffect.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from typing import Annotated, ClassVar

import numpy as np
import scipy.sparse as sp
from pydantic import Field, PrivateAttr

from problems.forms.assembly import Matrix, Vector

from .interface import AnyJoint, Pair
from .joint import TOOL, Faults, Table
from .plate import Plate, Range

#: A contact, or None for all. None is left out of a scene's key, as if the parameter did not exist.
Between = Annotated[Pair | None, Field(exclude_if=lambda pair: pair is None)]

#: Effects that a user may look for, and the assumption of the model that excludes each.
EXCLUDED = {
    "friction": "assumption 4: friction between the parts is neglected",
    "tangential": "assumption 2: fasteners hold the parts tangentially, only normal displacements remain",
    "sliding": "assumption 2: fasteners hold the parts tangentially, only normal displacements remain",
    "large_displacement": "assumption 5: linear elasticity, so displacements and rotations are small",
    "large_rotation": "assumption 5: linear elasticity, so displacements and rotations are small",
    "plasticity": "assumption 5: linear elasticity",
    "creep": "assumption 5: linear elasticity",
    "dynamics": "the answer is the minimum of a static energy, without inertia or time",
    "vibration": "the answer is the minimum of a static energy, without inertia or time",
    "impact": "the answer is the minimum of a static energy, without inertia or time",
}


class Effect(Table):
    """Parameters of an effect, each with its unit, as in Annotated[Positive, "mm"]."""

    #: Of the CSV that a table may name as `file` in place of `points`; none if there is no such file.
    columns: ClassVar[tuple[str, ...]] = ()
    kind: str
    #: Of each point, the line of its file; empty if they are from a list.
    _lines: tuple[str, ...] = PrivateAttr(())

    def point_name(self, k: int) -> str:
        return self._lines[k] if self._lines else f"points[{k}]"

    @property
    def contacts(self) -> tuple[Pair, ...]:
        """The contacts that this effect adds."""
        return ()

    def parts(self, joint: AnyJoint) -> tuple[str, ...]:
        """The parts on which it acts."""
        return joint.names

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        """Of parameters that do not fit the joint, or contradict the other effects of the scene."""
        yield from ()

    def unusual(self, joint: AnyJoint) -> Faults:
        """What may be, but is rarely meant: key, value, what is usual."""
        yield from ()


class PartEffect(Effect):
    """Acts on one part."""

    part: str

    def parts(self, joint: AnyJoint) -> tuple[str, ...]:
        return (self.part,)

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        yield from unknown_part(self.part, joint)


class ContactEffect(Effect):
    """Acts on the contact `between`, by default on all: each gets the gap, the fastener goes through each."""

    between: Between = None

    def pairs(self, joint: AnyJoint) -> tuple[Pair, ...]:
        """The contacts that it acts on."""
        return joint.pairs if self.between is None else (self.between,)

    def parts(self, joint: AnyJoint) -> tuple[str, ...]:
        named = (part for pair in self.pairs(joint) for part in pair)
        return tuple(dict.fromkeys(part for part in named if part in joint.names))

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if not joint.pairs:
            needs = f"needs a contact, but {joint.names[0]} is the only part"
            yield "between", self.between, f'{needs}: add a part, a rigid_tool or "tool" in contacts'
        elif self.between is not None and self.between not in joint.pairs:
            yield "between", list(self.between), f"one of the contacts {[list(pair) for pair in joint.pairs]}"


class StiffnessEffect(PartEffect):
    """Adds a term to the stiffness of one part, before condensation."""

    @property
    def held_points(self) -> tuple[tuple[float, float], ...]:
        """The points at which the effect supports the part."""
        return ()

    @property
    def pad(self) -> tuple[float, Range, Range] | None:
        """Thickness, x range and y range, mm, of an area whose thickness the effect sets."""
        return None

    @abstractmethod
    def stiffness(self, plate: Plate) -> sp.csr_array:
        """(plate.size, plate.size) term in N/mm, coupling only neighbouring grid lines y = const."""

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if self.part in joint.names:
            plate = joint.plate_of(self.part)
            yield from self.misfits(plate) if plate is not None else no_elements(self, joint)

    def misfits(self, plate: Plate) -> Faults:
        """Of parameters that do not fit the part."""
        yield from ()


class ForceEffect(Effect):
    """Adds nodal forces in the junction."""

    @abstractmethod
    def force(self, joint: AnyJoint) -> Vector:
        """(n,) forces in N, positive from the first part of a pair towards the second."""

    def marks(self, joint: AnyJoint) -> Matrix:
        """(k, 2) points to mark in figures of the junction, mm."""
        return np.zeros((0, 2))


class GapEffect(Effect):
    """Adds to the initial gap."""

    @abstractmethod
    def gap(self, joint: AnyJoint) -> Vector:
        """(m,) gap in mm."""

    def beyond(self, joint: AnyJoint) -> Vector:
        """(m,) how far each contact is from the nearest measured point if it is beyond these, mm; else 0."""
        return np.zeros(joint.size[1])


class SpringEffect(ForceEffect):
    """Adds springs between parts at points of the junction: K += T diag(k) Tᵀ, after condensation."""

    @abstractmethod
    def tied(self, joint: AnyJoint) -> list[Pair]:
        """The pairs that its springs join, each at all of its marks: the order of the columns of T."""

    @abstractmethod
    def springs(self, joint: AnyJoint) -> tuple[sp.csc_array, Vector]:
        """T (n, r), one column per spring with its direction, and k (r,) in N/mm."""


def at_contacts(values: Callable[[Pair], Vector | float], pairs: Sequence[Pair], joint: AnyJoint) -> Vector:
    """g (m,) with these values, (c,), at the contacts of each pair, and 0 at the others."""
    g = np.zeros(joint.size[1])
    for pair in pairs:
        g[joint.span(pair)] = values(pair)
    return g


def pressing_forces(
    acting: Callable[[Pair], Iterable[tuple[Matrix, float]]], pairs: Sequence[Pair], joint: AnyJoint
) -> Vector:
    """f (n,) of forces that press the two parts of each pair together along the normal of the first.

    acting : gives points (k, 2), mm, and the force at each of them, N.
    """
    f = np.zeros(joint.size[0])
    for pair in pairs:
        presses = list(acting(pair))
        for part, sign in sides(pair):
            nodal = np.zeros(f[joint.unknowns(part)].shape)
            for points, newton in presses:
                nodal += newton * joint.deflection(part, points, pair[0]).sum(axis=0)
            f[joint.unknowns(part)] += sign * nodal
    return f


def junction_load(effects: Iterable[Effect], joint: AnyJoint) -> tuple[Vector, Vector]:
    """f (n,) N, the forces in the junction, and g (m,) mm, the gaps, of some effects."""
    f, g = (np.zeros(size) for size in joint.size)
    for effect in effects:
        if isinstance(effect, ForceEffect):
            f += effect.force(joint)
        elif isinstance(effect, GapEffect):
            g += effect.gap(joint)
    return f, g


def sides(pair: Pair) -> list[tuple[str, float]]:
    """The parts of a pair, without a tool, and their signs in a column of A."""
    return [(part, sign) for part, sign in zip(pair, (1.0, -1.0), strict=True) if part != TOOL]


def unknown_part(part: str, joint: AnyJoint) -> Faults:
    if part not in joint.names:
        yield "part", part, f"one of {list(joint.names)}"


def no_elements(effect: PartEffect, joint: AnyJoint) -> Faults:
    """Of an effect that acts on the elements of its part."""
    if effect.part in joint.names and joint.plate_of(effect.part) is None:
        kind = f"a superelement has no elements for {effect.kind} to act on: put it into its K"
        yield "part", effect.part, kind


def effect_kinds() -> list[str]:
    """All kinds: the files of problems/effects."""
    package = importlib.import_module("problems.effects")
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def effect_class(kind: str) -> type[Effect]:
    """The class of a kind, imported on demand. Raises ModuleNotFoundError if there is no such kind."""
    module = importlib.import_module(f"problems.effects.{kind}")
    return getattr(module, kind.title().replace("_", ""))
