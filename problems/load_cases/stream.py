"""Load cases as a search for a plan of fasteners asks them: each differs little from the one before.

Case 2j has the gap of draw j; case 2j + 1 the same gap, and a fastener of the scene less, or one that was
taken out back.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from problems.build import load_case
from problems.effects.fasteners import Fasteners
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase, Vector
from problems.model.scene import JointScene, Scene
from problems.storage import digest

from . import LoadCases
from .random_gaps import RandomGaps, random_gaps


def drawn_cases(scene: Scene, form: Form, fasteners: bool = False, **law: Any) -> LoadCases:
    """The load cases of a suite: random gaps by its law, or a stream of them and of fasteners."""
    gaps = random_gaps(scene, **law, form=form)
    return Stream.of(scene, gaps, form) if fasteners and isinstance(scene, JointScene) else gaps


@dataclass(frozen=True)
class Stream(LoadCases):
    """gaps : the draws, with the forces of all fasteners. single : the scene's fasteners, one by one. made :
    the forces without some of them, by the cases before.
    """

    scene: JointScene
    gaps: RandomGaps
    single: tuple[Fasteners, ...]
    form: Form
    made: dict[int, Vector] = field(default_factory=dict, compare=False)

    @classmethod
    def of(cls, scene: JointScene, gaps: RandomGaps, form: Form) -> Stream:
        """Raises InputError if the scene has no fasteners."""
        single = tuple(
            effect.model_copy(update={"points": (place,), "pattern": None})
            for effect in scene.effects_of(Fasteners)
            for place in map(tuple, effect.marks(scene.joint).tolist())
        )
        if not single:
            allowed = 'an [[effect]] kind = "fasteners" that comes and goes'
            raise InputError.one(f"scene {scene.name}", "effect", "no fasteners", allowed)
        return cls(scene, gaps, single, form)

    @property
    def count(self) -> int:  # type: ignore[override]
        return self.gaps.count

    @property
    def key(self) -> str:
        return digest(self.gaps.key, "fasteners")

    def parameters(self, k: int) -> dict[str, Any]:
        """The seed of the gap, and the fasteners that are out, by their numbers in the scene."""
        out = " ".join(map(str, self._out((k + 1) // 2)))
        return self.gaps.parameters(k // 2) | {"fasteners_out": out}

    def load(self, k: int) -> LoadCase:
        changes = (k + 1) // 2
        if changes not in self.made:
            self.made.clear()
            out = [load_case(self.scene, self.form, [self.single[i]]).f for i in self._out(changes)]
            self.made[changes] = self.gaps.rest.f - sum(out) if out else self.gaps.rest.f
        return LoadCase(self.made[changes], self.gaps.load(k // 2).g)

    def _out(self, changes: int) -> list[int]:
        """Those that an odd number of the first changes picked."""
        picked = np.zeros(len(self.single), dtype=int)
        for t in range(changes):
            picked[np.random.default_rng((self.gaps.seed, t, 1)).integers(len(picked))] += 1
        return np.flatnonzero(picked % 2).tolist()
