"""The same problem in other units, and with a separate unit for each unknown and contact.

Powers of two replace the thousands (1024 mm for a metre), so that nothing is rounded.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase, Vector
from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.exact import two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices
from problems.stiffness.operator import Stiffness

KILO, MEGA = 2.0**10, 2.0**20


def _rung(title: str, S: Vector | float = 1.0, C: Vector | float = 1.0, v: float = 1.0) -> Scene:
    return matrices(f"Two parts, {title}", rescaled(two_parts(64, 1e6, seed=5), S, C, v))


def _random(title: str, unknowns: int, contacts: int) -> Scene:
    """Scalings from 2^−k to 2^k."""
    random = np.random.default_rng(6)
    S = np.exp2(random.integers(-unknowns, unknowns + 1, 128))
    return _rung(title, S, np.exp2(random.integers(-contacts, contacts + 1, 64)))


def rescaled(
    made: ManufacturedProblem, S: Vector | float, C: Vector | float, v: float
) -> ManufacturedProblem:
    """In x' = S⁻¹x, λ' = C⁻¹λ/v: K' = SKS/v, A' = SAC, f' = Sf/v, g' = Cg. S, C and v powers of two."""
    assert made.x is not None
    assert made.lam is not None
    K, A = made.assembly.K, made.assembly.A
    S, C = np.broadcast_to(S, A.shape[0]), np.broadcast_to(C, A.shape[1])
    parts = zip(K.matrices, K.slices, strict=True)
    blocks = [np.asfortranarray(S[rows, None] * block * S[rows] / v) for block, rows in parts]
    A = sp.csc_array(sp.diags_array(S) @ A @ sp.diags_array(C))
    load = LoadCase(S * made.load.f / v, C * made.load.g)
    assembly = replace(made.assembly, K=Stiffness.of(*blocks), A=A)
    return ManufacturedProblem(assembly, load, made.x / S, made.lam / (C * v), S.copy(), 1 / C)


RUNGS: Ladder = {
    "mm-N": partial(_rung, "mm and N"),
    "mm-kN": partial(_rung, "mm and 1024 N", v=KILO),
    "mm-MN": partial(_rung, "mm and 1024² N", v=MEGA),
    "m-N": partial(_rung, "1024 mm and N", S=KILO, C=1 / KILO, v=KILO),
    "um-N": partial(_rung, "1/1024 mm and N", S=1 / KILO, C=KILO, v=1 / KILO),
    "unknowns": partial(_random, "each unknown in its own unit, 1/16 to 16 mm", 4, 0),
    "contacts": partial(_random, "each contact in its own unit, 1/1024 to 1024 mm", 0, 10),
    "both": partial(_random, "each unknown and contact in its own unit", 4, 10),
}
