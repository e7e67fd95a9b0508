"""Load cases that step through values of a scene's keys: initial_gap.mean=0.1:1.0:10."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from pydantic import ValidationError

from problems.build import load_case
from problems.errors import Fault, InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase
from problems.input.bounded_types import validation_faults
from problems.model.effect import SpringEffect, StiffnessEffect
from problems.model.scene import JointScene, Scene
from problems.storage import digest

from . import LoadCases

SYNTAX = "KIND.KEY=FIRST:LAST:COUNT or KIND.KEY=V1,V2,…, as in initial_gap.mean=0.1:1.0:10"
MOST, MOST_CASES = 100_000, 10_000_000  # values of a key; combinations
NOTHING, OTHER = "the scene has no force or gap to sweep", "what changes K would be another assembly"


@dataclass(frozen=True)
class Step:
    """One --sweep: the key as written, the index of the effect and the keys in it, and the values."""

    name: str
    effect: int
    keys: tuple[str, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Sweep(LoadCases):
    """All combinations of the steps' values, the last step varying fastest."""

    scene: JointScene
    steps: tuple[Step, ...]
    count: int
    form: Form = "dual"
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        return digest([[step.name, step.values] for step in self.steps])

    def parameters(self, k: int) -> dict[str, Any]:
        places = np.unravel_index(k, [len(step.values) for step in self.steps])
        return {step.name: step.values[i] for step, i in zip(self.steps, places, strict=True)}

    def load(self, k: int) -> LoadCase:
        effects = list(self.scene.effects)
        for step, value in zip(self.steps, self.parameters(k).values(), strict=True):
            effects[step.effect] = _changed(effects[step.effect], step, value)
        return load_case(replace(self.scene, effects=tuple(effects)), self.form)


def sweep(scene: Scene, texts: Sequence[str], form: Form = "dual") -> Sweep:
    """The load cases of --sweep options. Raises InputError with all faults."""
    if not isinstance(scene, JointScene):
        raise InputError.one("--sweep", "key", ", ".join(texts), f"{NOTHING}; {OTHER}")
    faults: list[Fault] = []
    steps = tuple(step for text in texts if (step := _step(scene, text, faults)))
    for step in steps:
        for value in step.values:
            try:
                effect = _changed(scene.effects[step.effect], step, value)
            except ValidationError as error:
                effect, name = scene.effects[step.effect], effect_name(scene, step.effect)
                faults += validation_faults(f"--sweep {step.name}", type(effect), error, name)
                continue
            faults += [Fault(f"--sweep {step.name}", *fault) for fault in effect.faults(scene.joint)]
    names = [step.name for step in steps]
    twice = {name for name in names if names.count(name) > 1}
    faults += [Fault("--sweep", name, names, "is swept twice") for name in twice]
    if faults:
        raise InputError(faults)
    count = prod(len(step.values) for step in steps)
    if count > MOST_CASES:
        raise InputError.one("--sweep", "cases", count, f"at most {MOST_CASES} combinations")
    whole = [text.partition("=") for text in texts if re.fullmatch(r"[^=]+=-?\d+,\d+", text)]
    notes = tuple(f"--sweep {name} has two values, {two}: decimals have a point" for name, _, two in whole)
    return Sweep(scene, steps, count, form, notes)


def effect_name(scene: JointScene, index: int) -> str:
    """The name of an effect in --sweep: initial_gap, or pressure.0 and pressure.1 if there are several."""
    kind = scene.effects[index].kind
    alike = [i for i, effect in enumerate(scene.effects) if effect.kind == kind]
    return kind if len(alike) == 1 else f"{kind}.{alike.index(index)}"


def _step(scene: JointScene, text: str, faults: list[Fault]) -> Step | None:
    name, equals, values = text.partition("=")
    numbers = _values(values)
    if not equals or not 0 < len(numbers) <= MOST:
        allowed = f"at most {MOST} values" if len(numbers) > MOST else SYNTAX
        faults.append(Fault("--sweep", "sweep", text, allowed))
        return None
    keys = {
        f"{effect_name(scene, i)}.{'.'.join(path)}": Step(name, i, path, numbers)
        for i, effect in enumerate(scene.effects)
        if not isinstance(effect, StiffnessEffect | SpringEffect)  # on which K depends
        for path in _numbers(effect.model_dump())
    }
    if name not in keys:
        allowed = f"one of {', '.join(keys)}" if keys else NOTHING
        faults.append(Fault("--sweep", "key", name, f"{allowed}; {OTHER}"))
    return keys.get(name)


def _numbers(table: dict[str, Any]) -> list[tuple[str, ...]]:
    """The paths of the numbers in an effect's table."""
    paths: list[tuple[str, ...]] = []
    for key, value in table.items():
        if isinstance(value, dict):
            paths += [(key, *path) for path in _numbers(value)]
        elif isinstance(value, int | float):
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


def _changed(effect: Any, step: Step, value: float) -> Any:
    """The effect with one number changed, validated as on reading."""
    table = inner = effect.model_dump()
    for key in step.keys[:-1]:
        inner = inner[key]
    inner[step.keys[-1]] = value
    return type(effect).model_validate(table)
