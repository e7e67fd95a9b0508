"""Cached data preparation: factors of K, then Q, each computed when first needed."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np

from problems.errors import InputError
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from . import factorisation
from .assembly import Assembly, Matrix
from .prepared import Prepared
from .problem import Progress

LARGEST_CONDITION = 1e14  # beyond it no digit of a displacement can be proven


class Stored(Prepared):
    """A prepared assembly whose stages are memory-mapped from the cache, or computed and stored there.

    Parameters
    ----------
    assembly : K and A. key : of K in the cache.
    seconds : of the stages before.
    source_of : the origin of "K", for error messages.

    `factors` raises InputError if K is not positive definite or its condition number exceeds 1e14.
    """

    def __init__(
        self,
        assembly: Assembly,
        key: str,
        seconds: dict[str, float],
        source_of: Callable[[str], object],
        progress: Progress,
    ) -> None:
        super().__init__(assembly)
        A, code = assembly.A, fingerprint([Path(__file__), Path(factorisation.__file__)])
        self.factors_key = cache.digest("factors", key, code)
        parts = (A.data, A.indices, A.indptr)
        self.Q_key = cache.digest("Q", self.factors_key, [*A.shape], *(part.tobytes() for part in parts))
        self.seconds = seconds
        self.source_of, self.progress = source_of, progress

    @cached_property
    def key(self) -> str:
        return self.Q_key

    @property
    def built(self) -> bool:
        """Whether every stage is in the cache."""
        return None not in (cache.load(self.factors_key), cache.load(self.Q_key))

    @property
    def facts(self) -> dict[str, object]:
        known = self._factored[1]
        Q = self._Q if "_Q" in vars(self) else cache.load(self.Q_key)
        of_Q = {"Q": Q[1]["seconds"]} if Q else {}
        seconds = self.seconds | known["seconds"] | of_Q
        size = {"n": self.assembly.n, "m": self.assembly.m, "parts": self.assembly.parts}
        return size | known | {"seconds": seconds}

    @cached_property
    def factors(self) -> tuple[Matrix, ...]:
        arrays, _ = self._factored
        return tuple(arrays[f"U{k}"] for k in range(len(self.assembly.blocks)))

    @cached_property
    def Q(self) -> Matrix:
        return self._Q[0]["Q"]

    @cached_property
    def _factored(self) -> cache.Entry:
        return cache.load_or_make(self.factors_key, self._factor)

    @cached_property
    def _Q(self) -> cache.Entry:
        return cache.load_or_make(self.Q_key, self._schur)

    def _factor(self) -> cache.Entry:
        blocks = self.assembly.blocks
        self.progress("Cholesky factors of K", 0.0)
        start = time.perf_counter()
        factors = []
        for K, name in zip(blocks, self.assembly.parts, strict=True):
            try:
                factors.append(factorisation.factor(K))
            except np.linalg.LinAlgError as error:
                raise indefinite(self.source_of("K"), f"K of {name}", str(error)) from error
        factored = time.perf_counter()
        self.progress("condition number", 0.0)
        spectrum = [factorisation.extreme_eigenvalues(K, U) for K, U in zip(blocks, factors, strict=True)]
        least, largest = min(s[0] for s in spectrum), max(s[1] for s in spectrum)
        if largest > LARGEST_CONDITION * least:
            raise indefinite(self.source_of("K"), "cond(K)", largest / least if least > 0 else np.inf)
        facts = {
            "cond_K": largest / least,
            "lambda_min": least,
            "lambda_max": largest,
            "cond_blocks": [s[1] / s[0] for s in spectrum],
            "seconds": {"cholesky": factored - start, "condition": time.perf_counter() - factored},
        }
        return {f"U{k}": U for k, U in enumerate(factors)}, facts

    def _schur(self) -> cache.Entry:
        factors = self.factors
        self.progress("Q = AᵀK⁻¹A", 0.0)
        start = time.perf_counter()
        Q = factorisation.schur(self.assembly, factors)
        return {"Q": Q}, {"seconds": time.perf_counter() - start}


def indefinite(where: object, key: str, value: object) -> InputError:
    """The error for a K that is not positive definite."""
    allowed = "K must be positive definite: is a part held against every rigid motion?"
    return InputError.one(where, key, value, allowed)
