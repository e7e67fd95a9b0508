"""Judges an answer from the problem's own data and the reference.

With x, λ the answer, x* the reference and y = g − Aᵀx the final gaps:

    displacement_error_mm = max|x − x*|                                    over the displacements asked for
    backward_error        = max(‖Kx − f + Aλ‖ / F, max|min(λ‖A‖ / F, y / G)|)     max-norms
    min_gap_mm            = min y
    primal_residual       = max(0, max(Aᵀx − g))                          mm
    dual_residual         = max(max|Kx − f + Aλ|, max(0, −λ))             N
    duality_gap           = |xᵀKx − fᵀx + gᵀλ|                            N·mm
    objective             = ½xᵀKx − fᵀx                                  N·mm
    contact_mismatch      = closed in x* and y > limit, or open in x* and y ≤ limit

The backward error is the residual of the optimality conditions (equilibrium; λ ≥ 0, y ≥ 0, λᵀy = 0) relative
to their terms, F = ‖K‖‖x‖ + ‖f‖ + ‖A‖‖λ‖ and G = ‖Aᵀ‖‖x‖ + ‖g‖. A stable algorithm reaches about 2⁻⁵³,
however ill-conditioned K is. The duality gap is the primal objective ½xᵀKx − fᵀx minus the dual objective
−½xᵀKx − gᵀλ. A contact counts as open in x* if its gap there is above 2·limit: a contact with a smaller gap
may be open or closed in an answer within the limit.
"""

from dataclasses import dataclass

import numpy as np

from harness.results.schema import Judgement, Verdict
from problems.forms.assembly import LoadCase, Mask, Vector
from problems.forms.prepared import Prepared

#: The required accuracy: max-norm of the displacement error, mm.
LIMIT_MM = 1e-7

#: The reference's error bound may be at most this share of the limit.
REFERENCE_SHARE = 0.1


@dataclass(frozen=True)
class Reference:
    """The answer that others are compared with: x (n,) in mm and λ (m,) in N, max|x − x*| ≤ bound_mm.

    active : (m,) the closed contacts. route : how it was proven. unit_mm, gap_unit_mm : the length of one
    unit of x and of the gaps, mm.
    """

    x: Vector
    lam: Vector
    active: Mask
    bound_mm: float
    route: str
    unit_mm: Vector | float = 1.0
    gap_unit_mm: Vector | float = 1.0


def conditioned_limit(limit_mm: float, cond_K: float, largest_mm: float) -> float:
    """max(limit, 100 cond(K) 2⁻⁵³ max|x*|): the accuracy that a solver in float64 can reach."""
    return max(limit_mm, 100 * cond_K * 2.0**-53 * largest_mm)


def judge(
    prepared: Prepared, load: LoadCase, reference: Reference, x: Vector, lam: Vector, limit_mm: float
) -> Judgement:
    """Judge x (n,) in mm and lam (m,) in N; lam all NaN if the solver gives no forces.

    The verdict is `within` if max|x − x*| ≤ limit_mm, and `cannot_be_judged` if the error bound
    of x* is above a tenth of the limit.
    """
    A = prepared.assembly.A
    if x.shape != (A.shape[0],) or not np.isfinite(x).all():
        return Judgement("no_answer", reference.bound_mm)
    away = np.abs(x - reference.x) * reference.unit_mm
    error = float(np.max(prepared.assembly.at_junction(away)))
    y = load.g - A.T @ x
    gap, reference_gap = y * reference.gap_unit_mm, (load.g - A.T @ reference.x) * reference.gap_unit_mm
    wrongly_open = reference.active & (gap > limit_mm)
    wrongly_closed = ~reference.active & (reference_gap > 2 * limit_mm) & (gap <= limit_mm)
    dual_residual = duality_gap = backward_error = None
    Kx = prepared.assembly.K.multiply(x)
    if lam.shape == (A.shape[1],) and np.isfinite(lam).all():
        force = Kx - load.f + A @ lam
        dual_residual = _or_overflow(float(max(np.max(np.abs(force)), np.max(-lam, initial=0.0))))
        backward_error = _or_overflow(_backward_error(prepared, load, x, lam, force, y))
        duality_gap = _or_overflow(float(abs(x @ Kx - load.f @ x + load.g @ lam)))
    if not reference.bound_mm <= REFERENCE_SHARE * limit_mm:
        verdict: Verdict = "cannot_be_judged"
    else:
        verdict = "within" if error <= limit_mm else "outside"
    return Judgement(
        verdict=verdict,
        reference_bound_mm=reference.bound_mm,
        displacement_error_mm=error,
        contact_mismatch=int(np.sum(wrongly_open | wrongly_closed)),
        min_gap_mm=float(np.min(gap, initial=np.inf)),
        primal_residual=float(np.max(-gap, initial=0.0)),
        dual_residual=dual_residual,
        duality_gap=duality_gap,
        backward_error=backward_error,
        objective=_or_overflow(float(x @ Kx / 2 - load.f @ x)),
    )


def _or_overflow(value: float) -> float:
    """∞ for a NaN, which in sums of finite numbers is an overflow."""
    return float("inf") if np.isnan(value) else value


def _backward_error(
    prepared: Prepared, load: LoadCase, x: Vector, lam: Vector, force: Vector, y: Vector
) -> float:
    A = prepared.assembly.A
    K_norm = prepared.assembly.K.norm
    A_norm, At_norm = (float(abs(A).sum(axis=axis).max(initial=0.0)) for axis in (1, 0))
    x_size = float(np.abs(x).max())
    F = K_norm * x_size + float(np.abs(load.f).max()) + A_norm * float(np.abs(lam).max(initial=0.0))
    G = At_norm * x_size + float(np.abs(load.g).max(initial=0.0))
    complementarity = np.minimum(lam * A_norm / (F or 1.0), y / (G or 1.0))
    return float(max(np.abs(force).max() / (F or 1.0), np.abs(complementarity).max(initial=0.0)))
