"""What each effect of a scene adds, measured one by one: stiffness, load, gap or contacts, and its time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.build import load_case
from problems.forms.assembly import Vector
from problems.model.effect import Effect, GapEffect, SpringEffect, StiffnessEffect, effect_kinds
from problems.model.joint import Joint
from problems.model.part import PartLoadEffect
from problems.model.scene import JointScene, Scene

BALANCE = 1e-9  # a sum smaller than this, relative to its terms, is rounding


@dataclass(frozen=True)
class Entry:
    """One effect and one thing that it adds; seconds: None if nothing was computed."""

    effect: str
    adds: str
    amount: str
    seconds: float | None


def ledger(scene: Scene, built: bool, junction: NDArray[np.intp] | None = None) -> list[Entry]:
    """An entry for each thing that an effect adds. built : the stiffness was computed now, not loaded.

    junction : of the sparse form, the unknowns that are the junction's deflections.
    """
    if not isinstance(scene, JointScene):
        return []
    return [entry for effect in scene.effects for entry in _entries(effect, scene, built, junction)]


def not_called_for(scene: JointScene) -> list[str]:
    """The kinds of effects that the scene does not name: their modules are not imported."""
    named = {effect.kind for effect in scene.effects}
    return [kind for kind in effect_kinds() if kind not in named]


def _entries(
    effect: Effect, scene: JointScene, built: bool, junction: NDArray[np.intp] | None
) -> Iterator[Entry]:
    name = " ".join(filter(None, [effect.kind, getattr(effect, "part", None)]))
    for first, second in effect.contacts:
        yield Entry(name, "constraints", f"{scene.joint.node_count} contacts of {first} and {second}", None)
    if isinstance(effect, StiffnessEffect) and not built:
        yield Entry(name, "stiffness", "in the assembly from the cache", None)
        return
    start = time.perf_counter()
    for adds, amount in _added(effect, scene, junction):
        yield Entry(name, adds, amount, time.perf_counter() - start)
        start = time.perf_counter()


def _added(effect: Effect, scene: JointScene, junction: NDArray[np.intp] | None) -> Iterator[tuple[str, str]]:
    """What an effect adds, and how much, computed when it is asked for."""
    joint = scene.joint
    if isinstance(effect, StiffnessEffect):
        (part,) = (part for part in joint.part if part.name == effect.part)
        yield "stiffness", f"{effect.stiffness(joint.plate(part)).nnz} entries of the plate's K"
        return
    if isinstance(effect, SpringEffect):
        T, k = effect.springs(joint)
        yield "stiffness", f"{T.shape[1]} × {k[0]:g} N/mm between parts"
    load = load_case(scene, "dual" if junction is None else "sparse", [effect])
    if isinstance(effect, GapEffect):
        yield "gap", _gap(load.g)
    elif junction is not None and isinstance(effect, PartLoadEffect):
        yield "load", f"on {np.count_nonzero(load.f)} unknowns of {effect.part}"
    else:
        yield "load", _forces(load.f if junction is None else load.f[junction], joint)


def _gap(g: Vector) -> str:
    touched = g[g != 0]
    if not touched.size:
        return "0 mm"
    return f"{touched.min():.4g} … {touched.max():.4g} mm at {touched.size} contacts"


def _forces(f: Vector, joint: Joint) -> str:
    forces = {part.name: f[joint.unknowns(part.name)] for part in joint.part}
    text = ", ".join(f"{name} {_sum(own)}" for name, own in forces.items() if own.any())
    return f"{text} on {np.count_nonzero(f)} nodes" if text else "0 N"


def _sum(f: Vector) -> str:
    """The sum of forces; their largest if they are in balance."""
    if abs(f.sum()) < BALANCE * abs(f).sum():
        return f"±{abs(f).max():.4g} N in balance"
    return f"{f.sum():+.4g} N"
