"""Load cases in which keys of a scene are random: fasteners.preload=normal(1000, 100), beside the gap.

An input is one number, or `each` one for each element of an effect, or the random field of the gap. Its draw
n depends on the seed, n and its name alone. `N of` a distribution are its N quantiles (i + ½)/N, all equally
likely; a key of K has these, and each its K. Case k has draw k of all inputs. For contributors of d inputs
(Saltelli, Comput. Phys. Commun. 145:280–297, 2002), case k = j(d + 2) + r of base point j has draws 2j if
r = 0, draws 2j + 1 if r = 1, and if r = 2 + i draws 2j of all but input i, of which it has draw 2j + 1.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from problems.build import load_case
from problems.effects.initial_gap import InitialGap
from problems.errors import Fault, InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase, Vector
from problems.model.effect import SpringEffect
from problems.model.positions import Positions
from problems.model.scene import JointScene, Scene
from problems.model.stage_answers import last_scene
from problems.model.stages import Acting, StagePlan, of_effect
from problems.storage import digest

from . import LoadCases
from .distributions import distribution, values_at
from .random_gaps import RandomGaps
from .sweep import MOST_CASES, Key, allowed_keys, changed_effects, faults_of, in_order, keys_of, misplaced

LAW = re.compile(r"(?:(each) |([1-9]\d{0,6}) of )?(.*)", re.DOTALL)
LOCKED = "leave it out: the stage that sets it locks the approach that it has reached"
FEW = "N of DISTRIBUTION: it changes K, and a K is kept for each of N values"
DIVIDED = "leave it out: its points act or change one by one, not as a pattern"
#: Where a distribution is tried; a draw that fails between these ends the series with a message.
TRIED = np.array([0.0, 1.0, *np.arange(1, 8) / 8])


@dataclass(frozen=True)
class Input(Key):
    """A random key.

    text, law : its distribution, as given and of scipy. elements : how many the effect has, with `each`; else
    0. levels : N of `N of`, else 0. changes_K : whether each value has a K of its own.
    """

    text: str
    law: Any
    elements: int
    levels: int
    changes_K: bool

    def at(self, shares: Vector) -> Vector:
        """The values (k,) at these shares of the distribution, 0 to 1."""
        few = (np.minimum(np.floor(self.levels * shares), self.levels - 1) + 0.5) / max(self.levels, 1)
        return values_at(self.law, few if self.levels else shares)

    def is_column(self, effect: Any) -> bool:
        """Whether the effect takes a number for each of its elements."""
        return self.path[0] in effect.more_columns

    def number(self, v: Vector, elements: Sequence[int], effect: Any) -> Any:
        """The number drawn for what acts of an effect, one for each of its elements if it takes these."""
        own = np.resize(v, max(self.elements, 1))[elements if self.elements else [0]]
        return tuple(own.tolist()) if self.elements and self.is_column(effect) else own[0]

    def draw(self, seed: int, n: int) -> Vector:
        random = np.random.default_rng((seed, n, int(digest(self.name)[:16], 16)))
        return self.at(random.random(max(self.elements, 1)))


@dataclass(frozen=True)
class RandomInputs(LoadCases):
    """The load cases of random inputs. gaps : of the field, if it is an input. contributors : see above.
    stage : what acts; by default in the last stage, or in a scene without stages.
    """

    scene: JointScene
    inputs: tuple[Input, ...]
    gaps: RandomGaps | None
    seed: int
    count: int
    form: Form
    contributors: bool
    notes: tuple[str, ...] = ()
    stage: JointScene | None = None

    @property
    def key(self) -> str:
        laws = [[one.name, one.text] for one in self.inputs]
        return digest("random", laws, self.seed, self.contributors, self.gaps.key if self.gaps else "")

    @property
    def facts(self) -> dict[str, Any]:  # type: ignore[override]
        names = [one.name for one in self.inputs] + ["initial_gap.random"] * bool(self.gaps)
        return {"random_inputs": names, "cases_per_point": len(names) + 2 if self.contributors else 1}

    def draws(self, k: int) -> list[int]:
        """The draw of each input in case k, the field last."""
        names, per_point = self.facts.values()
        j, r = divmod(k, per_point)
        return [2 * j + (r in (1, 2 + i)) if self.contributors else k for i in range(len(names))]

    def values(self, k: int) -> list[Vector]:
        """The numbers of each of `inputs` in case k."""
        return [one.draw(self.seed, n) for one, n in zip(self.inputs, self.draws(k), strict=False)]

    def parameters(self, k: int) -> dict[str, Any]:
        drawn = zip(self.inputs, self.values(k), strict=True)
        row = {one.name: v.tolist() if one.elements else float(v[0]) for one, v in drawn}
        return row | (self.gaps.parameters(self.draws(k)[-1]) if self.gaps else {})

    def stiffness_of(self, k: int) -> tuple[float, ...]:
        drawn = zip(self.inputs, self.draws(k), strict=False)
        return tuple(float(one.draw(self.seed, n)[0]) for one, n in drawn if one.changes_K)

    def of_stiffness(self, k: int, scene: Scene) -> tuple[Scene, LoadCases]:
        cases = self.with_stiffness(self.values(k))
        return cases.scene, cases

    def with_stiffness(self, values: Iterable[Vector]) -> "RandomInputs":
        """The cases on the scene with the K of these numbers of each of `inputs`, whose loads may differ.

        Raises InputError if points are off the parts, or where others act.
        """
        drawn = zip(self.inputs, values, strict=True)
        changes = [(one, float(v[0])) for one, v in drawn if one.changes_K]
        moving = any(one.moves for one, _ in changes)
        if wrong := faults_of(self.scene, changes, _said(changes)) if moving else []:
            raise InputError(wrong)
        effects = changed_effects(self.scene, changes)
        return replace(self, scene=replace(self.scene, effects=tuple(effects)))

    def staged(self, scene: JointScene) -> JointScene:
        """The scene with 0 for each random approach, which the loads have, and 1 N for a random preload."""
        effects = list(scene.effects)
        for one in self.inputs:
            if isinstance(effects[one.effect], SpringEffect) and not one.changes_K:
                preload = float(one.path == ("preload",))
                effects[one.effect] = one.changed(effects[one.effect], preload, scene.joint)
        return replace(scene, effects=tuple(effects))

    def of_stage(self, stage: JointScene) -> "RandomInputs":
        return replace(self, stage=stage)

    @cached_property
    def part(self) -> JointScene:
        """The scene that acts, without stages."""
        return self.stage or last_scene(self.scene)

    @cached_property
    def acting(self) -> dict[int, tuple[Any, Sequence[int]]]:
        """The effects that act, by their numbers in the scene, and the numbers of their elements there."""
        pairs = zip(self.part.numbers, self.part.effects, strict=True)
        return {number: (effect, elements) for (number, elements), effect in pairs}

    @cached_property
    def pieces(self) -> dict[int, list[tuple[list[int], Any]]]:
        """The acting elements of each effect that changes, with their effect, by its number in `scene`.

        They are one by one where `each` is for a key that is no column.
        """
        pieces = {}
        for i, (effect, elements) in self.acting.items():
            keys = [one for one in self.inputs if one.effect == i and not one.changes_K]
            field = self.gaps.field if self.gaps and isinstance(effect, InitialGap) else effect
            if any(one.elements and not one.is_column(field) for one in keys):
                own = enumerate(elements)
                pieces[i] = [([k], field.only([place], self.part.joint)) for place, k in own]
            elif keys:
                pieces[i] = [([*elements], field)]
        return pieces

    @cached_property
    def fixed(self) -> list[Any]:
        """The other acting effects."""
        return [effect for i, (effect, _) in self.acting.items() if i not in self.pieces]

    @cached_property
    def rest(self) -> LoadCase:
        """f and g of the other effects."""
        fixed = [effect for effect in self.fixed if not (self.gaps and isinstance(effect, InitialGap))]
        return load_case(self.part, self.form, fixed)

    def changed(self, values: Iterable[Vector]) -> list[Any]:
        """The effects that change f or g, with these numbers of each of `inputs`.

        Raises InputError if points are off the parts, or where others act.
        """
        pieces, joint, drawn = dict(self.pieces), self.part.joint, list(zip(self.inputs, values, strict=True))
        for one, v in in_order(drawn):
            if one.effect in pieces and not one.changes_K:
                own = pieces[one.effect]
                pieces[one.effect] = [(k, one.changed(e, one.number(v, k, e), joint)) for k, e in own]
        if moving := [(one, v) for one, v in drawn if one.moves and one.effect in self.acting]:
            effects = [*self.fixed, *(self._whole(i, pieces[i]) for i in pieces)]
            if wrong := list(misplaced(effects, joint, bool(self.scene.stages))):
                raise InputError([Fault(_said(moving), *fault) for fault in wrong])
        return [effect for some in pieces.values() for _, effect in some]

    def _whole(self, number: int, pieces: list[tuple[list[int], Any]]) -> Any:
        """The effect of some pieces: one at all of their points."""
        whole = pieces[0][1] if len(pieces) == 1 else self.acting[number][0]
        if len(pieces) > 1 and isinstance(whole, Positions):
            marks = np.concatenate([piece.marks(self.part.joint) for _, piece in pieces])
            whole = whole.model_copy(update={"points": tuple(map(tuple, marks.tolist())), "pattern": None})
        return whole

    def scene_of(self, k: int, stage: JointScene | None = None) -> JointScene:
        cases = self.of_stage(stage) if stage else self
        effects = (*cases.fixed, *cases.changed(self.values(k)))
        return replace(cases.part, effects=effects, origin=())

    def load(self, k: int) -> LoadCase:
        return self.load_at(self.values(k), self.draws(k)[-1])

    def load_at(self, values: Iterable[Vector], field: int | None = None) -> LoadCase:
        """The load of these numbers of each of `inputs`. field : the draw of the random gap, or its mean."""
        effects = self.changed(values)
        laws = [effect for effect in effects if self.gaps and isinstance(effect, InitialGap)]
        change = load_case(self.part, self.form, [effect for effect in effects if effect not in laws])
        g = self.rest.g + change.g
        if self.gaps:
            g += self.gaps.gap(field, *(laws or [self.gaps.field]))
        return LoadCase(self.rest.f + change.f if change.f.any() else self.rest.f, g)


def inputs_of(
    scene: JointScene, laws: Sequence[str], stiffness: bool = False, scanned: bool = False
) -> tuple[list[Input], list[Fault]]:
    """The inputs of laws, and what is wrong with these. scanned : whether random gaps pass through a scan."""
    keys, loads, faults, inputs = keys_of(scene, stiffness), keys_of(scene), list[Fault](), list[Input]()
    steps = StagePlan(scene.effects, scene.stages, scene.joint).steps
    fresh, sources = {number for step in steps for number, _ in step.fresh}, list[str]()
    if scanned:  # a scan has one correlation length
        keys = {name: key for name, key in keys.items() if key.path[-1] != "correlation_length"}
    for law in laws:
        name, text = (part.strip() for part in law.partition("=")[::2])
        source = f"scene {scene.name}: [random]" if law in scene.random else "--random"
        per_element, levels, bare = cast(re.Match[str], LAW.fullmatch(text)).groups()
        key, where = keys.get(name), f"{source} {name}"
        if key is None or name in [one.name for one in inputs]:
            allowed = "one distribution of each key" if key else allowed_keys(keys, stiffness)
            faults.append(Fault(source, "key", name, allowed))
        try:
            frozen = distribution(bare)
        except ValueError as error:
            faults.append(Fault(where, "distribution", text, str(error)))
            continue
        if key:
            elements = scene.effects[key.effect].element_count(scene.joint) if per_element else 0
            how = text, frozen, elements, int(levels or 0), name not in loads
            inputs.append(one := Input(key.name, key.effect, key.path, *how))
            if per_element and not elements:
                faults.append(Fault(where, "each", text, "leave it out: it has no elements at points"))
            if key.path == ("approach",) and key.effect in fresh:
                faults.append(Fault(where, "key", name, LOCKED))
            if one.changes_K and not one.levels:
                faults.append(Fault(where, "distribution", text, FEW))
            tried = (key.faults(scene, value, f"{where}={text}") for value in one.at(TRIED).tolist())
            faults += next(filter(None, tried), [])
            sources.append(where)
    for one, where in zip(inputs, sources, strict=True):
        if one.path[0] == "pattern" and not one.changes_K and _divided(one, inputs, scene, steps):
            faults.append(Fault(where, "key", one.name, DIVIDED))
    return inputs, faults


def _said(drawn: Sequence[tuple[Input, Any]]) -> str:
    """The values drawn, or the distribution of those that each element has, for messages."""
    at = (f"={one.text}" if one.elements else f" at {np.ravel(v)[0]:g}" for one, v in drawn)
    return "random " + ", ".join(f"{one.name}{value}" for (one, _), value in zip(drawn, at, strict=True))


def _divided(one: Input, inputs: Sequence[Input], scene: JointScene, steps: Sequence[Acting]) -> bool:
    """Whether some of the elements of an input's effect act alone: in a stage, or as they are drawn."""
    effect = scene.effects[one.effect]
    counts = {len(of_effect(one.effect, step.elements)) for step in steps}
    drawn = (other.elements and not other.is_column(effect) for other in inputs if other.effect == one.effect)
    return bool(counts - {0, effect.element_count(scene.joint)}) or any(drawn)


