"""A stream of load cases such as a search for a plan of fasteners solves: each differs little from the last.

Case 2j has the gap of draw j. Case 2j + 1 has the same gap, and one fastener of the scene changes: it is
taken out, or put back if it was out.
"""

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
    """The load cases of a suite: random gaps by its law, or a stream of them and of fasteners.

    Raises InputError if more of the scene is random.
    """
    if isinstance(scene, JointScene) and scene.random:
        allowed = "leave it out: a suite draws gaps alone"
        raise InputError.one(f"scene {scene.name}", "random", list(scene.random), allowed)
    gaps = random_gaps(scene, **law, form=form)
    return Stream.of(scene, gaps, form) if fasteners and isinstance(scene, JointScene) else gaps


@dataclass(frozen=True)
class Stream(LoadCases):
    """Draws of the gap, and fasteners that come and go.

    gaps : the draws, with the forces of all fasteners. single : the scene's fasteners, one by one. made : the
    forces of the last case, by the number of changes that led to it. picks : the fastener of each change, as
    far as they are drawn.
    """

    scene: JointScene
    gaps: RandomGaps
    single: tuple[Fasteners, ...]
    form: Form
    made: dict[int, Vector] = field(default_factory=dict, compare=False)
    picks: list[int] = field(default_factory=list, compare=False)

    @classmethod
    def of(cls, scene: JointScene, gaps: RandomGaps, form: Form) -> "Stream":
        """Raises InputError if the scene has no fasteners."""
        single = tuple(
            effect.only([k], scene.joint)
            for effect in scene.effects_of(Fasteners)
            for k in range(effect.element_count(scene.joint))
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
        """The seed of the gap, and the numbers in the scene of the fasteners that are out."""
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
        """The fasteners that are out: an odd number of the first changes picked them."""
        for t in range(len(self.picks), changes):
            random = np.random.default_rng((self.gaps.seed, t, 1))
            self.picks.append(int(random.integers(len(self.single))))
        picked = np.bincount(np.array(self.picks[:changes], dtype=np.intp))
        return np.flatnonzero(picked % 2).tolist()
