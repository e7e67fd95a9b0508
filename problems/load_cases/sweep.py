"""Load cases that step through values of a scene's keys: initial_gap.mean=0.1:1.0:10."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError

from problems.build import load_case
from problems.errors import Fault, InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase
from problems.input.bounded_types import validation_faults
from problems.model.effect import Effect, SpringEffect, StiffnessEffect
from problems.model.interface import AnyJoint
from problems.model.joint import Faults
from problems.model.positions import Positions
from problems.model.scene import JointScene, Scene
from problems.model.stages import StagePlan
from problems.storage import digest

from . import LoadCases

SYNTAX = "KIND.KEY=FIRST:LAST:COUNT or KIND.KEY=V1,V2,…, as in initial_gap.mean=0.1:1.0:10"
MOST, MOST_CASES = 100_000, 10_000_000  # values of a key; combinations
MAX_FAULTS = 10  # of points, named at once
NOTHING = "the scene has no number that changes a force or a gap"
OTHER = "what changes K would be another assembly"


@dataclass(frozen=True)
class Key:
    """A number of an effect: its name, the index of its effect, and the keys that lead to it.

    `points.x` and `points.y` are a shift of all points of an effect, mm; any other key is replaced.
    """

    name: str
    effect: int
    path: tuple[str, ...]

    @property
    def moves(self) -> bool:
        """Whether it decides where points are, or how many there are."""
        return self.path[0] in ("points", "pattern")

    def changed(self, effect: Any, value: float, joint: AnyJoint) -> Any:
        """The effect with this number changed, validated as on reading; stages set the same points.

        Raises InputError if the effect cannot have it.
        """
        table = inner = effect.model_dump()
        if self.path[0] == "points":
            shift = [value * (self.path[1] == axis) for axis in "xy"]
            table |= {"points": (effect.marks(joint) + shift).tolist(), "pattern": None}
        else:
            for key in self.path[:-1]:
                inner = inner[key]
            inner[self.path[-1]] = value
        keys = ("points", "pattern") if self.path[0] == "points" else self.path[:1]
        try:
            valid = type(effect).model_validate(table)
            return effect.model_copy(update={key: getattr(valid, key) for key in keys})
        except ValidationError as error:
            prefix = self.name.removesuffix(f".{'.'.join(self.path)}")
            raise InputError(list(validation_faults(self.name, type(effect), error, prefix))) from error

    def faults(self, scene: JointScene, value: float, where: str) -> list[Fault]:
        """The faults of this value."""
        return faults_of(scene, [(self, value)], f"{where} at {value:g}" if self.moves else where)


Change = TypeVar("Change", bound=tuple[Key, Any])


@dataclass(frozen=True)
class Sweep(LoadCases):
    """All combinations of the values of each key, those of the last one varying fastest."""

    scene: JointScene
    steps: dict[Key, tuple[float, ...]]
    count: int
    form: Form = "dual"
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        return digest([[key.name, values] for key, values in self.steps.items()])

    def parameters(self, k: int) -> dict[str, Any]:
        places = np.unravel_index(k, [len(values) for values in self.steps.values()])
        return {key.name: values[i] for (key, values), i in zip(self.steps.items(), places, strict=True)}

    def load(self, k: int) -> LoadCase:
        changes = zip(self.steps, self.parameters(k).values(), strict=True)
        return load_case(self.scene, self.form, changed_effects(self.scene, changes))


def in_order(changes: Iterable[Change]) -> list[Change]:
    """The changes, a key and its value each, with shifts of points, which end a pattern, after all others."""
    return sorted(changes, key=lambda change: change[0].path[0] == "points")


def changed_effects(scene: JointScene, changes: Iterable[tuple[Key, Any]]) -> list[Effect]:
    """The effects of a scene with these values of keys. Raises InputError."""
    effects = list(scene.effects)
    for key, value in in_order(changes):
        effects[key.effect] = key.changed(effects[key.effect], value, scene.joint)
    return effects


def faults_of(scene: JointScene, changes: Sequence[tuple[Key, Any]], where: str) -> list[Fault]:
    """The faults of these values of keys together; those of points also beside the other effects."""
    try:
        effects = changed_effects(scene, changes)
    except InputError as error:
        return [replace(fault, where=where) for fault in error.faults]
    numbers = dict.fromkeys(key.effect for key, _ in changes)
    wrong = [
        (f"{effect_name(scene, number)}.{key}", value, allowed)
        for number in numbers
        for key, value, allowed in effects[number].faults(scene.joint)
    ]
    if not wrong and any(key.moves for key, _ in changes):
        plan = StagePlan(effects, scene.stages, scene.joint)
        wrong = list(plan.faults() if scene.stages else misplaced(effects, scene.joint))
    return [Fault(where, *fault) for fault in wrong]


def misplaced(effects: Sequence[Effect], joint: AnyJoint, staged: bool = False) -> Faults:
    """Yield the faults of effects at points, beside the others that act with them.

    staged : in a stage a fastener may be set where a force presses.
    """
    for effect in effects:
        if isinstance(effect, Positions):
            springs = staged and isinstance(effect, SpringEffect)
            others = [one for one in effects if one is not effect]
            others = [one for one in others if isinstance(one, SpringEffect) or not springs]
            for key, value, allowed in effect.faults(joint, others):
                yield f"{effect.kind}.{key}", value, allowed


def sweep(scene: Scene, texts: Sequence[str], form: Form = "dual") -> Sweep:
    """The load cases of --sweep options. Raises InputError with all faults."""
    if not isinstance(scene, JointScene):
        raise InputError.one("--sweep", "key", ", ".join(texts), allowed_keys({}))
    faults: list[Fault] = []
    found = [step for text in texts if (step := _step(scene, text, faults))]
    names, steps = [key.name for key, _ in found], dict(found)
    for key, values in found:
        for value in () if key.moves else values:
            faults += key.faults(scene, value, f"--sweep {key.name}")
    twice = {name for name in names if names.count(name) > 1}
    faults += [Fault("--sweep", name, names, "is swept twice") for name in twice]
    if faults:
        raise InputError(faults)
    count = prod(map(len, steps.values()))
    if count > MOST_CASES:
        raise InputError.one("--sweep", "cases", count, f"at most {MOST_CASES} combinations")
    moving = [key for key in steps if key.moves]
    for values in product(*(steps[key] for key in moving)):
        at = ", ".join(f"{key.name} at {value:g}" for key, value in zip(moving, values, strict=True))
        faults += faults_of(scene, list(zip(moving, values, strict=True)), f"--sweep {at}")
        if len(faults) >= MAX_FAULTS:
            break
    if faults:
        raise InputError(faults)
    whole = filter(None, (re.fullmatch(r"\s*([^=]+?)\s*=\s*(-?\d+,\d+)\s*", text) for text in texts))
    notes = tuple(f"--sweep {one[1]} has two values, {one[2]}: decimals have a point" for one in whole)
    return Sweep(scene, steps, count, form, notes)


def effect_name(scene: JointScene, index: int) -> str:
    """The name of an effect in --sweep: initial_gap, or pressure.0 and pressure.1 if there are several."""
    kind = scene.effects[index].kind
    alike = [i for i, effect in enumerate(scene.effects) if effect.kind == kind]
    return kind if len(alike) == 1 else f"{kind}.{alike.index(index)}"


def _step(scene: JointScene, text: str, faults: list[Fault]) -> tuple[Key, tuple[float, ...]] | None:
    name, equals, values = (part.strip() for part in text.partition("="))
    numbers = _values(values)
    if not equals or not 0 < len(numbers) <= MOST:
        allowed = f"at most {MOST} values" if len(numbers) > MOST else SYNTAX
        faults.append(Fault("--sweep", "sweep", text, allowed))
        return None
    keys = keys_of(scene)
    if name not in keys:
        faults.append(Fault("--sweep", "key", name, allowed_keys(keys)))
        return None
    return keys[name], numbers


def keys_of(scene: JointScene, stiffness: bool = False) -> dict[str, Key]:
    """The numbers of a scene that change f or g, and not K unless `stiffness` is true, by their names."""
    keys: dict[str, Key] = {}
    for i, effect in enumerate(scene.effects):
        changes_K = isinstance(effect, StiffnessEffect) and not stiffness
        paths = [] if changes_K else _numbers(dict(effect) | effect.model_dump())  # unset ones, too
        if isinstance(effect, SpringEffect) and not stiffness:  # the others change K
            paths = [path for path in paths if path[0] in SpringEffect.model_fields]
        elif isinstance(effect, Positions):
            paths += [("points", "x"), ("points", "y")]
        names = [".".join((effect_name(scene, i), *path)) for path in paths]
        keys |= {name: Key(name, i, path) for name, path in zip(names, paths, strict=True)}
    return keys


def allowed_keys(keys: dict[str, Key], stiffness: bool = False) -> str:
    """The names of these keys, for messages. stiffness : whether keys may change K."""
    named = f"one of {', '.join(keys)}" if keys else NOTHING
    return named if stiffness else f"{named}; {OTHER}"


def _numbers(table: dict[str, Any]) -> list[tuple[str, ...]]:
    """The paths of the numbers in an effect's table."""
    paths: list[tuple[str, ...]] = []
    for key, value in table.items():
        if isinstance(value, dict):
            paths += [(key, *path) for path in _numbers(value)]
        elif isinstance(value, int | float) and not isinstance(value, bool):
            paths.append((key,))
    return paths


def _values(text: str) -> tuple[float, ...]:
    """The values of a text such as 0.1:1.0:10 or 0.1,0.5,1; none if it is neither."""
    try:
        if ":" in text:
            first, last, count = text.split(":")
            values = np.linspace(float(first), float(last), min(int(count), MOST + 1)).tolist()
        else:
            values = [float(value) for value in text.split(",")]
    except ValueError:
        return ()
    return tuple(values) if np.isfinite(values).all() else ()
