"""The stiffness of one part, condensed onto the deflections of its junction nodes and cached."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from problems.forms.assembly import Matrix
from problems.model.effect import StiffnessEffect
from problems.model.joint import Joint, Part
from problems.model.part import PartModel
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from . import condense

#: The folders whose code makes a part's stiffness.
CODE = ("problems/fem", "problems/model", "problems/effects")


def part_key(joint: Joint, part: Part, effects: tuple[StiffnessEffect, ...]) -> str:
    """The hash of the code and data of a part's stiffness; its name does not count."""
    own = [effect for effect in effects if effect.part == part.name]
    modules = (inspect.getmodule(type(effect)) for effect in own)
    files = [Path(inspect.getfile(module)) for module in modules if module]
    code = fingerprint([*files, Path(__file__), Path(condense.__file__)], within=CODE)
    data = [effect.model_dump(mode="json", exclude={"part"}) for effect in own]
    geometry = [joint.junction.model_dump(mode="json"), part.model_dump(mode="json", exclude={"name"})]
    return cache.digest("part", geometry, data, code)


def condensed_part(
    joint: Joint,
    part: Part,
    effects: tuple[StiffnessEffect, ...],
    progress: Callable[[str, float], None],
) -> tuple[Matrix, float]:
    """The part's stiffness on the junction nodes, (node_count, node_count) N/mm, x running fastest.

    effects : the scene's, of which those on this part count.
    Also returns the seconds of the computation.
    Raises NotPositiveDefinite if some motion of the part costs no energy.
    """

    def made() -> cache.Entry:
        start = time.perf_counter()
        model = PartModel.of(joint, part, effects)
        K = _condensed(model, lambda done: progress(f"condensing {part.name}", done))
        return {"K": K}, {"seconds": time.perf_counter() - start}

    arrays, facts = cache.load_or_make(part_key(joint, part, effects), made)
    return arrays["K"], facts["seconds"]


def _condensed(model: PartModel, progress: Callable[[float], None]) -> Matrix:
    lines = model.free_lines
    # Eliminate from the longer extension inwards, so that the front stays narrow for longest.
    northwards = model.junction.start - lines[0] >= lines[-1] - (model.junction.stop - 1)
    order = lines if northwards else lines[::-1]
    keep = np.zeros(model.plate.size, dtype=bool)
    keep[model.deflections] = True
    S = condense.condense(model.stiffness(), [model.plate.line_dofs(k) for k in order], keep, progress)
    if not northwards:  # lines came in descending y
        nx = len(model.plate.x)
        ascending = np.arange(len(S)).reshape(-1, nx)[::-1].ravel()
        S = S[np.ix_(ascending, ascending)]
    return np.asfortranarray((S + S.T) / 2)
