"""One question for two codes: a scene at its own mesh or a finer one, under the forces at its own nodes.

Refined are the plates, the contacts and the initial gap; the forces stay what the scene has at its nodes, so
that both codes go to the same limit.
"""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scikit_fem_plates
from numpy.typing import NDArray

from harness.solving.session import answer_of
from problems.build import load_case, prepared
from problems.forms.assembly import LoadCase
from problems.model.effect import GapEffect
from problems.model.joint import Joint, Part
from problems.model.scene import JointScene
from problems.scene import read_scene, scene_of
from solvers.registry import make_solver

Array = NDArray[np.float64]

DOCS = Path(__file__).parents[1] / "docs"


@dataclass(frozen=True)
class Found:
    """gaps (pairs, ny, nx) at the scene's nodes, mm; reactions (parts,) of the clamped edges, N.

    Where fasteners close the gap at their nodes, it does not tell how stiff equal plates are; reactions do.
    """

    gaps: Array
    reactions: Array

    def apart(self, other: "Found") -> tuple[float, float]:
        """The largest difference of gaps and of reactions, over the largest here."""
        pairs = ((self.gaps, other.gaps), (self.reactions, other.reactions))
        of_gaps, of_reactions = (float(abs(a - b).max() / abs(a).max()) for a, b in pairs)
        return of_gaps, of_reactions


@dataclass(frozen=True)
class Question:
    """A scene whose plates are held and pressed, and whose parts begin with a gap."""

    scene: JointScene

    @property
    def joint(self) -> Joint:
        return self.scene.joint

    @property
    def spacing(self) -> float:
        """Of the nodes along x, mm."""
        return float(self.joint.x[1])

    @property
    def forces(self) -> Array:
        """(parts, nodes), N."""
        return load_case(self.scene).f.reshape(len(self.joint.part), -1)

    def refined(self, times: int) -> JointScene:
        """With `times` as many elements in each direction; its forces are not to be used."""
        across, up = self.joint.junction.nodes
        nodes = ((across - 1) * times + 1, (up - 1) * times + 1)
        junction = self.joint.junction.model_copy(update={"nodes": nodes})
        parts = tuple(_refined(part, times) for part in self.joint.part)
        joint = self.joint.model_copy(update={"junction": junction, "part": parts})
        return JointScene(self.scene.name, self.scene.title, joint, self.scene.effects)

    def found(self, gaps: Array, lam: Array, times: int) -> Found:
        """From gaps and contact forces of the refined scene."""
        across, up = self.joint.junction.nodes
        grid = (len(self.joint.pairs), (up - 1) * times + 1, (across - 1) * times + 1)
        reactions = self.forces.sum(axis=1)
        names = [part.name for part in self.joint.part]
        for (a, b), force in zip(self.joint.pairs, lam.reshape(grid).sum(axis=(1, 2)), strict=True):
            reactions[names.index(a)] -= force
            reactions[names.index(b)] += force
        return Found(gaps.reshape(grid)[:, ::times, ::times], reactions)

    def ours(self, times: int = 1) -> Found:
        scene = self.refined(times)
        data = prepared(scene, form="sparse")
        f = np.zeros((len(self.joint.part), *reversed(scene.joint.junction.nodes)))
        f[:, ::times, ::times] = self.forces.reshape(-1, *reversed(self.joint.junction.nodes))
        whole = np.zeros(data.assembly.n)
        whole[data.assembly.junction] = f.ravel()
        load = LoadCase(whole, initial_gap(scene))
        answer = answer_of("newton", make_solver("newton", {}), data, "sparse", load, 1e-9)
        assert answer.status == "solved"
        gaps = load.g - data.assembly.A.T @ np.asarray(answer.x)
        return self.found(gaps, np.asarray(answer.lam), times)

    def theirs(self, element: float, times: int = 1) -> Found:
        """With contacts at the nodes of the refined scene, on a mesh that need not contain them."""
        scene = self.refined(times)
        contacts = (scene.joint.nodes, initial_gap(scene))
        loads = (self.joint.nodes, self.forces)
        return self.found(*scikit_fem_plates.contact(self.joint, loads, contacts, element), times)


def question(name: str) -> Question:
    """Of a scene by its name, or the first one of a document, docs/NAME.md."""
    if name.endswith(".md"):
        table = re.search(r"```toml\n(.*?)```", (DOCS / Path(name).name).read_text("utf-8"), re.DOTALL)
        scene = scene_of(tomllib.loads(table[1]))
    else:
        scene = read_scene(name)
    return Question(scene)


def initial_gap(scene: JointScene) -> Array:
    return np.sum([effect.gap(scene.joint) for effect in scene.effects_of(GapEffect)], axis=0)


def _refined(part: Part, times: int) -> Part:
    sides = {name: getattr(part, name) for name in ("south", "north") if getattr(part, name)}
    finer = {
        name: side.model_copy(update={"elements": side.elements * times}) for name, side in sides.items()
    }
    return part.model_copy(update=finer)
