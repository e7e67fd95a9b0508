"""What the adapters of the libraries share: matrices in a library's format, options, the answer.

Every adapter states a form as min ½zᵀPz + qᵀz with rows ≤ bounds (primal: P = K, q = −f, rows Aᵀ ≤ g)
or z ≥ 0 (dual: P = Q, q = −p). Relative tolerances are 0 where a library has them apart, and the absolute
ones are the tolerance asked for, in the library's own units: N for Kx − f + Aλ, mm for Aᵀx − g and Qλ − p,
N·mm for the duality gap.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector
from solvers.base import Answer, Form, Load, Problem, Status


@dataclass(frozen=True)
class Converted:
    """P and the rows of the constraints in a library's format; rows is None where z ≥ 0 are bounds."""

    form: Form
    P: Any
    rows: Any = None

    def q(self, load: Load) -> Vector:
        """The linear term: −f in N (primal) or −p in mm (dual)."""
        return -load.f if self.form == "primal" else -load.p


def blocks_of(problem: Problem) -> tuple[Matrix, ...]:
    """The diagonal blocks of P: K_1 … K_p (primal) or Q alone (dual)."""
    return problem.assembly.blocks if problem.form == "primal" else (problem.Q,)


def upper_triangle(blocks: Sequence[Matrix]) -> sp.csc_matrix:
    """Upper triangle of blockdiag(blocks), CSC with 32-bit indices, sorted.

    The blocks are symmetric, so the columns of the upper triangle are the rows of the lower one,
    which lie contiguous in memory.
    """
    data, indices, counts, offset = [], [], [], 0
    for block in blocks:
        size = len(block)
        lower = np.tri(size, dtype=bool)
        data.append(block[lower])
        columns = np.arange(offset, offset + size, dtype=np.int32)
        indices.append(np.broadcast_to(columns, (size, size))[lower])
        counts.append(np.arange(1, size + 1))
        offset += size
    indptr = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int32)
    return sp.csc_matrix((np.concatenate(data), np.concatenate(indices), indptr), shape=(offset, offset))


def dense(blocks: Sequence[Matrix]) -> Matrix:
    """blockdiag(blocks) as a dense array in Fortran order. No copy of a single C-ordered block."""
    whole = blocks[0] if len(blocks) == 1 else sla.block_diag(*blocks)
    return whole.T  # symmetric


def choice(solver: str, key: str, value: object, allowed: Collection[Any]) -> None:
    """Raise InputError unless `value` is one of `allowed`, of the same type (1 is not True)."""
    if not any(type(value) is type(good) and value == good for good in allowed):
        listed = ", ".join(map(repr, allowed))
        raise InputError.one(f"solver {solver}", f"options.{key}", value, f"must be one of {listed}")


def answer(status: Status, tolerance: float, lam: Vector, x: Vector | None = None, **facts: Any) -> Answer:
    """An Answer with λ in [−tolerance, 0) put to 0, which the library's own test allows.

    A larger negative stays for the judge to see. With values that are not finite there is no answer.
    """
    lam = np.array(lam, dtype=float)
    if not np.isfinite(lam).all() or (x is not None and not np.isfinite(x).all()):
        return Answer("failed", None, **facts)
    lam[(lam < 0) & (lam >= -tolerance)] = 0.0
    return Answer(status, lam, None if x is None else np.array(x, dtype=float), **facts)
