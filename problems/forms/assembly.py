"""The data of a riveting QP: what load cases share, and what one of them adds.

    min ½ xᵀK x − fᵀx   subject to   Aᵀx ≤ g                         (primal)
    min ½ λᵀQ λ − pᵀλ   subject to   λ ≥ 0                           (dual)

with Q = AᵀK⁻¹A, p = AᵀK⁻¹f − g and x = K⁻¹(f − Aλ). Units: mm and N.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Assembly:
    """Stiffness and contacts of the joined parts, shared by many load cases.

    Parameters
    ----------
    blocks : K_1 … K_p, each (n_i, n_i), N/mm, symmetric positive definite, dense.
        K = blockdiag(K_1, …, K_p), n = Σ n_i.
    A : (n, m) sparse. Column j is the normal of contact j: +1 and −1 for two parts,
        a single 1 for a part against a rigid tool.
    nodes : (n, 2) coordinates of the unknowns in mm, or None where they are unknown.
    parts : a name for each block.
    """

    blocks: tuple[Matrix, ...]
    A: sp.csc_array
    nodes: Matrix | None = None
    parts: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        return int(self.A.shape[0])

    @property
    def m(self) -> int:
        return int(self.A.shape[1])

    @property
    def slices(self) -> list[slice]:
        """The unknowns of each block."""
        ends = np.cumsum([0, *(K.shape[0] for K in self.blocks)])
        return [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]

    @property
    def contact_nodes(self) -> Matrix | None:
        """(m, 2) coordinates of the contacts in mm: those of the first unknown of each."""
        if self.nodes is None:
            return None
        return self.nodes[self.A.indices[self.A.indptr[:-1]]]

    def multiply_K(self, x: Matrix) -> Matrix:
        """K x, block by block."""
        return np.concatenate([K @ x[s] for K, s in zip(self.blocks, self.slices, strict=True)])


@dataclass(frozen=True)
class LoadCase:
    """f : (n,) nodal forces, N. g : (m,) initial gaps, mm."""

    f: Vector
    g: Vector


@dataclass(frozen=True)
class Prepared:
    """The data preparation of the paper: done once for an assembly, used by every load case.

    Parameters
    ----------
    assembly : K and A.
    factors : U_i upper triangular with K_i = U_iᵀU_i, each (n_i, n_i).
    Q : (m, m), mm/N, Q = AᵀK⁻¹A.
    facts : measured while it was built (cond_K, seconds of each step, …).
    """

    assembly: Assembly
    factors: tuple[Matrix, ...]
    Q: Matrix
    facts: dict[str, object] = field(default_factory=dict)

    def solve_K(self, b: Matrix) -> Matrix:
        """K⁻¹ b through the Cholesky factors."""
        return np.concatenate(
            [
                sla.cho_solve((U, False), b[s], check_finite=False)
                for U, s in zip(self.factors, self.assembly.slices, strict=True)
            ]
        )

    def dual_load(self, load: LoadCase) -> Vector:
        """p = AᵀK⁻¹f − g, (m,), mm: the overlap of the parts when contact is ignored."""
        return self.assembly.A.T @ self.solve_K(load.f) - load.g

    def recover(self, lam: Vector, load: LoadCase) -> Vector:
        """x = K⁻¹(f − Aλ), with one step of iterative refinement."""
        b = load.f - self.assembly.A @ lam
        x = self.solve_K(b)
        return x + self.solve_K(b - self.assembly.multiply_K(x))
