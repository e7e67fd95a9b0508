"""Infeasible starting points of the interior-point method: STP1, STP2 and Mehrotra's.

STP1 and STP2 are those of D'Apuzzo, De Simone and di Serafino (Optim. Lett. 4:131–146, 2010), whose
text was not available: they follow a secondary source, the interior-point code of Project Chrono, and
its parameters. In the dual form the unknowns are λ and its slack w = λ, the multipliers are the gaps y,
and the residual is s1 = y − (Qλ − p).
"""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.forms.product import product

from .newton_system import Direct
from .start import Start


def stp1(Q: Matrix, p: Vector, rho: float) -> Start:
    """λ = y = e, scaled once by r/(ρ·gap) if r = ‖s1‖₂ exceeds ρ·gap, gap = λᵀy = m."""
    return _scaled(Q, p, np.ones(len(p)), np.ones(len(p)), rho)


def stp2(Q: Matrix, p: Vector, rho: float, epsilon: float) -> Start:
    """From x = K⁻¹f: y_i = max((g − Aᵀx)_i, ε) = max(−p_i, ε) and λ_i = 1/y_i; then scaled as STP1.

    (From λ = e instead of x, as in the secondary source, it would coincide with STP1 on this form; it does
    so anyway if ε exceeds all gaps, as the source's ε = 1 does here.)
    """
    y = np.maximum(-p, epsilon)
    return _scaled(Q, p, 1.0 / y, y, rho)


def _scaled(Q: Matrix, p: Vector, lam: Vector, y: Vector, rho: float) -> Start:
    r = float(np.linalg.norm(y - (product(Q, lam) - p)))
    gap = float(lam @ y)
    scale = max(1.0, r / (rho * gap))
    return Start(scale * lam, scale * y)


def mehrotra_start(Q: Matrix, p: Vector) -> Start:
    """One affine step from a point of the data's magnitude: λ = max(λ̄, |λ̄ + Δλ|), y = max(ȳ, |ȳ + Δy|).

    ȳ = max|p| e in mm and λ̄ = ȳ m / trace Q in N. This form is from Nocedal and Wright,
    Numerical Optimization, 2nd ed., section 16.6, where the smallest values are 1.
    """
    y_bar = np.full(len(p), float(abs(p).max()) or 1.0)
    lam_bar = y_bar * len(p) / float(np.trace(Q))
    # The affine step of Algorithm 2 with σ = 0: (Q + D) Δλ = −(Qλ̄ − p), D = ȳ/λ̄, Δy = −ȳ − dΔλ.
    D = y_bar / lam_bar
    dlam = Direct(Q).solve(D, p - Q @ lam_bar, tolerance=0.0, limit=0).v
    dy = -y_bar - D * dlam
    return Start(np.maximum(lam_bar, abs(lam_bar + dlam)), np.maximum(y_bar, abs(y_bar + dy)))
