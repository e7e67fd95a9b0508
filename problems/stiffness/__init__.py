"""The stiffness matrix K as an operator: dense, banded or general sparse diagonal blocks.

Arrays are named by what they hold: real numbers, indices, and a set as a mask.
"""

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]
