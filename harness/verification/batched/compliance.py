"""A proven upper bound on max (K⁻¹)_ii: the largest displacement of a node under 1 N on it, mm/N.

It turns a bound on ‖e‖_K into one on each entry, |e_i| ≤ √(K⁻¹)_ii ‖e‖_K, and is far below 1/λmin(K).

The Cholesky factor has UᵀU = K + ΔK with ‖ΔK‖₂ ≤ c (see `definite`), so that with κ ≤ λmin(K)

    K⁻¹ ⪯ (1 + c/κ) (UᵀU)⁻¹,    ((UᵀU)⁻¹)_ii = ‖row i of U⁻¹‖².

The computed inverse X has |XU − I| ≤ γ|X||U| (Higham, Accuracy and Stability of Numerical Algorithms, 2nd
ed., 14.2), so that ‖X − U⁻¹‖_F ≤ ε ‖U⁻¹‖_F with ε = γ ‖X‖_F ‖U‖_F.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from harness.verification.exact_residual import gamma
from problems.forms.assembly import Matrix
from problems.forms.prepared import Prepared

from .residual import SAFE


def largest_compliance(prepared: Prepared, kappa: float) -> float:
    """max (K⁻¹)_ii in mm/N; infinite if no bound can be proven."""
    pairs = zip(prepared.assembly.K.matrices, prepared.assembly.K.factors, strict=True)
    return max(_of_block(K, U, kappa) for K, U in pairs)


def _of_block(K: Matrix, U: Matrix, kappa: float) -> float:
    X, info = lapack.dtrtri(U)
    error = gamma(2 * (len(K) + 1))
    relative = SAFE * error / (1 - error) * (float(np.trace(K)) / kappa) if kappa > 0 else np.inf  # c/κ
    length, size = (float(np.linalg.norm(np.triu(each))) for each in (X, U))
    epsilon = SAFE * gamma(3 * len(K)) * length * size
    if info != 0 or not kappa > 0 or epsilon >= 0.5:
        return np.inf
    row = float(np.sqrt((np.triu(X) ** 2).sum(axis=1).max())) + epsilon / (1 - epsilon) * length
    return SAFE * (1 + relative) * row**2
