"""The apparent precision of a matrix's entries, and its effect on the displacements."""

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.forms.prepared import Prepared

SAMPLE_SIZE = 20_000
DOUBLE, SINGLE = 16, 7  # significant digits of the two floating-point formats
DRAWS = 3


def apparent_digits(values: Vector) -> int:
    """The smallest d with every value equal to itself rounded to d significant digits, at most 16.

    7 if all values are in single precision. Examines a sample of 20 000.
    """
    v = values[values != 0]
    if len(v) > SAMPLE_SIZE:
        v = np.random.default_rng(0).choice(v, SAMPLE_SIZE, replace=False)
    some = v.tolist()
    for d in range(1, DOUBLE):
        if all(float(f"{value:.{d - 1}e}") == value for value in some):
            return d
    return SINGLE if np.array_equal(v, v.astype(np.float32)) else DOUBLE


def expected_error(prepared: Prepared, x: Vector, lam: Vector, digits: int) -> float:
    """max|δx|, mm, caused by rounding K to `digits` significant digits, to first order.

    δx = (K⁻¹ − K⁻¹A_C Q_CC⁻¹ A_CᵀK⁻¹) δK x with C the closed contacts, λ > 0, and δK symmetric, each entry
    uniform within half a unit of its last digit; the largest of three random draws.
    """
    assembly = prepared.assembly
    random = np.random.default_rng(0)
    closed = np.flatnonzero(lam > 0)
    A_C, Q_CC = assembly.A[:, closed], prepared.compliance.submatrix(closed).toarray()
    worst = 0.0
    for _ in range(DRAWS):
        force = np.zeros(assembly.n)
        for block, own in zip(assembly.K.blocks, assembly.K.slices, strict=True):
            upper = sp.coo_array(sp.triu(sp.coo_array(block.matrix)))
            size = 0.5 * 10.0 ** (np.floor(np.log10(abs(upper.data))) + 1 - digits)
            drawn = sp.csr_array(
                (random.uniform(-1, 1, size.shape) * size, upper.coords), shape=block.matrix.shape
            )
            force[own] = (drawn + sp.triu(drawn, 1).T) @ x[own]
        dx = assembly.K.solve(force)
        if closed.size:
            dx -= assembly.K.solve(A_C @ np.linalg.solve(Q_CC, A_C.T @ dx))
        worst = max(worst, float(abs(dx).max(initial=0.0)))
    return worst
