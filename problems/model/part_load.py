"""Effects that load one part anywhere, in the junction or beyond it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator

from problems.forms.assembly import Vector

from .effect import Effect, unknown_part
from .joint import Joint
from .part import PartModel


class PartLoadEffect(Effect):
    """Adds a load on one part, in the junction or beyond it."""

    part: str

    @abstractmethod
    def load(self, model: PartModel) -> Vector:
        """(plate.size,) generalised force on each degree of freedom: N, N·mm, N·mm²."""

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        yield from unknown_part(self.part, joint)
