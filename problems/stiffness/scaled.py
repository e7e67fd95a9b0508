"""K in other units, DKD: a view that solves with K's factors. Powers of two round nothing."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from .arrays import Matrix, Vector
from .block import scaled
from .operator import Stiffness


class ScaledStiffness(Stiffness):
    """base : K, of sparse blocks. D (n,) : powers of two."""

    def __init__(self, base: Stiffness, D: Vector) -> None:
        super().__init__(base.blocks, lambda _: base.factors)
        self.base, self.D = base, D

    @cached_property
    def matrices(self) -> tuple[Any, ...]:
        """Made when first asked for, read-only."""
        own = zip(self.blocks, (self.D[rows] for rows in self.slices), strict=True)
        found = tuple(scaled(block.matrix, D, D) for block, D in own)
        for matrix in found:
            matrix.data.flags.writeable = False
        return found

    @cached_property
    def diagonal(self) -> Vector:
        return self.D**2 * self.base.diagonal

    def multiply(self, x: Matrix) -> Matrix:
        return _times(self.D, self.base.multiply(_times(self.D, x)))

    def solve(self, b: Matrix) -> Matrix:
        """(DKD)⁻¹b = D⁻¹K⁻¹D⁻¹b."""
        return _times(1 / self.D, self.base.solve(_times(1 / self.D, b)))

    def panels(self) -> Iterator[tuple[slice, slice, Any]]:
        for rows, own, panel in self.base.panels():
            yield rows, own, sp.diags_array(self.D[rows]) @ panel @ sp.diags_array(self.D[own])

    def compliance(self, A: sp.csc_array) -> Matrix:
        """With D⁻¹A, Aᵀ(DKD)⁻¹A is that of K."""
        return self.base.compliance(scaled(A, 1 / self.D, np.ones(A.shape[1])))


def _times(D: Vector, x: Matrix) -> Matrix:
    return (D * x.T).T
