"""A part condensed onto the deflections of its junction nodes: stiffness and loads, cached."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.model.part import PartModel, Unknowns
from problems.model.part_load import PartLoadEffect
from problems.stiffness.block import SparseBlock
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from . import condense

#: The folders whose code makes a part's stiffness.
CODE = ("problems/fem", "problems/model", "problems/effects")


def part_key(part: PartModel) -> str:
    """The hash of the code and data of a part's stiffness; its name does not count."""
    modules = (inspect.getmodule(type(effect)) for effect in part.effects)
    files = [Path(inspect.getfile(module)) for module in modules if module]
    code = fingerprint([*files, Path(__file__), Path(condense.__file__)], within=CODE)
    data = [effect.model_dump(mode="json", exclude={"part"}) for effect in part.effects]
    return cache.digest("part", part.geometry, data, code)


def condensed_stiffness(key: str, part: PartModel, progress: Callable[[float], None]) -> tuple[Matrix, float]:
    """The part's stiffness on the junction nodes, (node_count, node_count) N/mm, x running fastest.

    key : that of the part. Also returns the seconds of the computation.
    Raises NotPositiveDefinite if some motion of the part costs no energy.
    """

    def made() -> cache.Entry:
        start = time.perf_counter()
        return {"K": _condensed(part, progress)}, {"seconds": time.perf_counter() - start}

    arrays, facts = cache.load_or_make(key, made)
    return arrays["K"], facts["seconds"]


def _condensed(part: PartModel, progress: Callable[[float], None]) -> Matrix:
    lines = part.free_lines
    # Eliminate from the longer extension inwards, so that the front stays narrow for longest.
    northwards = part.junction.start - lines[0] >= lines[-1] - (part.junction.stop - 1)
    order = lines if northwards else lines[::-1]
    keep = np.zeros(part.plate.size, dtype=bool)
    keep[part.deflections] = True
    S = condense.condense(part.stiffness(), [part.plate.line_dofs(k) for k in order], keep, progress)
    if not northwards:  # lines came in descending y
        nx = len(part.plate.x)
        ascending = np.arange(len(S)).reshape(-1, nx)[::-1].ravel()
        S = S[np.ix_(ascending, ascending)]
    return np.asfortranarray((S + S.T) / 2)


def condensed_load(
    effect: PartLoadEffect, part: PartModel, interior: Callable[[], tuple[Unknowns, SparseBlock]]
) -> Vector:
    """(node_count,) forces in N on the junction nodes: f_j − K_ji K_ii⁻¹ f_i, j the deflections there.

    A load on the whole part and its condensation push the junction nodes alike: the work of f_i on the
    motions that the junction imposes goes to f_j, and its work on the others does not move the junction.
    interior : i and K_ii, asked for if the load is not in the cache.
    """
    code = fingerprint([Path(inspect.getfile(type(effect))), Path(__file__)], within=CODE)
    key = cache.digest("load", part_key(part), effect.model_dump(mode="json", exclude={"part"}), code)

    def made() -> cache.Entry:
        f, j, (i, K_ii) = effect.load(part), part.deflections, interior()
        u = K_ii.solve(f[i])
        u += K_ii.solve(f[i] - K_ii.multiply(u))
        return {"force": f[j] - part.stiffness()[j][:, i] @ u}, {}

    return np.array(cache.load_or_make(key, made)[0]["force"])
