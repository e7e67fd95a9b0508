"""How far from the exact answer a solver that calls it solved may be."""

import numpy as np
from exact_draws import ExactLoad
from solving import TOLERANCES

from harness.verification.judge import LIMIT_MM, conditioned_limit
from problems.forms.prepared import Prepared

COMPLIANCE = 0.1  # mm/N, as in ipm's CONTACT_COMPLIANCE


def promised(name: str, D: float, m: int, weakest: float, force: float, rounding: float) -> float:
    """√D ‖x − x*‖_K, which max|x − x*| does not exceed, of a solver that kept its word; D = 1: ‖λ − λ*‖_Q.

    With contacts of unit length and |y_C| ≤ δ, y ≥ −δ: the answer is that of gaps changed by δ, and off by
    √(mδ²/λmin(Q)) in the norm of K at most (batched/bound.py). Of ipm, λᵀy ≤ m ε_μ, and feasible to δ: from
    ‖e‖²_K = (λ − λ*)ᵀ(y − y*) ≤ λᵀy − λ*ᵀy ≤ m ε_μ + δ Σ(λ + λ*).
    """
    tolerance = TOLERANCES[name]
    if name == "ipm":
        delta = max(1e-3 * np.sqrt(tolerance), rounding)
        return float(np.sqrt(D * (m * tolerance + 2.1 * delta * force)))
    return float(np.sqrt(D * m / weakest) * max(tolerance, rounding)) if weakest > 0 else np.inf


def promises(data: Prepared, each: ExactLoad, condition: float) -> dict[str, tuple[float, float]]:
    """max|x − x*|, mm, that each solver's promise and the judge's limit leave.

    The latter is for joints no more compliant than ipm assumes, and for units in which 1e-7 mm is more than
    the rounding of K⁻¹f: where it is less, the judge knows of cond(K), not of nearly dependent contacts.
    """
    m, c = data.assembly.m, abs(data.assembly.A).max(axis=0).toarray().ravel()
    D = float(np.diag(data.assembly.K.solve(np.eye(data.assembly.n))).max())
    weakest = float(np.linalg.eigvalsh(data.Q / c / c[:, None])[0])
    size = float(max(abs(v).max() for v in (each.x, data.assembly.K.solve(each.load.f), each.load.g / c)))
    rounding = conditioned_limit(0.0, condition, size)
    judged = LIMIT_MM if D <= COMPLIANCE and rounding <= LIMIT_MM else np.inf
    force = float((c * each.lam).sum())
    return {
        name: (promised(name, D, m, weakest, force, rounding / 10) + rounding, judged) for name in TOLERANCES
    }
