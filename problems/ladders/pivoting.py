"""Pivoting: single exchanges of signs visit exponentially many contact sets.

Q = LLᵀ, L unit lower triangular with 2 below the diagonal, p = 1 (Fathi, Math. Programming 17:335–344, 1979).
L = (I + S)(I − S)⁻¹ with S the shift, so L⁻¹ has entries 1 and ±2, and K = Q⁻¹ = L⁻ᵀL⁻¹ is whole;
cond(K) ≈ (4m/π)⁴. As Qe₁ = (1, 2, …, 2)ᵀ, the solution is λ = e₁, x = −Qe₁: one closed contact of m.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung

SIZES = (8, 16, 32, 48, 64, 128, 256, 512)


def _fathi(m: int) -> Rung:
    i, j = np.indices((m, m))
    inverse = np.where(i > j, 2.0 * (-1.0) ** (i - j), np.where(i == j, 1.0, 0.0))
    K = np.asfortranarray(inverse.T @ inverse)
    assembly = Assembly((K,), sp.eye_array(m, format="csc"), None, ("part 1",))
    load = LoadCase(np.zeros(m), -np.ones(m))
    x, lam = np.full(m, -2.0), np.zeros(m)
    x[0], lam[0] = -1.0, 1.0
    title = f"Fathi's problem with {m} contacts, one closed"
    return Rung(title, made=ManufacturedProblem(assembly, load, x, lam))


RUNGS: Ladder = {f"fathi-{m:03d}": partial(_fathi, m) for m in SIZES}
