"""The stiffness matrix K as an operator: dense, banded or general sparse diagonal blocks.

Here is what the blocks share: arrays, named by what they hold (real numbers, indices, and a set as a mask);
the unit roundoff of float64, what k roundings amount to, and units that round nothing: powers of two.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

U = 2.0**-53
SAFE = 1.01  # for the rounding of the bounds themselves


def gamma(k: Any) -> Any:
    """γ_k = ku/(1 − ku), of a number or an array."""
    return k * U / (1 - k * U)


def power_of_two(sizes: Vector | float) -> Vector:
    """The nearest to each size > 0: between 1/√2 and √2 of it."""
    return np.exp2(np.round(np.log2(sizes)))


def balanced_units(diagonal: Vector) -> Vector:
    """D (n,), powers of two, D_i √K_ii between 1/√2 and √2; 1 where K_ii is not positive.

    The unknowns of a finite-element model have mixed units (mm, 1, 1/mm); DKD has the digits of K.
    """
    return 1 / power_of_two(np.sqrt(np.where(diagonal > 0, diagonal, 1.0)))
