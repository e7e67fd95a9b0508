"""An assembly with sparse blocks: K⁻¹ by sparse factors, Q by its products. Nothing dense is made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from .assembly import Assembly, Matrix, Vector
from .balance import balanced_units, least_eigenvalue
from .banded_inverse import BandedInverse, Windows, of_windows
from .compliance import Compliance
from .near_compliance import NearCompliance, near_compliance
from .near_inverse import Rows
from .prepared import MIB, Prepared
from .sparse_factor import BandFactor, Factor, GeneralFactor, NotPositiveDefinite, Renumbered, factored
from .whole_compliance import whole_compliance

SAMPLE = 3  # contacts, for the size of Q
FEW = 3000  # contacts for which Q is small beside K
SETS = 15  # factorisations of K that settle the contacts without M
SINGLE_BITS = 18  # of cond(Q_WW): more are lost in float32


@dataclass(frozen=True)
class ApproximateInverse:
    """M ≈ Q⁻¹. diagonal : about that of Q, (m,) mm/N."""

    M: BandedInverse
    diagonal: Vector


class SparsePrepared(Prepared):
    """K's blocks are sparse; each is factored when K⁻¹ is first needed.

    coarser : makes an assembly of similar Q whose factors are cheaper; None if there is none.

    `sparse_factors` raises NotPositiveDefinite, with the number of an unknown that moves.
    """

    def __init__(
        self,
        assembly: Assembly,
        seconds: dict[str, float] | None = None,
        coarser: Callable[[], Assembly] | None = None,
    ) -> None:
        super().__init__(assembly)
        self.seconds = seconds or {}
        self.coarser = coarser

    @property
    def facts(self) -> dict[str, object]:
        assembly = self.assembly
        size = {"n": assembly.asked, "m": assembly.m, "parts": assembly.parts, "unknowns": assembly.n}
        return size | {"seconds": self.seconds}

    @property
    def stored_mib(self) -> dict[str, float]:
        """MiB of K as a sparse matrix, and of its factors if they were made."""
        blocks = map(sp.csc_array, self.assembly.blocks)
        sizes = {"K": sum(K.data.nbytes + K.indices.nbytes + K.indptr.nbytes for K in blocks) / MIB}
        if "sparse_factors" in vars(self):
            sizes["factors"] = 8 * sum(factor.numbers for factor in self.sparse_factors) / MIB
        return sizes

    @cached_property
    def condition(self) -> float:
        """About the condition number of K in balanced units, whose largest eigenvalue is at most ‖DKD‖_∞."""
        D = balanced_units(self.assembly)
        least, largest = np.inf, 0.0
        for K, rows, factor in zip(
            self.assembly.blocks, self.assembly.slices, self.sparse_factors, strict=True
        ):
            d = D[rows]
            least = min(least, least_eigenvalue(factor.solve, d))
            largest = max(largest, float((abs(K) @ d * d).max()))
        return largest / least if least > 0 else np.inf

    @cached_property
    def sparse_factors(self) -> tuple[Factor, ...]:
        found = []
        for K, rows in zip(self.assembly.blocks, self.assembly.slices, strict=True):
            try:
                nodes = None if self.assembly.nodes is None else self.assembly.nodes[rows]
                found.append(factored(sp.csc_array(K), nodes))
            except NotPositiveDefinite as error:
                raise NotPositiveDefinite(rows.start + error.unknown) from error
        return tuple(found)

    def solve_K(self, b: Matrix) -> Matrix:
        pairs = zip(self.sparse_factors, self.assembly.slices, strict=True)
        return np.concatenate([factor.solve(b[rows]) for factor, rows in pairs])

    @property
    def compliance(self) -> Compliance:
        return Compliance(self.solve_K, self.assembly.A)

    def with_contacts(self, A: sp.csc_array) -> SparsePrepared:
        """The same K, whose factors are shared, with other contacts A (n, m') on the same unknowns."""
        base = self

        class WithContacts(SparsePrepared):
            @cached_property
            def sparse_factors(self) -> tuple[Factor, ...]:
                return base.sparse_factors

        return WithContacts(replace(self.assembly, A=A))

    def near_compliance(self, windows: Sequence[Rows], single: bool = True) -> NearCompliance | None:
        """Q_WW of windows of contacts to four digits, for a preconditioner; None without band factors."""
        like = SparsePrepared(self.coarser()) if self.coarser else self
        bands = [each for each in like.sparse_factors if isinstance(each, BandFactor | Renumbered)]
        if len(bands) < len(like.sparse_factors):
            return None
        return near_compliance(like.assembly, bands, windows, single)

    @cached_property
    def approximate_inverse(self) -> ApproximateInverse | None:
        """M ≈ Q⁻¹ with a narrow band, and about the diagonal of Q; None where K has no band.

        In single precision; in double where some Q_WW is not positive definite in that. Of few contacts
        without coordinates M = Q⁻¹. Also None of contacts all over an area, where M takes longer than some
        factorisations of K.
        """
        if self.assembly.contact_nodes is None and self.assembly.m <= FEW:
            return self._exact_inverse()
        windows = self._windows()
        if self.assembly.m > FEW and windows.work > SETS * self._work():
            return None
        for single in (True, False) if self._single_might_do() else (False,):
            near = self.near_compliance(windows.contacts(), single)
            if near is None:
                return None
            diagonal = np.empty(self.assembly.m)
            for _, start, stop in windows.ranges():
                line = windows.order[start:stop]
                diagonal[line] = np.diag(near.submatrix(line))
            with suppress(np.linalg.LinAlgError):
                return ApproximateInverse(of_windows(windows, near.submatrix), diagonal)
        return None

    def _exact_inverse(self) -> ApproximateInverse | None:
        pairs = zip(self.sparse_factors, self.assembly.slices, strict=True)
        Q = sum(whole_compliance(factor, sp.csc_array(self.assembly.A[rows])) for factor, rows in pairs)
        assert isinstance(Q, np.ndarray)
        diagonal = np.array(Q.diagonal())
        m = self.assembly.m
        with suppress(np.linalg.LinAlgError):
            return ApproximateInverse(of_windows(Windows(np.arange(m), m), lambda _: Q), diagonal)
        return None

    def _work(self) -> float:
        """Operations of a factorisation of K: about the entries of each column of a factor, squared."""
        pairs = zip(self.sparse_factors, self.assembly.slices, strict=True)
        return sum(factor.numbers**2 / (rows.stop - rows.start) for factor, rows in pairs)

    def _single_might_do(self) -> bool:
        """Whether float32 can tell λmin(Q_WW), no less than about 1/K_ii, from zero beside q_ii."""
        A, some = self.assembly.A, np.linspace(0, max(self.assembly.m - 1, 0), SAMPLE).astype(int)
        columns = A[:, some]
        q = columns.T @ self.solve_K(columns.sum(axis=1))  # far from each other, so about their q_ii
        stiffest = self.assembly.diagonal_K()[columns.indices].max(initial=0.0)
        return bool(q.max(initial=0.0) * stiffest < 2.0**SINGLE_BITS)

    def _windows(self) -> Windows:
        """Along the joint; without coordinates along the bands, a line of contacts per half-bandwidth."""
        assembly = self.assembly
        if assembly.contact_nodes is not None:
            return Windows.of(assembly.contact_nodes, assembly.m)
        places, widest = np.arange(assembly.n), 1
        for factor, rows in zip(self.sparse_factors, assembly.slices, strict=True):
            if isinstance(factor, Renumbered):
                places[rows.start + factor.order] = np.arange(rows.start, rows.stop)
            if not isinstance(factor, GeneralFactor):
                widest = max(widest, factor.numbers // (rows.stop - rows.start))
        first = places[assembly.A.indices[assembly.A.indptr[:-1]]]
        return Windows(np.argsort(first, kind="stable"), max(1, assembly.m * widest // assembly.n))

    @cached_property
    def Q(self) -> Matrix:
        """As a dense matrix, (m, m), by m solutions with K; no code of the sparse form asks for it."""
        return self.compliance.toarray()

    @cached_property
    def factors(self) -> Any:
        raise TypeError("an assembly with sparse blocks has no dense factors")
