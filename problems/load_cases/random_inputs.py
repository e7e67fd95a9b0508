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


@dataclass(frozen=True)
class Input(Key):
    """A key, its distribution as text and of scipy, and the number of its elements; 0 without `each`."""

    text: str
    law: Any
    elements: int

    def draw(self, seed: int, n: int) -> Vector:
        random = np.random.default_rng((seed, n, int(digest(self.name)[:16], 16)))
        return values_at(self.law, random.random(max(self.elements, 1)))


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

    def load(self, k: int) -> LoadCase:
        pieces = dict(self.pieces)
        for one, v in zip(self.inputs, self.values(k), strict=True):
            pairs = zip(pieces[one.effect], np.resize(v, len(pieces[one.effect])), strict=True)
            pieces[one.effect] = [one.changed(*pair, self.scene.joint) for pair in pairs]
        effects = [effect for some in pieces.values() for effect in some]
        laws = [effect for effect in effects if self.gaps and isinstance(effect, InitialGap)]
        change = load_case(self.scene, self.form, [effect for effect in effects if effect not in laws])
        g = self.rest.g + change.g
        if self.gaps:
            g += self.gaps.gap(self.draws(k)[-1], *(laws or [self.gaps.field]))
        return LoadCase(self.rest.f + change.f if change.f.any() else self.rest.f, g)


def random_inputs(
    scene: Scene,
    laws: Sequence[str],
    form: Form,
    gaps: RandomGaps | None,
    count: int,
    seed: int,
    N: int | None,
) -> RandomInputs:
    """Load cases of laws KEY=[each] DISTRIBUTION. Raises InputError with all faults.

    gaps : random gaps, one more input. N : base points; the cases are then the N (d + 2) for contributors.
    """
    if not isinstance(scene, JointScene):
        raise InputError.one("--random", "key", ", ".join(laws), allowed_keys({}))
    keys, faults, inputs = keys_of(scene), list[Fault](), list[Input]()
    if gaps and gaps.points is not None:  # a scan has one correlation length
        keys = {name: key for name, key in keys.items() if key.path[-1] != "correlation_length"}
    for name, text in [[part.strip() for part in law.partition("=")[::2]] for law in laws]:
        key, bare, where = keys.get(name), text.removeprefix("each "), f"--random {name}"
        if key is None or name in [one.name for one in inputs]:
            allowed = "one distribution of each key" if key else allowed_keys(keys)
            faults.append(Fault("--random", "key", name, allowed))
        try:
            law = distribution(bare)
        except ValueError as error:
            faults.append(Fault(where, "distribution", text, str(error)))
            continue
        if key:
            elements = scene.effects[key.effect].element_count(scene.joint) if bare != text else 0
            inputs.append(Input(**vars(key), text=text, law=law, elements=elements))
            if bare != text and not elements:
                faults.append(Fault(where, "each", text, "left out: it has no elements at points"))
            for value in values_at(law, np.array([0.0, 1.0])).tolist():
                faults += key.faults(scene, value, f"{where}={text}")
    d = len(inputs) + bool(gaps)
    if N is not None and (d < 2 or N < 2 or N & (N - 1)):
        faults.append(Fault("--contributors", "N, inputs", (N, d), "a power of 2, and two inputs or more"))
    if faults:
        raise InputError(faults)
    effects = [gaps.field if gaps and isinstance(effect, InitialGap) else effect for effect in scene.effects]
    counts = {one.effect: one.elements for one in sorted(inputs, key=lambda one: one.elements)}
    each = {i: [effects[i].only([k], scene.joint) for k in range(q)] for i, q in counts.items()}
    fixed = [e for i, e in enumerate(effects) if i not in each and not (gaps and isinstance(e, InitialGap))]
    pieces, rest = {i: some or [effects[i]] for i, some in each.items()}, load_case(scene, form, fixed)
    count, notes = (N * (d + 2) if N else count), (gaps.notes if gaps else ())
    return RandomInputs(scene, tuple(inputs), pieces, rest, gaps, seed, count, form, bool(N), notes)
