"""Exponents: the slope of a straight line in log–log."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FEWEST = 5  # sizes that a fit should have


@dataclass(frozen=True)
class Exponent:
    """y ≈ c·n^slope over `points` sizes; `error`: the standard error of the slope."""

    slope: float
    error: float
    points: int
    constant: float

    def __str__(self) -> str:
        few = "" if self.points >= FEWEST else f" ({self.points} sizes only)"
        return f"{self.slope:.2f} ± {self.error:.2f}{few}"


def exponent(n: Sequence[float], y: Sequence[float]) -> Exponent | None:
    """Least squares in log–log; missing and non-positive values are ignored. None below three sizes.

    The standard error is sqrt(Σr² / (k − 2) / Σ(log n − mean)²), r the residuals of k points.
    """
    pairs = [(math.log(a), math.log(b)) for a, b in zip(n, y, strict=True) if b is not None and b > 0]
    if len({a for a, _ in pairs}) < 3:
        return None
    x, z = np.array(pairs).T
    centred = x - x.mean()
    spread = float(centred @ centred)
    slope = float(centred @ z) / spread
    offset = float(z.mean() - slope * x.mean())
    rest = z - offset - slope * x
    error = math.sqrt(float(rest @ rest) / (len(x) - 2) / spread)
    return Exponent(slope, error, len(x), math.exp(offset))
