"""Loads beyond the junction, condensed onto its nodes: f_j − K_ji K_ii⁻¹ f_i.

j are the deflections of the junction nodes, i the part's other free unknowns, as in condense.py.
"""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from problems.build import cache_key
from problems.fem.line_loads import line_loads
from problems.forms.assembly import Vector
from problems.model.effect import PartLoadEffect, PartModel
from problems.model.joint import Joint, Part
from problems.scene import Scene, plain
from problems.storage import cache
from problems.storage.fingerprint import fingerprint


def condensed_load(effect: PartLoadEffect, scene: Scene, joint: Joint) -> Vector:
    """(node_count,) forces in N on the junction nodes of the effect's part, from the cache if known.

    A load on the whole part and its condensation push the junction nodes alike: the work of f_i on the
    motions that the junction imposes goes to f_j, and its work on the others does not move the junction.
    """
    modules = [inspect.getmodule(made) for made in (effect.load, PartModel, condensed_load, line_loads)]
    code = fingerprint(Path(inspect.getfile(module)) for module in modules if module)
    key = cache.digest("condensed load", cache_key(scene), plain(effect), code)
    found = cache.load(key)
    if found is None:
        (part,) = (part for part in joint.part if part.name == effect.part)
        stiffeners = tuple(other for other in scene.stiffness_effects if other.part == part.name)
        force = _condensed(effect, PartModel(joint.plate(part), stiffeners), joint, part)
        cache.store(key, {"force": force}, {})
        return force
    return np.array(found[0]["force"])


def _condensed(effect: PartLoadEffect, model: PartModel, joint: Joint, part: Part) -> Vector:
    plate = model.plate
    K = plate.stiffness()
    for stiffener in model.effects:
        K = K + stiffener.stiffness(plate)
    first = 0 if part.south is None else part.south.elements
    rows = range(first, first + len(joint.y))
    j = np.concatenate([plate.deflection_dofs(row) for row in rows])
    held = np.zeros(plate.size, dtype=bool)
    held[j] = True
    for edge, line in (("south", 0), ("north", len(plate.y) - 1)):
        if edge in part.clamped:
            held[plate.line_dofs(line)] = True
    i = np.flatnonzero(~held)
    f = effect.load(model)
    K_ii = sp.csc_array(K[i][:, i])
    factor = splu(K_ii, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    u = factor.solve(f[i])
    u += factor.solve(f[i] - K_ii @ u)
    return f[j] - K[j][:, i] @ u
