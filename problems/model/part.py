"""One part as finite elements: its plate, the effects that stiffen, hold or load it, and its junction lines.

All models of a part (condensed stiffness, condensed loads, the model without condensation) take its unknowns
from here: the deflections at the junction nodes, those at built-in edges, and the others.

A coarser model, for a preconditioner, has fewer mesh lines beyond the junction: K̂' = PᵀK̂P, where P
interpolates in a subset of the lines y = const. Lines stay close near the junction, where the short waves
are, and lines of stiff beams and supports are kept. The compliance of the junction then changes by 5e-4 of
itself on long parts and up to 1e-2 on short strips. A band across the part is half as wide, so that work that
grows with its cube falls to an eighth.
"""

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Indices, Vector

from .effect import ElementEffect, StiffnessEffect
from .joint import Joint, Part
from .plate import WHOLE, LineLoads, Plate, line_loads

#: The folders whose code makes a part's stiffness.
CODE = ("problems/model", "problems/effects")


@dataclass(frozen=True)
class PartModel:
    """A part's plate and the effects that stiffen and hold it.

    junction : the mesh lines y = const of the junction. clamped : the lines that are built in.
    geometry : the tables of the junction and of the part without its name, for keys; empty if made without.
    """

    plate: Plate
    effects: tuple[StiffnessEffect, ...]
    junction: range
    clamped: frozenset[int] = frozenset()
    geometry: tuple[dict[str, Any], ...] = ()

    @classmethod
    def of(cls, joint: Joint, part: Part, effects: tuple[StiffnessEffect, ...]) -> "PartModel":
        """The model of a part with those of the effects that act on it."""
        plate = joint.plate(part)
        first = part.south.elements if part.south else 0
        edges = {"south": 0, "north": len(plate.y) - 1}
        return cls(
            plate,
            tuple(effect for effect in effects if effect.part == part.name),
            range(first, first + len(joint.y)),
            frozenset(edges[edge] for edge in part.clamped),
            (joint.junction.model_dump(mode="json"), part.model_dump(mode="json", exclude={"name"})),
        )

    def stiffness(self) -> sp.csr_array:
        """(plate.size, plate.size), N/mm and N: the plate and the terms of its effects, nothing clamped."""
        return sp.csr_array(self.plate.stiffness() + self.added) if self.effects else self.plate.stiffness()

    @cached_property
    def added(self) -> sp.csr_array:
        """The terms of the effects, symmetric to the last bit."""
        terms = (effect.stiffness(self.plate) for effect in self.effects)
        K = sum(terms, start=sp.csr_array((self.plate.size, self.plate.size)))
        return sp.csr_array((K + K.T) / 2)

    @property
    def free_lines(self) -> list[int]:
        """The mesh lines that are not built in, by ascending y."""
        return [line for line in range(len(self.plate.y)) if line not in self.clamped]

    @property
    def deflections(self) -> Indices:
        """The deflections at the junction nodes, x running fastest: what condensation keeps."""
        return np.concatenate([self.plate.deflection_dofs(line) for line in self.junction])

    @property
    def others(self) -> Indices:
        """The free unknowns that condensation eliminates."""
        held = np.zeros(self.plate.size, dtype=bool)
        held[self.deflections] = True
        for line in self.clamped:
            held[self.plate.line_dofs(line)] = True
        return np.flatnonzero(~held)

    def areas(self) -> Iterator[tuple[float, float, LineLoads, LineLoads]]:
        """Yield (sign, thickness, loads along x, loads along y); their sum is the part with its pads."""
        plate = self.plate
        areas = [(1.0, plate.thickness, WHOLE, WHOLE)]
        for thickness, x, y in (effect.pad for effect in self.effects if effect.pad):
            areas += [(1.0, thickness, x, y), (-1.0, plate.thickness, x, y)]
        for sign, thickness, x, y in areas:
            yield sign, thickness, line_loads(plate.x, *x), line_loads(plate.y, *y)


class PartLoadEffect(ElementEffect):
    """A load on one part, in the junction or beyond it; it is condensed onto the junction."""

    @abstractmethod
    def load(self, model: PartModel) -> Vector:
        """The load on all unknowns of the part.

        Parameters
        ----------
        model : PartModel
            The elements of the part (`model.plate`) and the StiffnessEffects that act on it.

        Returns
        -------
        (plate.size,) ndarray
            Generalised forces: N on a deflection, N·mm on a slope, N·mm² on a twist.

        Examples
        --------
        >>> import numpy as np
        >>> from problems.effects.self_weight import SelfWeight
        >>> from problems.model.plate import Plate
        >>> plate = Plate(np.linspace(0, 400, 5), np.linspace(0, 100, 3), 2.0, 70e3, 0.3)
        >>> f = SelfWeight(kind="self_weight", part="skin").load(PartModel(plate, (), range(3)))
        >>> print(f.shape, f[plate.deflection_dofs(0)].sum().round(4))
        (60,) 0.5296
        """

    def free_curvature(self, thickness: Vector) -> Vector:
        """The curvature −w_xx = −w_yy, 1/mm, that the free part would take without stress.

        Parameters
        ----------
        thickness : (k,) ndarray
            mm, of k points.

        Returns
        -------
        (k,) ndarray
            Zero, unless the effect is an initial strain.
        """
        return np.zeros_like(thickness)


GROWTH = 1.2  # of the distance between lines, away from the junction
PEAK = 2.0  # lines stay to which effects add more than PEAK times the median stiffness beyond the junction


def graded(model: PartModel) -> PartModel:
    """The same part with fewer mesh lines beyond its junction."""
    first, last, end = model.junction.start, model.junction.stop - 1, len(model.plate.y) - 1
    kept = set(model.junction) | {first - k for k in _graded(first)} | {last + k for k in _graded(end - last)}
    kept |= _stiff_lines(model)
    lines = sorted(kept)
    place = {line: k for k, line in enumerate(lines)}
    return replace(
        model,
        plate=replace(model.plate, y=model.plate.y[lines]),
        junction=range(place[first], place[last] + 1),
        clamped=frozenset(place[line] for line in model.clamped),
    )


def _graded(count: int) -> list[int]:
    """Distances 1, 2, … up to `count`, in lines, with growing steps."""
    steps = (GROWTH ** np.arange(count)).astype(int)
    return [*np.cumsum(steps)[np.cumsum(steps) < count].tolist(), count] if count else []


def _stiff_lines(model: PartModel) -> set[int]:
    """The lines to which effects add far more stiffness than to others, as beams along them or supports."""
    added = model.added.diagonal().reshape(len(model.plate.y), 2, -1, 2)[:, 0, :, 0].sum(axis=1)
    beyond = np.delete(added, model.junction)
    return set(np.flatnonzero(added > PEAK * np.median(beyond)).tolist()) if beyond.size else set()
