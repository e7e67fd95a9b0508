"""Load cases in which keys of a scene are random: fasteners.preload=normal(1000, 100), beside the gap.

An input is one number, or `each` one for each element of an effect, or the random field of the gap. Its draw
n depends on the seed, n and its name alone. Case k has draw k of all inputs. For contributors of d inputs
(Saltelli, Comput. Phys. Commun. 145:280–297, 2002), case k = j(d + 2) + r of base point j has draws 2j if
r = 0, draws 2j + 1 if r = 1, and if r = 2 + i draws 2j of all but input i, of which it has draw 2j + 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.build import load_case
from problems.effects.initial_gap import InitialGap
from problems.errors import Fault, InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase, Vector
from problems.model.scene import JointScene, Scene
from problems.storage import digest

from . import LoadCases
from .distributions import distribution, values_at
from .random_gaps import RandomGaps
from .sweep import Key, allowed_keys, keys_of

FIELD = "initial_gap.random"  # the field among the names of inputs


@dataclass(frozen=True)
class Input(Key):
    """A key, its distribution as text and of scipy, and the number of its elements; 0 without `each`."""

    text: str
    law: Any
    elements: int


@dataclass(frozen=True)
class RandomInputs(LoadCases):
    """The load cases of random inputs.

    pieces : the effects that change, by their numbers in the scene; the elements of one that has `each`.
    rest : f and g of the others. gaps : of the field, if it is an input. contributors : see above.
    """

    scene: JointScene
    inputs: tuple[Input, ...]
    pieces: dict[int, list[Any]]
    rest: LoadCase
    gaps: RandomGaps | None
    seed: int
    count: int
    form: Form
    contributors: bool
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        laws = [[one.name, one.text] for one in self.inputs]
        return digest("random", laws, self.seed, self.contributors, self.gaps.key if self.gaps else "")

    @property
    def facts(self) -> dict[str, Any]:  # type: ignore[override]
        names = [one.name for one in self.inputs] + [FIELD] * bool(self.gaps)
        return {"inputs": names, "cases_per_point": len(names) + 2 if self.contributors else 1}

    def draws(self, k: int) -> list[int]:
        """The draw of each input in case k, the field last."""
        names, per_point = self.facts.values()
        j, r = divmod(k, per_point)
        return [2 * j + (r in (1, 2 + i)) if self.contributors else k for i in range(len(names))]

    def values(self, k: int) -> list[Vector]:
        """The numbers of each of `inputs` in case k."""
        seeds = [
            (self.seed, n, int(digest(one.name)[:16], 16))
            for n, one in zip(self.draws(k), self.inputs, strict=False)
        ]
        shares = [
            np.random.default_rng(seed).random(max(one.elements, 1))
            for seed, one in zip(seeds, self.inputs, strict=True)
        ]
        return [values_at(one.law, share) for one, share in zip(self.inputs, shares, strict=True)]

    def parameters(self, k: int) -> dict[str, Any]:
        drawn = zip(self.inputs, self.values(k), strict=True)
        row = {one.name: v.tolist() if one.elements else float(v[0]) for one, v in drawn}
        return row | (self.gaps.parameters(self.draws(k)[-1]) if self.gaps else {})

    def load(self, k: int) -> LoadCase:
        changed, gaps = dict(self.pieces), self.gaps
        for one, v in zip(self.inputs, self.values(k), strict=True):
            pieces = changed[one.effect]
            pairs = zip(pieces, np.resize(v, len(pieces)), strict=True)
            changed[one.effect] = [one.changed(*pair, self.scene.joint) for pair in pairs]
        effects = [piece for pieces in changed.values() for piece in pieces]
        laws = [effect for effect in effects if gaps and isinstance(effect, InitialGap)]
        change = load_case(self.scene, self.form, [effect for effect in effects if effect not in laws])
        g = self.rest.g + change.g
        if gaps:
            g += gaps.gap(self.draws(k)[-1], laws[0] if laws else gaps.field)
        return LoadCase(self.rest.f + change.f if change.f.any() else self.rest.f, g)


def random_inputs(
    scene: Scene,
    texts: Sequence[str],
    count: int,
    seed: int,
    form: Form,
    gaps: RandomGaps | None = None,
    base_points: int | None = None,
) -> RandomInputs:
    """Load cases of texts KEY=[each] DISTRIBUTION. Raises InputError with all faults.

    gaps : random gaps, one more input. base_points : N; the cases are then the N (d + 2) for contributors.
    """
    if not isinstance(scene, JointScene):
        raise InputError.one("--random", "key", ", ".join(texts), allowed_keys({}))
    keys, faults, inputs = keys_of(scene), list[Fault](), list[Input]()
    if gaps and gaps.points is not None:  # a scan has one correlation length
        keys = {name: key for name, key in keys.items() if key.path[-1] != "correlation_length"}
    for name, law in [[part.strip() for part in text.partition("=")[::2]] for text in texts]:
        key, bare, where = keys.get(name), law.removeprefix("each "), f"--random {name}"
        if key is None or name in [one.name for one in inputs]:
            allowed = "one distribution of each key" if key else allowed_keys(keys)
            faults.append(Fault("--random", "key", name, allowed))
        try:
            frozen = distribution(bare)
        except ValueError as error:
            faults.append(Fault(where, "distribution", law, str(error)))
            continue
        if key:
            elements = scene.effects[key.effect].element_count(scene.joint) if bare != law else 0
            inputs.append(Input(**vars(key), text=law, law=frozen, elements=elements))
            if bare != law and not elements:
                faults.append(Fault(where, "each", law, "left out: it has no elements at points"))
            for value in values_at(frozen, np.array([0.0, 1.0])).tolist():
                faults += key.faults(scene, value, f"{where}={law}")
    d, N = len(inputs) + bool(gaps), base_points
    if N is not None and (d < 2 or N < 2 or N & (N - 1)):
        allowed = "a power of 2 from 2 on, and at least two random inputs"
        faults.append(Fault("--contributors", "N, inputs", (N, d), allowed))
    if faults:
        raise InputError(faults)
    effects = [gaps.field if gaps and isinstance(effect, InitialGap) else effect for effect in scene.effects]
    counts = {one.effect: one.elements for one in sorted(inputs, key=lambda one: one.elements)}
    pieces = {
        i: [effects[i].only([k], scene.joint) for k in range(q)] or [effects[i]] for i, q in counts.items()
    }
    fixed = [e for i, e in enumerate(effects) if i not in pieces and not (gaps and isinstance(e, InitialGap))]
    notes = [f"{one.name}: {one.text}, median {one.law.median():.4g}" for one in inputs]
    notes += gaps.notes if gaps else ()
    cases = (count if N is None else N * (d + 2)), form, N is not None, tuple(notes)
    return RandomInputs(scene, tuple(inputs), pieces, load_case(scene, form, fixed), gaps, seed, *cases)
