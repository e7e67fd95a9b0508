"""Q = AᵀK⁻¹A, (m, m) mm/N, as a matrix, or by solutions with K: products and principal submatrices; and M ≈
Q⁻¹ with a narrow band, for dense and sparse K alike: from Q itself, or from local blocks of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.stiffness.dense_block import product
from problems.stiffness.operator import Stiffness

from .assembly import Assembly, Indices, Matrix, Vector
from .banded_inverse import WINDOW_LINES, BandedInverse, Windows, of_windows

#: A window of contacts → its principal submatrix of Q, stored by columns, which may be overwritten.
Local = Callable[[Indices], Matrix]


@dataclass(frozen=True)
class ComplianceProducts:
    """By solutions with K."""

    K: Stiffness
    A: sp.csc_array

    def __matmul__(self, lam: Matrix) -> Matrix:
        """Q λ, λ (m,) or (m, k)."""
        product: Matrix = self.A.T @ self.K.solve(self.A @ lam)
        return product

    def submatrix(self, rows: Indices) -> ComplianceProducts:
        """The principal submatrix of some contacts."""
        return ComplianceProducts(self.K, self.A[:, rows])

    def toarray(self) -> Matrix:
        """The matrix, by columns."""
        return self.K.compliance(self.A)

    def local(self, windows: Sequence[Indices], single: bool) -> Local | None:
        """Principal submatrices of windows of contacts near each other, in single precision to about four
        digits; None where they cost too much.
        """
        return self.K.local_compliance(self.A, windows, single)


@dataclass(frozen=True)
class DenseCompliance:
    """Q : by columns, perhaps memory-mapped."""

    Q: Matrix

    def __matmul__(self, lam: Matrix) -> Matrix:
        return product(self.Q, lam)

    def submatrix(self, rows: Indices) -> DenseCompliance:
        return DenseCompliance(self.Q[np.ix_(rows, rows)].T)

    def toarray(self) -> Matrix:
        return self.Q

    def local(self, windows: Sequence[Indices], single: bool) -> Local:
        rows = np.asarray(self.Q).T  # no memory map, whose views cost more than their copies
        return lambda window: rows[np.ix_(window, window)].T


Compliance = ComplianceProducts | DenseCompliance


SAMPLE = 3  # contacts, for the size of Q
FEW = 3000  # contacts for which Q is small beside K
SETS = 15  # factorisations of K that settle the contacts without M
WIDEST_WINDOW = 1 / 4  # of the contacts: M with wider ones costs as much as Q⁻¹
STEPS, CONTRACTION = 3, 0.5  # of e ← e − MQe from a random e, and what the last one must achieve
SINGLE_BITS = 18  # of cond(Q_WW): more are lost in float32


@dataclass(frozen=True)
class ApproximateInverse:
    """M ≈ Q⁻¹, None where it would cost too much. diagonal : of Q, about, (m,) mm/N."""

    M: BandedInverse | None
    diagonal: Vector

    def scaled(self, R: Vector) -> ApproximateInverse:
        """That of RQR, R (m,)."""
        M = None if self.M is None else self.M.scaled(1 / R[self.M.order])
        return ApproximateInverse(M, self.diagonal * R**2)


def of_dense(Q: DenseCompliance, nodes: Vector | None) -> ApproximateInverse:
    """From Q itself: with a narrow band if e ← e − MQe converges fast, else from one window of all: Q⁻¹.

    nodes : (m, 2) of the contacts, mm, or None. Raises LinAlgError if Q is not positive definite.
    """
    diagonal, m = np.diag(Q.Q).copy(), len(Q.Q)
    windows = Windows.of(nodes, m)
    if (WINDOW_LINES + 1) * windows.across <= WIDEST_WINDOW * m:
        M = of_windows(windows, Q.local(windows.contacts(), False))
        if _contracts(M, Q):
            return ApproximateInverse(M, diagonal)
    return ApproximateInverse(
        of_windows(Windows(np.arange(m), m), lambda _: np.array(Q.Q, order="F")), diagonal
    )


def of_products(assembly: Assembly, Q: Compliance, like: Compliance) -> ApproximateInverse:
    """From local blocks of `like`, a Q of the same contacts: in single precision, in double where some block
    is not positive definite in that. Of few contacts without coordinates M = Q⁻¹.

    No M where K has no band, where M is no good, and of many contacts all over an area, where M takes longer
    than some factorisations of K; the diagonal then is Σ_i a_ij²/k_ii. Raises LinAlgError if Q is indefinite.
    """
    m, windows = assembly.m, _along_bands(assembly)
    few = m <= FEW
    if few and assembly.contact_nodes is None:
        return of_dense(DenseCompliance(Q.toarray()), None)
    found = None
    if few or windows.work <= SETS * assembly.K.factorisation_flops:
        if _single_might_do(assembly):
            with suppress(np.linalg.LinAlgError):
                found = _from_windows(like, windows, single=True)
        found = found or _from_windows(like, windows, single=False)
    if found and found.M and _contracts(found.M, Q):
        return found
    return ApproximateInverse(None, assembly.A.power(2).T @ (1 / assembly.K.diagonal))


def _contracts(M: BandedInverse, Q: Compliance) -> bool:
    """Whether e ← e − MQe converges fast."""
    e, sizes = np.random.default_rng(0).standard_normal(len(M.order)), []
    for _ in range(STEPS):
        e[M.order] -= M.product((Q @ e)[M.order])
        sizes.append(float(np.linalg.norm(e)))
    return sizes[-1] <= CONTRACTION * sizes[-2]


def _from_windows(Q: Compliance, windows: Windows, single: bool) -> ApproximateInverse | None:
    local = Q.local(windows.contacts(), single)
    if local is None:
        return None
    diagonal = np.empty(len(windows.order))
    for _, start, stop in windows.ranges():
        line = windows.order[start:stop]
        diagonal[line] = np.diag(local(line))
    return ApproximateInverse(of_windows(windows, local), diagonal)


def _single_might_do(assembly: Assembly) -> bool:
    """Whether float32 can tell λmin(Q_WW), no less than about 1/K_ii, from zero beside q_ii."""
    A, some = assembly.A, np.linspace(0, max(assembly.m - 1, 0), SAMPLE).astype(int)
    columns = A[:, some]
    q = columns.T @ assembly.K.solve(columns.sum(axis=1))  # far from each other, so about their q_ii
    stiffest = assembly.K.diagonal[columns.indices].max(initial=0.0)
    return bool(q.max(initial=0.0) * stiffest < 2.0**SINGLE_BITS)


def _along_bands(assembly: Assembly) -> Windows:
    """Along the joint; without coordinates along the bands, a line of contacts per half-bandwidth."""
    if assembly.contact_nodes is not None:
        return Windows.of(assembly.contact_nodes, assembly.m)
    places, widest = np.arange(assembly.n), 1
    for block, rows in zip(assembly.K.blocks, assembly.K.slices, strict=True):
        if block.band is not None:
            width, order = block.band
            widest = max(widest, width + 1)
            if order is not None:
                places[rows.start + order] = np.arange(rows.start, rows.stop)
    first = places[assembly.A.indices[assembly.A.indptr[:-1]]]
    return Windows(np.argsort(first, kind="stable"), max(1, assembly.m * widest // assembly.n))
