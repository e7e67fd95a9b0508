"""The common part of the adapters: a quadratic program in a library's format, settings, the answer.

Every form is min ½zᵀPz + qᵀz with either rows Gz ≤ h or bounds z ≥ 0 (see problems.forms), so an adapter does
not depend on it; it only tells sparse blocks of P from dense ones. Relative tolerances are 0 if a library has
them separately, and the absolute ones are the requested tolerance, in the library's own units: N for
Kx − f + Aλ, mm for Aᵀx − g and Qλ − p; N·mm for the duality gap (`gap_tolerance`).
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from problems.forms.assembly import LoadCase, Matrix, Vector

from .base import FORMS, Answer, Form, Problem, Solver, WarmStart
from .options import library_settings, one_of, require

GAP_ROUNDING = 1e-13  # PIQP comes down to 3e-14 on some scenes, and waits for 1.5e-14 in vain on others


@dataclass(frozen=True)
class Converted:
    """P and G in a library's format; G is None if z ≥ 0 are passed as the library's bounds."""

    problem: Problem
    P: Any
    G: Any = None

    def vectors(self, load: LoadCase) -> tuple[Vector, Vector | None]:
        """q and h; h is None if bounds replace it."""
        return self.problem.q(load), self.problem.h(load)

    def start(self, start: WarmStart) -> tuple[Vector | None, Vector]:
        """(z, multipliers) from which to solve."""
        return self.problem.start(start.lam, start.gap, start.x)

    def answer(self, report: Answer, z: Vector, multipliers: Vector | None, tolerance: float) -> Answer:
        """The library's report with λ and x from its solution z and the multipliers of its rows, if any."""
        lam, x = self.problem.answer(z, multipliers)
        return clipped(replace(report, lam=lam, x=x), tolerance)


class Library(Solver):
    """Base of the adapters that hand on a library's own settings.

    choices : the adapter's own options, each with its values, the default first. selected : their values.
    settings : the library's settings that the user changed.
    """

    forms: tuple[Form, ...] = FORMS
    choices: ClassVar[dict[str, tuple[Any, ...]]]

    def __init__(self, **options: object) -> None:
        name = type(self).__name__.lower()
        self.selected: dict[str, Any] = {k: options.pop(k, values[0]) for k, values in self.choices.items()}
        require(name, self.selected, **{k: one_of(self.selected[k], v) for k, v in self.choices.items()})
        self.settings = library_settings(name, options, self.defaults())

    @abstractmethod
    def defaults(self) -> Any:
        """The library's settings, at their defaults."""


def converted(problem: Problem, sparse: bool) -> Converted:
    """The upper triangle of P and G in CSC, or both dense."""
    G = problem.G
    if sparse:
        return Converted(problem, upper_triangle(problem.blocks), None if G is None else sp.csc_matrix(G))
    return Converted(problem, dense(problem.blocks), None if G is None else G.toarray(order="F"))


def set_absolute(settings: Any, tolerance: float, load: LoadCase) -> None:
    """Set absolute tests only, the duality gap's included; PIQP and ProxQP name them alike."""
    settings.eps_abs = tolerance
    settings.eps_duality_gap_abs = gap_tolerance(tolerance, load)
    settings.eps_rel = settings.eps_duality_gap_rel = 0.0
    settings.check_duality_gap = settings.compute_timings = True


def gap_tolerance(tolerance: float, load: LoadCase) -> float:
    """The tolerance of the duality gap, which bounds the error ½(x − x*)ᵀK(x − x*).

    As many N·mm as the tolerance has mm, but at most the tolerance in scaled units, and above rounding.
    """
    return min(tolerance, max(tolerance * load.length / load.energy, GAP_ROUNDING))


def clipped(answer: Answer, tolerance: float) -> Answer:
    """A copy of the answer with λ in [−tolerance, 0), which the library's own test allows, set to 0.

    Larger negative values are kept, and the judge sees them. Without λ, or with values that are not finite,
    the answer is a failed one.
    """
    lam, x = (None if v is None else np.array(v, dtype=float) for v in (answer.lam, answer.x))
    if lam is None or not np.isfinite(lam).all() or (x is not None and not np.isfinite(x).all()):
        return replace(answer, status="failed", lam=None, x=None)
    lam[(lam < 0) & (lam >= -tolerance)] = 0.0
    return replace(answer, lam=lam, x=x)


def rows_for_bounds(problem: Problem, sign: float) -> sp.csc_matrix:
    """G, or ±I if a library takes the bounds z ≥ 0 as rows, CSC."""
    if problem.G is not None:
        return sp.csc_matrix(problem.G)
    return sp.csc_matrix(sign * sp.eye(sum(block.shape[0] for block in problem.blocks)))


def upper_triangle(blocks: Sequence[Matrix]) -> sp.csc_matrix:
    """Upper triangle of blockdiag(blocks), CSC with 32-bit indices, sorted.

    The blocks are symmetric, so the columns of the upper triangle of a dense one are the rows of the lower
    one, which lie contiguous in memory.
    """
    if is_sparse(blocks):
        return sorted_csc(sp.block_diag([sp.triu(block) for block in blocks]))
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


def is_sparse(blocks: Sequence[Matrix]) -> bool:
    """Whether the blocks are SciPy's sparse arrays, as in the sparse form."""
    return sp.issparse(blocks[0])


def sorted_csc(M: Any) -> sp.csc_matrix:
    """CSC with 32-bit indices, each column's rows in order."""
    csc = sp.csc_matrix(M)
    csc.sort_indices()
    indices, indptr = csc.indices.astype(np.int32), csc.indptr.astype(np.int32)
    return sp.csc_matrix((csc.data, indices, indptr), shape=csc.shape)


def dense(blocks: Sequence[Matrix]) -> Matrix:
    """blockdiag(blocks) of dense blocks in Fortran order. No copy of a single C-ordered block."""
    whole = blocks[0] if len(blocks) == 1 else sla.block_diag(*blocks)
    return whole.T  # symmetric
