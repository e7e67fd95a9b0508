"""What an effect is: its parameters, and the one term that it adds.

An effect `kind = "some_effect"` in a scene is the class SomeEffect of problems/effects/some_effect.py.
Its module is imported only when a scene names it.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import abstractmethod
from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from .assembly import Matrix, Vector
from .joint import Joint, Table
from .plate import Plate


class Effect(Table):
    """Parameters of an effect, in mm and N."""

    kind: str

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        """(key, value, what is allowed) of whatever does not fit the joint."""
        yield from ()


class StiffnessEffect(Effect):
    """Adds a term to the stiffness of one part, before condensation."""

    part: str

    @property
    def held_points(self) -> tuple[tuple[float, float], ...]:
        """Where the effect keeps the part from floating away."""
        return ()

    @abstractmethod
    def stiffness(self, plate: Plate) -> sp.csr_array:
        """(plate.size, plate.size) term in N/mm, coupling only neighbouring grid lines y = const."""

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        yield from unknown_part(self.part, joint)


class ForceEffect(Effect):
    """Adds nodal forces in the junction."""

    @abstractmethod
    def force(self, joint: Joint) -> Vector:
        """(n,) forces in N, positive from the first part of a pair towards the second."""

    def marks(self, joint: Joint) -> Matrix:
        """(k, 2) points in mm that a picture of the junction should mark."""
        return np.zeros((0, 2))


class GapEffect(Effect):
    """Adds to the initial gap."""

    @abstractmethod
    def gap(self, joint: Joint) -> Vector:
        """(m,) gap in mm."""


def unknown_part(part: str, joint: Joint) -> Iterator[tuple[str, object, str]]:
    names = [p.name for p in joint.part]
    if part not in names:
        yield "part", part, f"one of {names}"


def effect_kinds() -> list[str]:
    """The kinds there are: the files of problems/effects."""
    package = importlib.import_module("problems.effects")
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def effect_class(kind: str) -> type[Effect]:
    """The class of a kind, imported now. Raises ModuleNotFoundError if there is no such kind."""
    module = importlib.import_module(f"problems.effects.{kind}")
    return getattr(module, kind.title().replace("_", ""))
