"""The unit roundoff of float64, and what k roundings amount to."""

from typing import Any

U = 2.0**-53
SAFE = 1.01  # for the rounding of the bounds themselves


def gamma(k: Any) -> Any:
    """γ_k = ku/(1 − ku), of a number or an array."""
    return k * U / (1 - k * U)
