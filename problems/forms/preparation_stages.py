"""Data preparation of a scene: dense factors of K and Q from the cache, sparse factors in memory; each when
first needed, with errors that name the scene.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from problems import storage
from problems.errors import InputError
from problems.reporter import Reporter, Stage
from problems.stiffness import dense_block, operator
from problems.stiffness.block import Block, NotPositiveDefinite
from problems.stiffness.operator import Stiffness
from problems.storage import fingerprint

from .assembly import Assembly, Matrix
from .prepared import Prepared

LARGEST_CONDITION = 1e14  # beyond it no digit of a displacement can be proven

SourceOf = Callable[[str], object]


class SparsePrepared(Prepared):
    """Factors of a sparse K, in memory.

    Parameters
    ----------
    key : of K in the cache, where what is proven about it is kept. model_s : seconds in which K was made.
    source_of : the origin of "K" or "A", for error messages. own : a user's K, refused if nearly singular.

    Factors raise InputError if K is not positive definite.
    """

    def __init__(
        self,
        assembly: Assembly,
        key: str,
        model_s: float,
        source_of: SourceOf,
        own: bool = False,
        coarser: Callable[[], Assembly] | None = None,
    ) -> None:
        K = Stiffness(assembly.K.blocks, self._factor)
        super().__init__(replace(assembly, K=K), coarser=coarser)
        self.key, self.model_s, self.source_of, self.own = key, model_s, source_of, own

    @property
    def seconds(self) -> dict[str, float]:
        return {"model": self.model_s}

    def _factor(self, K: Stiffness) -> None:
        nodes = self.assembly.nodes
        try:
            K.factor_blocks()
        except NotPositiveDefinite as error:
            where = "" if nodes is None else " at ({:g}, {:g}) mm".format(*nodes[error.unknown])
            key, moves = f"x[{error.unknown}]{where}", "moves without a force"
            raise indefinite(self.source_of("K"), key, moves) from error
        if self.own:
            refuse_nearly_singular(K.blocks, self.source_of)


class DensePrepared(Prepared):
    """Factors of a dense K and Q, memory-mapped from the cache, or computed and stored there.

    Parameters
    ----------
    assembly : K and A. key : of K in the cache.
    before : seconds of the steps before.
    source_of : the origin of "K", for error messages.

    Factors raise InputError if K is not positive definite or, in balanced units, its condition number exceeds
    1e14.
    """

    def __init__(
        self,
        assembly: Assembly,
        key: str,
        before: dict[str, float],
        source_of: SourceOf,
        reporter: Reporter,
    ) -> None:
        super().__init__(replace(assembly, K=Stiffness(assembly.K.blocks, self._open_factors)))
        self.blocks, A = [b for b in assembly.K.blocks if isinstance(b, dense_block.DenseBlock)], assembly.A
        code = fingerprint([Path(__file__), Path(dense_block.__file__), Path(operator.__file__)])
        self.factors_key = storage.digest("factors", key, code)
        parts = (A.data, A.indices, A.indptr)
        self.key = storage.digest("Q", self.factors_key, [*A.shape], *(part.tobytes() for part in parts))
        self.before, self.source_of, self.reporter = before, source_of, reporter

    @property
    def built(self) -> bool:
        """Whether the factors and Q are in the cache."""
        return None not in (storage.load(self.factors_key), storage.load(str(self.key)))

    @property
    def spectrum(self) -> dict[str, object]:
        return {name: fact for name, fact in self._factored[1].items() if name != "seconds"}

    @property
    def seconds(self) -> dict[str, float]:
        Q = storage.load(str(self.key))
        return self.before | self._factored[1]["seconds"] | ({"Q": Q[1]["seconds"]} if Q else {})

    def make_Q(self) -> Matrix:
        return storage.load_or_make(str(self.key), self._make_schur)[0]["Q"]

    def _open_factors(self, K: Stiffness) -> None:
        for k, block in enumerate(self.blocks):
            block.U = self._factored[0][f"U{k}"]

    @cached_property
    def _factored(self) -> storage.Entry:
        return storage.load_or_make(self.factors_key, self._make_factors)

    def _make_factors(self) -> storage.Entry:
        self.reporter.building(Stage.FACTORS)
        start = time.perf_counter()
        for block, name in zip(self.blocks, self.assembly.parts, strict=True):
            try:
                block.factor()
            except NotPositiveDefinite as error:
                raise indefinite(self.source_of("K"), f"K of {name}", str(error)) from error
        factored = time.perf_counter()
        self.reporter.building(Stage.CONDITION)
        spectrum = [block.extreme_eigenvalues() for block in self.blocks]
        least, largest = min(s[0] for s in spectrum), max(s[1] for s in spectrum)
        if largest > LARGEST_CONDITION * least:
            refuse_nearly_singular(self.blocks, self.source_of)
        facts = {
            "cond_K": largest / least,
            "lambda_min": least,
            "lambda_max": largest,
            "seconds": {"cholesky": factored - start, "condition": time.perf_counter() - factored},
        }
        return {f"U{k}": block.U for k, block in enumerate(self.blocks)}, facts

    def _make_schur(self) -> storage.Entry:
        self.assembly.K.ensure_factored()
        self.reporter.building(Stage.Q)
        start = time.perf_counter()
        Q = self.assembly.K.compliance(self.assembly.A)
        return {"Q": Q}, {"seconds": time.perf_counter() - start}


def refuse_nearly_singular(blocks: Sequence[Block], source_of: SourceOf) -> None:
    """Raise InputError if the condition number of factored blocks exceeds 1e14 in balanced units."""
    K = Stiffness(blocks)
    if (condition := K.condition(K.units)) > LARGEST_CONDITION:
        raise indefinite(source_of("K"), "cond(K), in balanced units", condition)


def indefinite(where: object, key: str, value: object) -> InputError:
    """The error for a K that is not positive definite."""
    allowed = "K must be positive definite: is a part held against every rigid motion?"
    return InputError.one(where, key, value, allowed)
