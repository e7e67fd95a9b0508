"""The compliance Q = AᵀK⁻¹A, (m, m) mm/N, as a matrix or as products by solutions with K; and M ≈ Q⁻¹ with a
narrow band, from Q itself or from local blocks of it.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from problems.stiffness import power_of_two
from problems.stiffness.banded_block import BandedBlock
from problems.stiffness.dense_block import product
from problems.stiffness.operator import Stiffness

from .assembly import Assembly, Indices, Matrix, Vector
from .banded_inverse import WINDOW_LINES, BandedInverse, Windows, banded_inverse, of_windows


@dataclass(frozen=True)
class ComplianceProducts:
    """Q for a sparse K: products by solutions with K."""

    K: Stiffness
    A: sp.csc_array

    def __matmul__(self, lam: Matrix) -> Matrix:
        """Q λ, λ (m,) or (m, k)."""
        product: Matrix = self.At @ self.K.solve(self.A @ lam)
        return product

    @cached_property
    def At(self) -> sp.csr_array:
        """Aᵀ; SciPy would make it anew for each product."""
        return sp.csr_array(self.A.T)


@dataclass(frozen=True)
class DenseCompliance:
    """Q as a matrix, by columns, perhaps memory-mapped."""

    Q: Matrix

    def __matmul__(self, lam: Matrix) -> Matrix:
        return product(self.Q, lam)


@dataclass
class CountedProducts:
    """Products with Q, and how many were made."""

    Q: ComplianceProducts | DenseCompliance
    made: int = 0

    def __matmul__(self, lam: Vector) -> Vector:
        self.made += 1
        return self.Q @ lam


Compliance = ComplianceProducts | DenseCompliance | CountedProducts

SAMPLE = 3  # contacts, for the size of Q
SETS = 15  # factorisations of K that settle the contacts without M
WIDEST_WINDOW = 1 / 4  # of the contacts: M with wider ones costs as much as Q⁻¹
STEPS, CONTRACTION = 3, 0.5  # of e ← e − MQe from a random e, and what the last one must achieve
SINGLE_BITS = 18  # of cond(Q_WW): more are lost in float32


@dataclass(frozen=True)
class ApproximateInverse:
    """M ≈ Q⁻¹, or None where it would cost too much; diagonal : estimates of q_jj, (m,) mm/N."""

    M: BandedInverse | None
    diagonal: Vector

    def scaled(self, R: Vector) -> "ApproximateInverse":
        """The approximate inverse of RQR, R (m,)."""
        M = None if self.M is None else self.M.scaled(1 / R[self.M.order])
        return ApproximateInverse(M, self.diagonal * R**2)


def of_dense(Q: DenseCompliance, nodes: Matrix | None) -> ApproximateInverse:
    """M from Q itself, if e ← e − MQe converges fast with a narrow band.

    nodes : (m, 2) coordinates of the contacts, mm. Raises LinAlgError if Q is not positive definite.
    """
    diagonal, m = np.diag(Q.Q).copy(), len(Q.Q)
    windows = Windows.of(nodes, m)
    if (WINDOW_LINES + 1) * windows.across <= WIDEST_WINDOW * m:
        M = banded_inverse(Q.Q, windows)
        if _contracts(M, Q):
            return ApproximateInverse(M, diagonal)
    return ApproximateInverse(None, diagonal)


def of_products(assembly: Assembly, like: Assembly) -> ApproximateInverse:
    """M from local blocks of the Q of `like`, which has the same contacts: in single precision, or in double
    where some block is not positive definite in that.

    There is no M where contacts depend on one another, where K has no band, where e ← e − MQe converges
    slowly, and for contacts all over an area, where M and its factors take longer than those of K; the
    diagonal then is Σ_i a_ij²/k_ii. Raises LinAlgError if Q is indefinite.
    """
    lengths = abs(assembly.A).max(axis=0).toarray()
    R = 1 / power_of_two(np.where(lengths, lengths, 1.0))  # in other units of the contacts, the same M
    assembly, like = (replace(one, A=sp.csc_array(one.A * R)) for one in (assembly, like))
    return _of_unit_contacts(assembly, like).scaled(1 / R)


def _of_unit_contacts(assembly: Assembly, like: Assembly) -> ApproximateInverse:
    windows, inverse = _along_bands(assembly), None
    of_K = SETS * assembly.K.factorisation_flops
    worth = windows is not None and windows.work + SETS * windows.factorisation_flops <= of_K
    if windows is not None and worth and not assembly.dependent:
        if _single_might_do(assembly):
            with suppress(np.linalg.LinAlgError):
                inverse = _from_windows(like, windows, single=True)
        inverse = inverse or _from_windows(like, windows, single=False)
    if inverse and inverse.M and _contracts(inverse.M, ComplianceProducts(assembly.K, assembly.A)):
        return inverse
    return ApproximateInverse(None, assembly.A.power(2).T @ (1 / assembly.K.diagonal))


def _contracts(M: BandedInverse, Q: Compliance) -> bool:
    """Whether e ← e − MQe converges fast."""
    e, sizes = np.random.default_rng(0).standard_normal(len(M.order)), []
    for _ in range(STEPS):
        e[M.order] -= M.product((Q @ e)[M.order])
        sizes.append(float(np.linalg.norm(e)))
    return sizes[-1] <= CONTRACTION * sizes[-2]


def _from_windows(like: Assembly, windows: Windows, single: bool) -> ApproximateInverse | None:
    local = like.K.local_compliance(like.A, windows.contacts(), single)
    if local is None:
        return None
    diagonal = np.empty(len(windows.order))

    def noted(window: Indices) -> Matrix:
        Q_WW = local(window)
        diagonal[window] = np.diag(Q_WW)
        return Q_WW

    return ApproximateInverse(of_windows(windows, noted), diagonal)


def _single_might_do(assembly: Assembly) -> bool:
    """Whether float32 can tell λmin(Q_WW) from zero beside q_ii; it is no less than about 1/K_ii."""
    A, some = assembly.A, np.linspace(0, max(assembly.m - 1, 0), SAMPLE).astype(int)
    columns = A[:, some]
    q = columns.T @ assembly.K.solve(columns.sum(axis=1))  # far from each other, so about their q_ii
    stiffest = assembly.K.diagonal[columns.indices].max(initial=0.0)
    return bool(q.max(initial=0.0) * stiffest < 2.0**SINGLE_BITS)


def _along_bands(assembly: Assembly) -> Windows | None:
    """Windows along the joint; without coordinates along the bands, a line of contacts per half-bandwidth, or
    None if a contact couples unknowns of one block that are farther apart than a window.
    """
    if assembly.contact_nodes is not None:
        return Windows.of(assembly.contact_nodes, assembly.m)
    places, widest = np.arange(assembly.n), 1
    for block, rows in zip(assembly.K.blocks, assembly.K.slices, strict=True):
        if isinstance(block, BandedBlock):
            widest = max(widest, block.width + 1)
            if block.order is not None:
                places[rows.start + block.order] = np.arange(rows.start, rows.stop)
    A, ends = assembly.A, [rows.stop for rows in assembly.K.slices]
    of_contacts, contacts = places[A.indices], np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
    in_block = len(ends) * contacts + np.searchsorted(ends, A.indices, side="right")
    begins = np.flatnonzero(np.diff(in_block, prepend=-1))
    spread = np.maximum.reduceat(of_contacts, begins) - np.minimum.reduceat(of_contacts, begins)
    first = np.minimum.reduceat(of_contacts, A.indptr[:-1])
    if spread.max(initial=0) > WINDOW_LINES * widest:
        return None
    return Windows(np.argsort(first, kind="stable"), max(1, assembly.m * widest // assembly.n))
