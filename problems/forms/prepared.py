"""The data preparation of the paper: done once per assembly, used by every load case."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.linalg as sla
from scipy.linalg import blas

from .assembly import Assembly, LoadCase, Matrix, Vector
from .compliance import AnyQ
from .factorisation import factor, schur

MIB = 2**20
EPS = float(np.finfo(float).eps)
RESIDUAL_ROUNDING = 32  # of ε: five are usual, whatever the size


class Prepared:
    """An assembly with what is derived from it, each stage computed when first needed.

    Parameters
    ----------
    assembly : K and A.
    factors : U_i upper triangular with K_i = U_iᵀU_i, each (n_i, n_i); computed unless given.
    Q : (m, m), mm/N, Q = AᵀK⁻¹A; computed unless given.

    A subclass with another K⁻¹ (a sparse or a banded factor) overrides `solve_K` and `compliance`: judging an
    answer needs only these and products with K and A.
    """

    def __init__(
        self, assembly: Assembly, factors: tuple[Matrix, ...] | None = None, Q: Matrix | None = None
    ) -> None:
        self.assembly = assembly
        if factors is not None:
            self.__dict__["factors"] = factors  # overrides the cached property
        if Q is not None:
            self.__dict__["Q"] = Q

    @cached_property
    def key(self) -> str | None:
        """The key of the matrices in the cache; None if they are in memory only."""
        return None

    @property
    def facts(self) -> dict[str, object]:
        """Facts recorded with the stages: cond_K, λmin, λmax, seconds of each step, …"""
        return {}

    @property
    def stored_mib(self) -> dict[str, float]:
        """MiB of K, its factors and Q, made or not."""
        K = sum(block.nbytes for block in self.assembly.blocks) / MIB
        return {"K": K, "factors": K, "Q": 8 * self.assembly.m**2 / MIB}

    @property
    def opened(self) -> tuple[str, ...]:
        """K, and of the dense `factors` and `Q` those that were asked for."""
        return ("K", *(stage for stage in ("factors", "Q") if stage in vars(self)))

    @cached_property
    def factors(self) -> tuple[Matrix, ...]:
        return tuple(factor(K) for K in self.assembly.blocks)

    @cached_property
    def Q(self) -> Matrix:
        return schur(self.assembly, self.factors)

    def solve_K(self, b: Matrix) -> Matrix:
        """K⁻¹ b through the Cholesky factors."""
        return np.concatenate(
            [_solve(U, b[s]) for U, s in zip(self.factors, self.assembly.slices, strict=True)]
        )

    @property
    def compliance(self) -> AnyQ:
        """Q, as a matrix or by its products."""
        return self.Q

    def dual_load(self, load: LoadCase) -> Vector:
        """p = AᵀK⁻¹f − g, (m,), mm: the overlap of the parts if contact is ignored."""
        return self.assembly.A.T @ self.solve_K(load.f) - load.g

    def recover(self, lam: Vector, load: LoadCase) -> Vector:
        """x = K⁻¹(f − Aλ), (n,) mm, refined once if the residual r = f − Aλ − Kx is beyond rounding.

        With s_i = √k_ii, |k_ij| ≤ s_i s_j, rounding leaves max |r_i| / s_i at a few ε max s_j |x_j|.
        """
        b = load.f - self.assembly.A @ lam
        x = self.solve_K(b)
        r = b - self.assembly.multiply_K(x)
        s = np.sqrt(self.assembly.diagonal_K())
        if (abs(r.T) / s).max() <= RESIDUAL_ROUNDING * EPS * (abs(x.T) * s).max():
            return x
        return x + self.solve_K(r)


def _solve(U: Matrix, b: Matrix) -> Matrix:
    """(UᵀU)⁻¹b; for a single column without LAPACK's blocked solution, which takes twice the time."""
    if b.size > len(U):
        return sla.cho_solve((U, False), b, check_finite=False)
    return blas.dtrsv(U, blas.dtrsv(U, b.ravel(), trans=1)).reshape(b.shape)
