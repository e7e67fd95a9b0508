"""A sparse block in other units, DKD: a view that solves with K's factor. Powers of two round nothing."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .block import Block, Matrix, SparseBlock, Vector, scaled
from .selected_inverse import Rows


class ScaledBlock(SparseBlock):
    """base : K. D (size,) : powers of two."""

    def __init__(self, base: Block, D: Vector) -> None:
        self.base, self.D = base, D

    @cached_property
    def matrix(self) -> sp.csc_array:
        """Made when first asked for, read-only."""
        found = scaled(self.base.matrix, self.D, self.D)
        found.data.flags.writeable = False
        return found

    @property
    def band(self) -> tuple[int, Rows | None] | None:
        return self.base.band

    @property
    def size(self) -> int:
        return len(self.D)

    def multiply(self, x: Matrix) -> Matrix:
        return self._times(self.base.multiply(self._times(x)))

    def diagonal(self) -> Vector:
        return self.D**2 * self.base.diagonal()

    @property
    def arrays(self) -> list[NDArray[Any]]:
        return self.base.arrays

    def factor(self) -> list[NDArray[Any]]:
        return self.base.factor()

    @property
    def numbers(self) -> int:
        return self.base.numbers

    def solve(self, b: Matrix) -> Matrix:
        """(DKD)⁻¹b = D⁻¹K⁻¹D⁻¹b."""
        return self._times(self.base.solve(self._times(b, 1 / self.D)), 1 / self.D)

    def shifted(self, D: Vector, s: float) -> float | None:
        return self.base.shifted(self.D * D, s)

    def compliance(self, A: sp.csc_array) -> Matrix:
        return self.base.compliance(self._in_base_units(A))

    def _in_base_units(self, A: sp.csc_array) -> sp.csc_array:
        """D⁻¹A, with which Aᵀ(DKD)⁻¹A is that of K."""
        return scaled(A, 1 / self.D, np.ones(A.shape[1]))

    def _times(self, x: Matrix, D: Vector | None = None) -> Matrix:
        return ((self.D if D is None else D) * x.T).T
