"""Many load cases on one assembly, f and g, made on demand: lists, random or measured gaps, scans, keys."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from problems.forms.assembly import LoadCase
from problems.model.scene import JointScene, Scene
from problems.storage import digest

#: The kinds of effects whose gaps the cases of a series replace. Those of shims, positions and tools stay.
REPLACED = ("initial_gap", "measured_gap")


class LoadCases(ABC):
    """Load cases, numbered first … first + count − 1. Case k depends on k alone, not on other cases."""

    count: int
    #: Sentences on the input that its user reads before a verdict.
    notes: tuple[str, ...] = ()
    first: int = 0  # the number of the first case
    facts: ClassVar[dict[str, Any]] = {}  # of all cases, for a report

    @property
    @abstractmethod
    def key(self) -> str:
        """Hash of everything that determines the cases, except their count."""

    @property
    def content_key(self) -> str:
        """Hash of the cases themselves: that of a table, which may grow in a series, has its rows."""
        return self.key

    @abstractmethod
    def load(self, k: int) -> LoadCase:
        """f (n,) N and g (m,) mm of case k. Cases with the same forces return the same array f."""

    def only(self, numbers: Sequence[int]) -> "LoadCases":
        """The data of these cases alone, for a worker; the cases keep their numbers."""
        return self

    def scene_of(self, k: int, stage: JointScene | None = None) -> JointScene | None:
        """The scene with the fasteners of case k, where their forces are recorded. stage : what acts."""
        return None

    def staged(self, scene: JointScene) -> JointScene:
        """The scene whose stages the cases go through."""
        return scene

    def of_stage(self, stage: JointScene) -> "LoadCases | None":
        """The load cases of what acts in a stage; None if stages change f and g by the same in all cases."""
        return None

    def stiffness_of(self, k: int) -> tuple[float, ...]:
        """What tells the K of case k from those of others."""
        return ()

    def of_stiffness(self, k: int, scene: Scene) -> "tuple[Scene, LoadCases]":
        """The scene with the K of case k, and the load cases of those with this K."""
        return scene, self

    def parameters(self, k: int) -> dict[str, float | str]:
        """The values that distinguish case k from others, for its row."""
        return {}


@dataclass(frozen=True)
class Listed(LoadCases):
    """A list of load cases. Cases with the same forces should share the array f: K⁻¹f is then made once."""

    cases: tuple[LoadCase, ...]
    first: int = 0

    @property
    def count(self) -> int:  # type: ignore[override]
        return len(self.cases)

    @property
    def key(self) -> str:
        return digest(*(array.tobytes() for case in self.cases for array in (case.f, case.g)))

    def load(self, k: int) -> LoadCase:
        return self.cases[k - self.first]
