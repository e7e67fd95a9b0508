"""M ≈ Q⁻¹ with a narrow band, for dense and sparse K alike: from Q itself, or from local blocks of it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from problems.stiffness.banded import BandedBlock

from .assembly import Assembly, Vector
from .banded_inverse import BandedInverse, Windows, of_windows
from .compliance import Compliance, DenseCompliance

SAMPLE = 3  # contacts, for the size of Q
FEW = 3000  # contacts for which Q is small beside K
SETS = 15  # factorisations of K that settle the contacts without M
SINGLE_BITS = 18  # of cond(Q_WW): more are lost in float32


@dataclass(frozen=True)
class ApproximateInverse:
    """M ≈ Q⁻¹. diagonal : about that of Q, (m,) mm/N."""

    M: BandedInverse
    diagonal: Vector


def of_dense(Q: DenseCompliance, nodes: Vector | None) -> ApproximateInverse | None:
    """From Q itself; None if it is not positive definite. nodes : (m, 2) of the contacts, mm, or None."""
    return _from_windows(Q, Windows.of(nodes, len(Q.Q)), single=False)


def of_products(assembly: Assembly, Q: Compliance, like: Compliance) -> ApproximateInverse | None:
    """From local blocks of `like`, a Q of the same contacts: in single precision, in double where some block
    is not positive definite in that. Of few contacts without coordinates M = Q⁻¹.

    None where K has no band, and of contacts all over an area, where M takes longer than some factorisations
    of K.
    """
    m = assembly.m
    if assembly.contact_nodes is None and m <= FEW:
        return _from_windows(DenseCompliance(Q.toarray()), Windows(np.arange(m), m), single=False)
    windows = _along_bands(assembly)
    if m > FEW and windows.work > SETS * assembly.K.work:
        return None
    for single in (True, False) if _single_might_do(assembly) else (False,):
        found = _from_windows(like, windows, single)
        if found is not None:
            return found
    return None


def _from_windows(Q: Compliance, windows: Windows, single: bool) -> ApproximateInverse | None:
    local = Q.local(windows.contacts(), single)
    if local is None:
        return None
    diagonal = np.empty(len(windows.order))
    for _, start, stop in windows.ranges():
        line = windows.order[start:stop]
        diagonal[line] = np.diag(local(line))
    with suppress(np.linalg.LinAlgError):
        return ApproximateInverse(of_windows(windows, local), diagonal)
    return None


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
        if isinstance(block, BandedBlock):
            widest = max(widest, block.width + 1)
            if block.order is not None:
                places[rows.start + block.order] = np.arange(rows.start, rows.stop)
    first = places[assembly.A.indices[assembly.A.indptr[:-1]]]
    return Windows(np.argsort(first, kind="stable"), max(1, assembly.m * widest // assembly.n))
