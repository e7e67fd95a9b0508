"""K = blockdiag(K_1, …, K_p) as an operator: products, solutions, rows, bounds, whatever its blocks are."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from . import Indices, Matrix, Vector, balanced_units
from .block import Block, NotPositiveDefinite, scaled
from .dense_block import DenseBlock, dense_blocks, mirrored
from .selected_inverse import BlockPart
from .sparse_block import sparse_block

POWER_STEPS = 5
COLUMNS_AT_A_TIME = 64  # of K⁻¹A


class Stiffness:
    """K (n, n), N/mm, symmetric positive definite.

    blocks : its diagonal blocks. factor : makes their factors when K⁻¹ is first needed; by default
    `factor_blocks`. It may take them from a cache, or name the scene in its errors.
    """

    def __init__(self, blocks: Sequence[Block], factor: Callable[[Stiffness], object] | None = None) -> None:
        self.blocks = tuple(blocks)
        self._make = factor or Stiffness.factor_blocks
        ends = np.cumsum([0, *(block.size for block in self.blocks)])
        self.slices = [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]
        self.size = int(ends[-1])
        self.factored = False  # whether the factors are made

    @classmethod
    def of(cls, *matrices: Any, nodes: Matrix | None = None) -> Stiffness:
        """K with these diagonal blocks, dense or sparse. nodes : (n, 2) coordinates of the unknowns, mm."""
        ends = np.cumsum([0, *(K.shape[0] for K in matrices)])
        return cls(
            [
                sparse_block(sp.csc_array(K), None if nodes is None else nodes[start : start + K.shape[0]])
                if sp.issparse(K)
                else DenseBlock(K)
                for K, start in zip(matrices, ends, strict=False)
            ]
        )

    @property
    def dense(self) -> bool:
        """Whether every block is stored as a dense matrix."""
        return all(block.dense for block in self.blocks)

    def as_sparse(self, nodes: Matrix | None = None) -> Stiffness:
        """The same K with sparse blocks; itself, if its blocks are sparse."""
        if not any(block.dense for block in self.blocks):
            return self
        return Stiffness.of(*map(sp.csc_array, self.matrices), nodes=nodes)

    def as_dense(self) -> Stiffness:
        """The same K with dense blocks; itself, if its blocks are dense."""
        return self if self.dense else Stiffness.of(*dense_blocks(sp.csr_array(self.matrix)))

    @property
    def matrix(self) -> sp.csc_array:
        """K as one sparse matrix; not copied, if it is a single one."""
        if len(self.blocks) == 1:
            return sp.csc_array(self.matrices[0])
        return sp.csc_array(sp.block_diag(self.matrices, format="csc"))

    @property
    def matrices(self) -> tuple[Any, ...]:
        """The matrix of each block."""
        return tuple(block.matrix for block in self.blocks)

    @property
    def arrays(self) -> list[NDArray[Any]]:
        """The arrays that hold K."""
        return [array for block in self.blocks for array in block.arrays]

    def multiply(self, x: Matrix) -> Matrix:
        """K x, x (n,) or (n, k)."""
        return np.concatenate([block.multiply(x[rows]) for block, rows in self._blocks_with_rows()])

    def solve(self, b: Matrix) -> Matrix:
        """K⁻¹ b, b (n,) or (n, k). Raises NotPositiveDefinite, or what `factor` raises."""
        self.ensure_factored()
        return np.concatenate([block.solve(b[rows]) for block, rows in self._blocks_with_rows()])

    def _blocks_with_rows(self) -> Iterator[tuple[Block, slice]]:
        return zip(self.blocks, self.slices, strict=True)

    def ensure_factored(self) -> None:
        """Make the factors, unless they are made. Raises NotPositiveDefinite, or what `factor` raises."""
        if not self.factored:
            self._make(self)
            self._make = Stiffness.factor_blocks  # what made them may hold this K, in a cycle
            self.factored = True

    @property
    def factors(self) -> list[NDArray[Any]]:
        """The arrays that hold the factors."""
        self.ensure_factored()
        return [array for block in self.blocks for array in block.factor()]

    @property
    def factor_nonzeros(self) -> int:
        """The float64 that the factors hold."""
        return sum(block.factor_nonzeros for block in self.blocks)

    @property
    def factorisation_flops(self) -> float:
        """Operations of a factorisation, about Σ (entries of a column of the factor)²."""
        return sum(block.factor_nonzeros**2 / block.size for block in self.blocks)

    def factor_blocks(self) -> None:
        """Factor each block. Raises NotPositiveDefinite, with the number of an unknown that moves."""
        for block, rows in self._blocks_with_rows():
            try:
                block.factor()
            except NotPositiveDefinite as error:
                raise NotPositiveDefinite(rows.start + error.unknown) from error

    @cached_property
    def diagonal(self) -> Vector:
        """(n,) N/mm."""
        return np.concatenate([block.diagonal() for block in self.blocks])

    @cached_property
    def units(self) -> Vector:
        """D (n,), the units in which the unknowns weigh alike (see `balanced_units`)."""
        return balanced_units(self.diagonal)

    def panels(self) -> Iterator[tuple[slice, slice, Any]]:
        """(rows, columns, K[rows, columns]), all rows in turn, dense or csr; other columns are zero there."""
        for block, all_rows in self._blocks_with_rows():
            for rows, panel in block.panels():
                yield slice(all_rows.start + rows.start, all_rows.start + rows.stop), all_rows, panel

    def absolute_sums(self, D: Vector) -> Vector:
        """|K|D, (n,), up to rounding."""
        sums = np.empty(self.size)
        for rows, columns, panel in self.panels():
            sums[rows] = abs(panel) @ D[columns]
        return sums

    @cached_property
    def norm(self) -> float:
        """‖K‖_∞ = max_i Σ_j |K_ij|, N/mm, up to rounding."""
        return float(self.absolute_sums(np.ones(self.size)).max(initial=0.0))

    def least_eigenvalues(self, D: Vector, steps: int = POWER_STEPS) -> list[float]:
        """An estimate of λmin of each block of DKD, no smaller than it."""
        self.ensure_factored()
        return [_least_eigenvalue(block.solve, D[rows], steps) for block, rows in self._blocks_with_rows()]

    def condition(self, D: Vector) -> float:
        """An estimate of the condition number of DKD, with ‖DKD‖_∞ for its largest eigenvalue."""
        least = min(self.least_eigenvalues(D))
        return float((self.absolute_sums(D) * D).max()) / least if least > 0 else np.inf

    def compliance(self, A: sp.csc_array) -> Matrix:
        """Q = AᵀK⁻¹A, (m, m), mm/N, by columns."""
        self.ensure_factored()
        m = A.shape[1]
        Q = np.zeros((m, m), order="F")
        dense = [block for block in self.blocks if isinstance(block, DenseBlock)]
        if len(dense) == len(self.blocks):
            for block, rows in zip(dense, self.slices, strict=True):
                Q += block.compliance(sp.csc_array(A[rows]))
        else:
            for start in range(0, m, COLUMNS_AT_A_TIME):
                some = slice(start, start + COLUMNS_AT_A_TIME)
                Q[:, some] = A.T @ self.solve(A[:, some].toarray())
        return mirrored(Q)

    def local_compliance(
        self, A: sp.csc_array, windows: Sequence[Indices], single: bool = True
    ) -> Callable[[Indices], Matrix] | None:
        """A function that gives Q_WW (k, k) mm/N, by columns, for a window W of contacts; in single precision
        about four digits are right, enough for a preconditioner. None unless every block has a band along
        which the contacts of each window are near each other.
        """
        parts: list[BlockPart] = []
        for block, rows in self._blocks_with_rows():
            part = block.local_compliance(sp.csc_array(A[rows]), windows, single)
            if part is None:
                return None
            parts.append(part)

        def local(contacts: Indices) -> Matrix:
            Q = np.zeros((len(contacts), len(contacts)), order="F")
            for part in parts:
                part.add_to(Q, contacts)
            return Q

        return local


class ScaledStiffness(Stiffness):
    """K in other units, DKD: a view that solves with K's factors. Powers of two round nothing.

    base : K, of sparse blocks. D (n,) : powers of two.
    """

    def __init__(self, base: Stiffness, D: Vector) -> None:
        super().__init__(base.blocks, lambda _: base.ensure_factored())
        self.base, self.D = base, D

    @cached_property
    def matrices(self) -> tuple[Any, ...]:
        """DKD's blocks, read-only."""
        pairs = zip(self.blocks, self.slices, strict=True)
        matrices = tuple(scaled(block.matrix, self.D[rows], self.D[rows]) for block, rows in pairs)
        for matrix in matrices:
            matrix.data.flags.writeable = False
        return matrices

    @cached_property
    def diagonal(self) -> Vector:
        return self.D**2 * self.base.diagonal

    def multiply(self, x: Matrix) -> Matrix:
        return _times(self.D, self.base.multiply(_times(self.D, x)))

    def solve(self, b: Matrix) -> Matrix:
        """(DKD)⁻¹b = D⁻¹K⁻¹D⁻¹b."""
        return _times(1 / self.D, self.base.solve(_times(1 / self.D, b)))

    def absolute_sums(self, D: Vector) -> Vector:
        return self.D * self.base.absolute_sums(self.D * D)

    def least_eigenvalues(self, D: Vector, steps: int = POWER_STEPS) -> list[float]:
        return self.base.least_eigenvalues(self.D * D, steps)

    def panels(self) -> Iterator[tuple[slice, slice, Any]]:
        for rows, columns, panel in self.base.panels():
            yield rows, columns, sp.diags_array(self.D[rows]) @ panel @ sp.diags_array(self.D[columns])


def _times(D: Vector, x: Matrix) -> Matrix:
    return (D * x.T).T


def _least_eigenvalue(solve: Callable[[Vector], Vector], D: Vector, steps: int) -> float:
    """An estimate of λmin(DKD), no smaller, by the power method on its inverse. solve : b → K⁻¹b."""
    v = np.random.default_rng(0).standard_normal(len(D))
    largest = 0.0
    for _ in range(steps):
        v = v / abs(v).max()  # whose square does not overflow
        v = v / np.linalg.norm(v)
        w = solve(v / D) / D
        largest, v = float(v @ w), w
    return 1 / largest if largest > 0 else 0.0
