"""The error of displacements that K's few digits explain, to first order.

A K rounded to d significant digits is K + δK, δK symmetric, each entry uniform within half a unit of its last
digit. With C the closed contacts, λ > 0, the displacements x then move by

    δx = (K⁻¹ − K⁻¹A_C Q_CC⁻¹ A_CᵀK⁻¹) δK x,

of which the solver of the proof makes the second term, without Q_CC (see `Proof.corrections`).
"""

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness

from .proof import Proof

DRAWS = 3


def expected_error(prepared: Prepared, x: Vector, lam: Vector, digits: int) -> float:
    """max|δx|, mm, the largest of three random δK. x (n,) mm, lam (m,) N."""
    K, force = prepared.assembly.K, _rounding_forces(prepared.assembly.K, x, digits)
    if not (lam > 0).any():
        return float(abs(K.solve(force)).max(initial=0.0))
    proof = Proof(prepared, 0.0)
    D, R = proof.balanced.D, proof.balanced.R
    forces = np.repeat(lam[:, None] / R, DRAWS, axis=1)
    dx, _ = proof.corrections(D * force, np.zeros_like(forces), forces)
    return float(abs(D * dx).max(initial=0.0))


def estimated_displacements(prepared: Prepared, load: LoadCase) -> Vector:
    """Displacements (n,) mm of about the size of the answer, by a few solutions with K.

    x = K⁻¹(f − Aλ) with λ = α max(p, 0), α such that the dual objective ½λᵀQλ − pᵀλ is least.
    """
    p, A = prepared.overlap(load), prepared.assembly.A
    w = np.maximum(p, 0.0)
    curvature = float(w @ (A.T @ prepared.assembly.K.solve(A @ w)))
    return prepared.recover(w * (float(w @ p) / (curvature or 1.0)), load)


def _rounding_forces(K: Stiffness, x: Vector, digits: int) -> Matrix:
    """δK x (n, DRAWS), N, from the upper triangle, some rows at a time."""
    random, n = np.random.default_rng(0), K.size
    forces = np.zeros((n, DRAWS))
    for rows, columns, panel in K.panels():
        entries = sp.coo_array(panel)
        i, j = rows.start + entries.row, columns.start + entries.col
        upper = (j >= i) & (entries.data != 0)
        i, j, values = i[upper], j[upper], abs(entries.data[upper])
        size = 0.5 * 10.0 ** (np.floor(np.log10(values)) + 1 - digits)
        for force in forces.T:
            drawn = random.uniform(-1, 1, size.shape) * size
            force += np.bincount(i, drawn * x[j], n) + np.bincount(j, drawn * x[i] * (i != j), n)
    return forces
