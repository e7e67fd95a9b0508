"""Loads beyond the junction, condensed onto its nodes: f_j − K_ji K_ii⁻¹ f_i.

j are the deflections of the junction nodes, i the part's other free unknowns, as in condense.py.
"""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from problems.forms.assembly import Vector
from problems.model.effect import StiffnessEffect
from problems.model.joint import Joint
from problems.model.part import PartModel
from problems.model.part_load import PartLoadEffect
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from .condensed_part import CODE, part_key


def condensed_load(effect: PartLoadEffect, joint: Joint, stiffeners: tuple[StiffnessEffect, ...]) -> Vector:
    """(node_count,) forces in N on the junction nodes of the effect's part, from the cache if known.

    A load on the whole part and its condensation push the junction nodes alike: the work of f_i on the
    motions that the junction imposes goes to f_j, and its work on the others does not move the junction.
    """
    (part,) = (part for part in joint.part if part.name == effect.part)
    code = fingerprint([Path(inspect.getfile(type(effect))), Path(__file__)], within=CODE)
    data = effect.model_dump(mode="json", exclude={"part"})
    key = cache.digest("condensed load", part_key(joint, part, stiffeners), data, code)

    def made() -> cache.Entry:
        return {"force": _condensed(effect, PartModel.of(joint, part, stiffeners))}, {}

    return np.array(cache.load_or_make(key, made)[0]["force"])


def _condensed(effect: PartLoadEffect, model: PartModel) -> Vector:
    K, f = model.stiffness(), effect.load(model)
    i, j = model.others, model.deflections
    K_ii = sp.csc_array(K[i][:, i])
    factor = splu(K_ii, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    u = factor.solve(f[i])
    u += factor.solve(f[i] - K_ii @ u)
    return f[j] - K[j][:, i] @ u
