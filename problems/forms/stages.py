"""Data preparation of a scene: dense factors of K and Q from the cache, sparse factors in memory; each when
first needed, with errors that name the scene.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.linalg import lapack

from problems.errors import InputError
from problems.stiffness import dense, operator
from problems.stiffness.block import NotPositiveDefinite
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from .assembly import Assembly, Matrix
from .prepared import Stages
from .problem import Progress

LARGEST_CONDITION = 1e14  # beyond it no digit of a displacement can be proven
SMALLEST_EIGENVALUE = 1e-300  # N/mm: below it K⁻¹ overflows

SourceOf = Callable[[str], object]


class SparseStages(Stages):
    """Factors of a sparse K, in memory.

    Parameters
    ----------
    key : of K in the cache, where what is proven about it is kept. model_s : seconds in which K was made.
    source_of : the origin of "K" or "A", for error messages. own : a user's K, refused if nearly singular.
    """

    def __init__(self, key: str, model_s: float, source_of: SourceOf, own: bool) -> None:
        self.key, self.source_of, self.own = key, source_of, own
        self.model_s = model_s

    @property
    def seconds(self) -> dict[str, float]:
        return {"model": self.model_s}

    def factor(self, assembly: Assembly) -> None:
        """Raises InputError if K is not positive definite."""
        K, nodes = assembly.K, assembly.nodes
        try:
            K.factor_blocks()
        except NotPositiveDefinite as error:
            where = "" if nodes is None else " at ({:g}, {:g}) mm".format(*nodes[error.unknown])
            key, moves = f"x[{error.unknown}]{where}", "moves without a force"
            raise indefinite(self.source_of("K"), key, moves) from error
        if self.own and (condition := K.condition(K.units)) > LARGEST_CONDITION:
            raise indefinite(self.source_of("K"), "cond(K), in balanced units", condition)


class CachedStages(Stages):
    """Stages of a dense K, memory-mapped from the cache, or computed and stored there.

    Parameters
    ----------
    assembly : K and A. key : of K in the cache.
    before : seconds of the steps before.
    source_of : the origin of "K" or "A", for error messages.
    check_A : whether to raise an error if the columns of A are dependent.

    Factors raise InputError if K is not positive definite or its condition number exceeds 1e14, Q if the
    columns of A are dependent.
    """

    def __init__(
        self,
        assembly: Assembly,
        key: str,
        before: dict[str, float],
        source_of: SourceOf,
        check_A: bool,
        progress: Progress,
    ) -> None:
        self.assembly, A = assembly, assembly.A
        code = fingerprint([Path(__file__), Path(dense.__file__), Path(operator.__file__)])
        self.factors_key = cache.digest("factors", key, code)
        parts = (A.data, A.indices, A.indptr)
        self.key = cache.digest("Q", self.factors_key, [*A.shape], *(part.tobytes() for part in parts))
        self.before = before
        self.source_of, self.check_A, self.progress = source_of, check_A, progress

    @property
    def built(self) -> bool:
        """Whether every stage is in the cache."""
        return None not in (cache.load(self.factors_key), cache.load(str(self.key)))

    @property
    def facts(self) -> dict[str, object]:
        return {name: fact for name, fact in self._factored[1].items() if name != "seconds"}

    @property
    def seconds(self) -> dict[str, float]:
        Q = self._Q if "_Q" in vars(self) else cache.load(str(self.key))
        return self.before | self._factored[1]["seconds"] | ({"Q": Q[1]["seconds"]} if Q else {})

    def factor(self, assembly: Assembly) -> None:
        arrays, _ = self._factored
        for k, block in enumerate(self._blocks):
            block.U = arrays[f"U{k}"]

    def Q(self, assembly: Assembly) -> Matrix:
        return self._Q[0]["Q"]

    @property
    def _blocks(self) -> list[dense.DenseBlock]:
        return [block for block in self.assembly.K.blocks if isinstance(block, dense.DenseBlock)]

    @cached_property
    def _factored(self) -> cache.Entry:
        return cache.load_or_make(self.factors_key, self._factor)

    @cached_property
    def _Q(self) -> cache.Entry:
        return cache.load_or_make(str(self.key), self._schur)

    def _factor(self) -> cache.Entry:
        self.progress("Cholesky factors of K", 0.0)
        start = time.perf_counter()
        for block, name in zip(self._blocks, self.assembly.parts, strict=True):
            try:
                block.factor()
            except NotPositiveDefinite as error:
                raise indefinite(self.source_of("K"), f"K of {name}", str(error)) from error
        factored = time.perf_counter()
        self.progress("condition number", 0.0)
        spectrum = [block.extreme_eigenvalues() for block in self._blocks]
        least, largest = min(s[0] for s in spectrum), max(s[1] for s in spectrum)
        if largest > LARGEST_CONDITION * least:
            raise indefinite(self.source_of("K"), "cond(K)", largest / least if least > 0 else np.inf)
        if least < SMALLEST_EIGENVALUE:
            allowed = f"at least {SMALLEST_EIGENVALUE:g} N/mm: use another unit of force"
            raise InputError.one(self.source_of("K"), "smallest eigenvalue of K", least, allowed)
        facts = {
            "cond_K": largest / least,
            "lambda_min": least,
            "lambda_max": largest,
            "cond_blocks": [s[1] / s[0] for s in spectrum],
            "seconds": {"cholesky": factored - start, "condition": time.perf_counter() - factored},
        }
        return {f"U{k}": block.U for k, block in enumerate(self._blocks)}, facts

    def _schur(self) -> cache.Entry:
        self.factor(self.assembly)
        self.progress("Q = AᵀK⁻¹A", 0.0)
        start = time.perf_counter()
        Q = self.assembly.K.compliance(self.assembly.A)
        if self.check_A and self.assembly.m:
            column = dependent_column(Q)
            if column is not None:
                allowed = "must not depend on the columns before it"
                raise InputError.one(self.source_of("A"), f"A[:, {column}]", "dependent", allowed)
        return {"Q": Q}, {"seconds": time.perf_counter() - start}


def indefinite(where: object, key: str, value: object) -> InputError:
    """The error for a K that is not positive definite."""
    allowed = "K must be positive definite: is a part held against every rigid motion?"
    return InputError.one(where, key, value, allowed)


def dependent_column(Q: Matrix) -> int | None:
    """The first column of A that depends on those before it; None if A has full rank.

    The pivot of Q relative to its diagonal entry measures the independence of a column.
    """
    U, info = lapack.dpotrf(Q)
    if info:
        return int(info - 1)
    independence = np.diag(U) ** 2 / np.diag(Q)
    worst = int(independence.argmin())
    return worst if independence[worst] < len(Q) * np.finfo(float).eps else None