def random_inputs(
    scene: Scene,
    laws: Sequence[str],
    form: Form,
    gaps: RandomGaps | None,
    count: int,
    seed: int,
    N: int | None,
    stiffness: bool = False,
) -> RandomInputs:
    """Load cases of laws KEY=[each | COUNT of] DISTRIBUTION. Raises InputError with all faults.

    gaps : random gaps, one more input. N : base points; the cases are then the N (d + 2) for contributors.
    stiffness : whether keys may change K.
    """
    if not isinstance(scene, JointScene):
        raise InputError.one("--random", "key", ", ".join(laws), allowed_keys({}, stiffness))
    scanned = gaps is not None and gaps.points is not None
    inputs, faults = inputs_of(scene, laws, stiffness, scanned)
    d = len(inputs) + bool(gaps)
    if N is not None and (d < 2 or N < 2 or N & (N - 1) or N * (d + 2) > MOST_CASES):
        allowed = f"a power of 2, two inputs or more, N (inputs + 2) at most {MOST_CASES}"
        faults.append(Fault("--contributors", "N, inputs", (N, d), allowed))
    if faults:
        raise InputError(faults)
    medians = [f"{one.name}: {one.text}, median {one.law.median():.4g}" for one in inputs]
    count, notes = (N * (d + 2) if N else count), (*medians, *(gaps.notes if gaps else ()))
    return RandomInputs(scene, tuple(inputs), gaps, seed, count, form, bool(N), notes)
