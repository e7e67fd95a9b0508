"""Effects that load one part anywhere, in the junction or beyond it."""

from __future__ import annotations

from abc import abstractmethod

from problems.forms.assembly import Vector

from .effect import PartEffect
from .part import PartModel


class PartLoadEffect(PartEffect):
    """Adds a load on one part, in the junction or beyond it."""

    @abstractmethod
    def load(self, model: PartModel) -> Vector:
        """(plate.size,) generalised force on each degree of freedom: N, N·mm, N·mm²."""
