"""The unit roundoff of float64, and what k roundings amount to."""

from __future__ import annotations

U = 2.0**-53


def gamma(k: int) -> float:
    """γ_k = ku/(1 − ku)."""
    return k * U / (1 - k * U)
