"""Cholesky factors of K, its extreme eigenvalues, and Q = AᵀK⁻¹A."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, eigsh

from .assembly import Assembly, Matrix, Vector

SMALL = 50  # unknowns below which eigenvalues are computed densely


def factor(K: Matrix) -> Matrix:
    """U, upper triangular, with K = UᵀU. Raises LinAlgError if K is not positive definite."""
    return sla.cholesky(K, check_finite=False)


def extreme_eigenvalues(K: Matrix, U: Matrix) -> tuple[float, float]:
    """λmin and λmax of K by Lanczos on K⁻¹ and K (densely if K is small)."""
    n = len(K)
    if n < SMALL:
        values = np.linalg.eigvalsh(K)
        return float(values[0]), float(values[-1])

    def solve(b: Vector) -> Vector:
        return sla.cho_solve((U, False), b, check_finite=False)

    v0 = np.random.default_rng(0).standard_normal(n)
    inverse = LinearOperator((n, n), matvec=solve, dtype=float)
    largest, smallest_inverse = (
        eigsh(op, 1, which="LA", v0=v0, tol=1e-6, return_eigenvectors=False)[0] for op in (K, inverse)
    )
    return float(1 / smallest_inverse), float(largest)


def schur(assembly: Assembly, factors: tuple[Matrix, ...]) -> Matrix:
    """Q = Σ A_iᵀ K_i⁻¹ A_i with K_i⁻¹ from its Cholesky factor, (m, m), mm/N."""
    Q = np.zeros((assembly.m, assembly.m))
    if assembly.m == 0:
        return Q
    for U, rows in zip(factors, assembly.slices, strict=True):
        inverse, info = lapack.dpotri(U)
        if info != 0:
            raise np.linalg.LinAlgError(f"dpotri returned {info}")
        inverse = np.triu(inverse) + np.triu(inverse, 1).T
        A = assembly.A[rows]
        Q += A.T @ (A.T @ inverse).T
    return np.asfortranarray((Q + Q.T) / 2)
