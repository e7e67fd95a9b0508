"""Starting points of the interior-point method: Algorithm 5 of the paper."""

from __future__ import annotations

import numpy as np

from problems.assembly import Matrix, Vector


class NoStart(ValueError):
    """No feasible starting point was found."""


def algorithm_5(
    Q: Matrix, p: Vector, force: float = 1.0, mult: float = 2.0, max_steps: int = 200
) -> tuple[Vector, Vector]:
    """Contact forces high enough to open every gap: λ > 0 with y = Qλ − p > 0.

    Starts from λ = force·e (N), corrected row by row until Qλ > 0 (eq. 16), and multiplies it by mult
    until y ≥ 0; then once more, because the interior needs y > 0: mult·Qλ − p > Qλ − p ≥ 0.

    Returns (λ, y). Raises NoStart where no λ > 0 with Qλ > 0 was found within max_steps sweeps.
    """
    lam, Qlam = _positive_response(Q, force, max_steps)  # step 1
    for _ in range(max_steps):  # step 2
        y = Qlam - p  # step 3
        opened = bool((y >= 0).all())  # step 4
        lam, Qlam = mult * lam, mult * Qlam  # step 7, and the margin
        if opened:
            return lam, Qlam - p  # steps 9 and 10, with w = λ
    raise NoStart(f"Algorithm 5: y = Qλ − p still has a negative entry after {max_steps} steps")


def _positive_response(Q: Matrix, force: float, max_sweeps: int) -> tuple[Vector, Vector]:
    """λ > 0 with Qλ > 0: the correction λ_i ← −Σ_{j≠i} q_ij λ_j / q_ii + ε below eq. (16)."""
    lam = np.full(len(Q), force)
    for _ in range(max_sweeps):
        Qlam = Q @ lam
        negative = np.flatnonzero(Qlam <= 0)
        if not negative.size:
            return lam, Qlam
        for i in negative:
            others = Q[:, i] @ lam - Q[i, i] * lam[i]
            lam[i] = max(lam[i], -others / Q[i, i] + force)
    raise NoStart(f"Algorithm 5: no λ > 0 with Qλ > 0 was found in {max_sweeps} sweeps")
