"""The referee's second method: the contact set by an interior point, if principal pivoting stagnates.

    λ > 0,   y = Qλ − p > 0,   λᵢyᵢ → 0

Mehrotra's predictor–corrector (SIAM J. Optim. 2:575–601, 1992) on Q scaled to a unit diagonal: about 20
Cholesky factorisations of Q + diag(y/λ), m³/3 operations each, at most 100, whatever the number of contact
sets that pivoting would visit. The set {λᵢ > yᵢ} is a guess, for the caller to check.

As principal_pivoting.py, it shares no code with the solvers (solvers/interior_point).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from problems.forms.assembly import Matrix, Vector

MAX_ITERATIONS = 100
TO_BOUNDARY = 0.99  # share of the step to the boundary
SMALLEST_MU = 1e-30  # of the first μ: the signs do not change any more


def interior_contact_set(Q: Matrix, p: Vector, stop: Callable[[], bool] = lambda: False) -> NDArray[np.bool_]:
    """(m,) bool, λᵢ√qᵢᵢ > yᵢ/√qᵢᵢ at the last iterate. stop : asked before each iteration."""
    dense = np.asarray(Q)
    root = np.sqrt(np.diag(dense))
    H, q = dense / root / root[:, None], p / root
    size = float(abs(q).max(initial=0.0)) or 1.0
    lam, y = np.full(len(p), size), np.full(len(p), size)
    first = size**2
    best, least = lam > y, np.inf
    for _ in range(MAX_ITERATIONS):
        residual = H @ lam - q - y
        mu = float(lam @ y) / len(p)
        merit = max(mu / first if first else 0.0, float(abs(residual).max()) / size)
        if merit < least:
            best, least = lam > y, merit
        if stop() or mu <= SMALLEST_MU * first:  # 0, too, where products underflow
            break
        try:
            factor = sla.cho_factor(H + np.diag(y / lam), lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            break  # rounding: y/λ overflows
        # Predictor: λy + λΔy + yΔλ = 0.
        dlam, dy = _direction(factor, lam, y, residual, -lam * y)
        a = min(_step(lam, dlam), _step(y, dy))
        affine = float((lam + a * dlam) @ (y + a * dy)) / len(p)
        # Corrector: λy + λΔy + yΔλ = σμ − ΔλΔy, σ = (μ_affine/μ)³.
        target = (affine / mu) ** 3 * mu - dlam * dy - lam * y
        dlam, dy = _direction(factor, lam, y, residual, target)
        a = TO_BOUNDARY * min(_step(lam, dlam), _step(y, dy))
        lam, y = lam + a * dlam, y + a * dy
        if not (np.isfinite(lam).all() and np.isfinite(y).all() and (lam > 0).all() and (y > 0).all()):
            break
    return best


def _direction(
    factor: tuple[NDArray[np.float64], bool], lam: Vector, y: Vector, residual: Vector, target: Vector
) -> tuple[Vector, Vector]:
    """HΔλ − Δy = −residual and yΔλ + λΔy = target: (H + diag(y/λ)) Δλ = target/λ − residual."""
    dlam = sla.cho_solve(factor, target / lam - residual, check_finite=False)
    return dlam, (target - y * dlam) / lam


def _step(v: Vector, dv: Vector) -> float:
    """The largest step in [0, 1] with v + step·dv ≥ 0."""
    shrinking = dv < 0
    return float(min(1.0, (-v[shrinking] / dv[shrinking]).min(initial=np.inf)))
