"""The base classes of effects. An effect is a table of parameters and the term that it adds to the problem.

An effect `kind = "some_effect"` in a scene is the class SomeEffect of problems/effects/some_effect.py. Its
module is imported only when a scene names it. A table in docs/effects.md says which base class to take. An
effect that acts on contacts and adds to the gap derives from two: `class Shims(ContactEffect, GapEffect)`.
"""

import inspect
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypeVar

import numpy as np
import scipy.sparse as sp
from pydantic import Discriminator, Field, PrivateAttr, Tag

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded_types import NUMBER, NUMBERS, Finite, Name, NotNegative, Range, is_list
from problems.input.scan_points import CLOSE, crowded

from .interface import AnyJoint
from .joint import Faults, Pair, Table
from .plate import Plate

N = TypeVar("N")
L = TypeVar("L")
#: A number N, or a list L of numbers.
OneOr = Annotated[Annotated[N, Tag(NUMBER)] | Annotated[L, Tag(NUMBERS)], Discriminator(is_list)]
#: A contact, or None for all. None is left out of a scene's key, as if the parameter did not exist.
Between = Annotated[Pair | None, Field(exclude_if=lambda pair: pair is None)]


class Effect(Table):
    """A [[effect]] table of a scene: its parameters, checked, each with its unit.

    Parameters are fields of the class; the unit is a string in `Annotated`, which messages repeat.

    Examples
    --------
    >>> from problems.effects.self_weight import SelfWeight
    >>> SelfWeight(kind="self_weight", part="skin").density  # Annotated[Positive, "kg/m³"] = 2700.0
    2700.0
    """

    #: Columns of the CSV that a table may name as `file` in place of `points`; empty if it may not.
    columns: ClassVar[tuple[str, ...]] = ()
    #: Columns that it may have besides, each a parameter with a number for each point.
    more_columns: ClassVar[tuple[str, ...]] = ()
    kind: str
    #: By which the stages of a scene call it.
    name: Name | None = None
    #: The line of each point in its file; empty if the points are from a list.
    _lines: tuple[str, ...] = PrivateAttr(())
    #: The stage of each point in its file; empty if the file has no column `stage`.
    _stages: tuple[str, ...] = PrivateAttr(())

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Refuse a parameter that hides a method or property of a base class."""
        for base in cls.__mro__[1:]:
            if hidden := [name for name in cls.model_fields if name in vars(base)]:
                taken = f"{base.__name__} has a method or property of this name"
                raise TypeError(f"{cls.__name__}.{hidden[0]}: call the parameter otherwise: {taken}")

    def point_name(self, k: int) -> str:
        """The name of point k in messages: its line in the file, or points[k]."""
        return self._lines[k] if self._lines else f"points[{k}]"

    @property
    def contacts(self) -> tuple[Pair, ...]:
        """The contacts (a, b) that this effect adds to the joint."""
        return ()

    def marks(self, joint: AnyJoint) -> Matrix:
        """The points that pictures of the junction mark for this effect.

        Returns
        -------
        (k, 2) ndarray
            x and y in mm.
        """
        return np.zeros((0, 2))

    def element_count(self, joint: AnyJoint) -> int:
        """The number of elements, at points, that stages can set one by one; 0 if it only acts as a whole."""
        return 0

    def only(self, elements: Sequence[int], joint: AnyJoint) -> Self:
        """The effect of some of its elements."""
        return self

    def faults(self, joint: AnyJoint, others: Sequence["Effect"] = ()) -> Faults:
        """Yield the parameters that do not fit the joint, or contradict other effects of the scene.

        Called once a scene's tables are read: it is refused with all faults in one message.

        Parameters
        ----------
        joint : AnyJoint
            The joint with the contacts that effects add.
        others : sequence of Effect
            The other effects of the scene.

        Yields
        ------
        (str, object, str)
            The key of the parameter, its value, and what is allowed.
        """
        yield from ()

    def unusual(self, joint: AnyJoint) -> Faults:
        """Yield the parameters that are possible but rarely meant: key, value, what is usual."""
        yield from ()


class PartEffect(Effect):
    """An effect on one part; the table names it as `part`."""

    part: str

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        yield from unknown_part(self.part, joint)


class ContactEffect(Effect):
    """An effect on the contact `between`, by default on each contact of the joint."""

    between: Between = None

    def pairs(self, joint: AnyJoint) -> tuple[Pair, ...]:
        """The contacts (a, b) on which the effect acts."""
        return joint.pairs if self.between is None else (self.between,)

    def parts(self, joint: AnyJoint) -> tuple[str, ...]:
        """The names of the parts on which the effect acts."""
        named = (part for pair in self.pairs(joint) for part in pair)
        return tuple(dict.fromkeys(part for part in named if part in joint.names))

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if not joint.pairs:
            needs = f"needs a contact, but {joint.names[0]} is the only part"
            yield "between", self.between, f'{needs}: add a part, a rigid_tool or "tool" in contacts'
        elif self.between is not None and self.between not in joint.pairs:
            yield "between", list(self.between), f"one of the contacts {[list(pair) for pair in joint.pairs]}"


class ElementEffect(PartEffect):
    """An effect on the finite elements of a plate; a superelement has none."""

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if self.part in joint.names:
            if (plate := joint.plate_of(self.part)) is not None:
                yield from self.misfits(plate)
            else:
                allowed = f"a superelement has no elements for {self.kind} to act on: put it into its K"
                yield "part", self.part, allowed

    def misfits(self, plate: Plate) -> Faults:
        """Yield the parameters that do not fit the part; see `faults`, and `on_part` for what is allowed.

        Parameters
        ----------
        plate : Plate
            The elements of the whole part, in the junction and beyond it.
        """
        yield from ()


class StiffnessEffect(ElementEffect):
    """A term of the stiffness of one part, before condensation."""

    @property
    def held_points(self) -> tuple[tuple[float, float], ...]:
        """The points (x, y), mm, at which the effect supports the part."""
        return ()

    @property
    def pad(self) -> tuple[float, Range, Range] | None:
        """Thickness, x range and y range, mm, of an area whose thickness the effect sets."""
        return None

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if self.part not in joint.names or not self.held_points:
            return
        (*_, south, north), clamped = joint.outline(self.part)
        built_in = [y for edge, y in (("south", south), ("north", north)) if edge in clamped]
        for k, point in enumerate(self.held_points):
            if any(abs(point[1] - y) <= CLOSE for y in built_in):
                allowed = "a point off the clamped edges: these are built in, and no support_shift moves them"
                yield f"points[{k}]", list(point), allowed
        for first, twin in crowded(np.array(self.held_points)):
            allowed = f"separate places: points[{first}] is there, too"
            yield f"points[{twin}]", list(self.held_points[twin]), allowed
        count = len(self.held_points)
        for other in others:
            if isinstance(other, StiffnessEffect) and other.part == self.part and other.held_points:
                both = crowded(np.array([*self.held_points, *other.held_points]))
                for k in (i for i, twin in both if i < count <= twin):
                    allowed = f"separate places: other {other.kind} are there, too"
                    yield f"points[{k}]", list(self.held_points[k]), allowed

    @abstractmethod
    def stiffness(self, plate: Plate) -> sp.csr_array:
        """The term, added to the stiffness of the part.

        Parameters
        ----------
        plate : Plate
            The elements of the part.

        Returns
        -------
        (plate.size, plate.size) csr_array
            Symmetric but for rounding, N/mm for deflections; coupling only neighbouring mesh lines y = const.
        """


class ForceEffect(Effect):
    """Forces in the junction."""

    @abstractmethod
    def force(self, joint: AnyJoint) -> Vector:
        """The forces, added to f.

        Parameters
        ----------
        joint : AnyJoint
            Its `deflection` distributes a force at a point over the unknowns around it.

        Returns
        -------
        (n,) ndarray
            N, positive from the first part of a contact towards the second.
        """


class GapEffect(Effect):
    """A term of the initial gap."""

    @abstractmethod
    def gap(self, joint: AnyJoint) -> Vector:
        """The gap, added to g.

        Parameters
        ----------
        joint : AnyJoint
            Its `places` are the points of the contacts.

        Returns
        -------
        (m,) ndarray
            mm; negative where the parts overlap before they are loaded.
        """

    def beyond(self, joint: AnyJoint) -> Vector:
        """(m,) how far each contact is from the nearest measured point if it is beyond these, mm; else 0."""
        return np.zeros(joint.size[1])


class SpringEffect(ForceEffect):
    """Springs between two parts at points of the junction, after condensation.

        K += T diag(k) Tᵀ,    f += T (preload + k · approach)

    Each pulls the parts together with preload + k (approach − tᵀx), N.

    Parameters
    ----------
    approach : float or tuple of float
        The elongation at which a spring has its preload, mm: of all springs, or of each column of T.
    preload : float or tuple of float
        N, of all springs or of those at each point.
    """

    approach: Annotated[OneOr[Finite, tuple[Finite, ...]], "mm"] = 0.0
    preload: Annotated[
        OneOr[NotNegative, tuple[NotNegative, ...]], Field(exclude_if=lambda force: force == 0), "N"
    ] = 0.0

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        count = self.spring_count(joint)
        if isinstance(self.approach, tuple) and len(self.approach) != count:
            yield "approach", list(self.approach), f"one number, or one for each of {count} springs"

    def spring_count(self, joint: AnyJoint) -> int:
        """r, the number of springs: one at each mark for each pair that they join."""
        return len(self.tied(joint)) * len(self.marks(joint))

    def force(self, joint: AnyJoint) -> Vector:
        T, k = self.springs(joint)
        return T @ (k * self.approach + np.resize(self.preload, len(k)))

    def tension(self, joint: AnyJoint, x: Vector) -> Vector:
        """(r,) the force of each spring at displacements x (n,) mm; N."""
        T, k = self.springs(joint)
        return k * (self.approach - T.T @ x) + np.resize(self.preload, len(k))

    @abstractmethod
    def marks(self, joint: AnyJoint) -> Matrix:
        """(k, 2) mm, the points of the springs of each pair."""

    @abstractmethod
    def tied(self, joint: AnyJoint) -> list[Pair]:
        """The pairs of parts that the springs join, each at all marks: the order of the columns of T."""

    @abstractmethod
    def springs(self, joint: AnyJoint) -> tuple[sp.csc_array, Vector]:
        """The directions and the stiffness of the springs.

        Returns
        -------
        T : (n, r) csc_array
            A column per spring: its elongation is Tᵀx.
        k : (r,) ndarray
            N/mm.
        """


def code_of(effects: Iterable[Effect]) -> list[Path]:
    """The files of their classes, which no import names: what is kept in the cache by code needs them."""
    modules = (inspect.getmodule(type(effect)) for effect in effects)
    return [Path(inspect.getfile(module)) for module in modules if module]


def unknown_part(part: str, joint: AnyJoint) -> Faults:
    """Yield the fault of a name that no part of the joint has."""
    if part not in joint.names:
        yield "part", part, f"one of {list(joint.names)}"
