"""Independent springs, whose errors are known in closed form."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from harness.verification.certificate import certify
from harness.verification.exact_residual import DoubleDouble
from problems.forms.assembly import Assembly, LoadCase
from problems.stiffness.operator import Stiffness


def array(*values: float) -> np.ndarray:
    return np.array(values, dtype=float)


def doubled(hi: np.ndarray, lo: np.ndarray | None = None) -> DoubleDouble:
    return DoubleDouble(hi, np.zeros_like(hi) if lo is None else lo)


def diagonal(*stiffness: float, A: list[list[float]] | None = None) -> Assembly:
    """Independent springs, N/mm; each against a rigid tool unless A says otherwise."""
    K = np.asfortranarray(np.diag(array(*stiffness)))
    normals = np.eye(len(K)) if A is None else array(*A).reshape(len(K), -1)
    return Assembly(Stiffness.of(K), sp.csc_array(normals))


def bound_of(
    assembly: Assembly, f: float, g: float, x: DoubleDouble, lam: DoubleDouble, kappa: float
) -> float:
    load = LoadCase(array(*[f] * assembly.n), array(*[g] * assembly.m))
    return certify(assembly, load, x, lam, np.zeros(assembly.m, dtype=bool), kappa).bound_mm
