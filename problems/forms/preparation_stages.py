"""Data preparation of a scene, with errors that name the scene: dense factors of K, and Q, from the cache;
sparse factors in memory. Each is made when first needed.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from problems import storage
from problems.errors import InputError
from problems.reporter import Reporter, Stage
from problems.stiffness import dense_block, operator
from problems.stiffness.block import Block, NotPositiveDefinite
from problems.stiffness.operator import Stiffness
from problems.storage import fingerprint

from .assembly import Assembly, Matrix
from .prepared import Prepared

ONE_OF_MANY = "Contacts depend on one another: x is unique, the forces λ are one choice of many"
LARGEST_CONDITION = 1e14  # beyond it no digit of a displacement can be proven

SourceOf = Callable[[str], object]


def _contents(assembly: Assembly) -> Iterator[list[int] | memoryview]:
    """What a key needs to tell A, and a sparse K with its junction, from another one."""
    A, K = assembly.A, assembly.K
    junction = [] if assembly.junction is None else [assembly.junction]
    yield [*A.shape, len(junction)]
    for array in (A.data, A.indices, A.indptr, *junction, *(() if K.dense else K.arrays)):
        yield np.ascontiguousarray(array).data


class SparsePrepared(Prepared):
    """A sparse K whose factors are made in memory; that raises InputError if K is not positive definite.

    Parameters
    ----------
    model_s : seconds in which K was made.
    source_of : gives the origin of "K" or "A", for messages.
    refuses_singular : whether K is refused if it is nearly singular.
    """

    def __init__(
        self,
        assembly: Assembly,
        model_s: float,
        source_of: SourceOf,
        refuses_singular: bool = False,
        coarser: Callable[[], Assembly] | None = None,
    ) -> None:
        K = Stiffness(assembly.K.blocks, self._factor)
        notes = (*assembly.notes, ONE_OF_MANY) if assembly.dependent else assembly.notes
        super().__init__(replace(assembly, K=K, notes=notes), coarser=coarser)
        self.model_s, self.source_of = model_s, source_of
        self.refuses_singular = refuses_singular

    @cached_property
    def key(self) -> str:
        """Of every bit of K and A: it names the bounds and answers that are proven and kept in the cache."""
        return storage.digest("sparse", *_contents(self.assembly))

    def _factor(self, K: Stiffness) -> None:
        nodes = self.assembly.nodes
        try:
            K.factor_blocks()
        except NotPositiveDefinite as error:
            where = "" if nodes is None else " at ({:g}, {:g}) mm".format(*nodes[error.unknown])
            key, moves = f"x[{error.unknown}]{where}", "moves without a force"
            raise indefinite(self.source_of("K"), key, moves) from error
        if self.refuses_singular:
            refuse_nearly_singular(K.blocks, self.source_of)


class DensePrepared(Prepared):
    """A dense K whose factors and Q are memory-mapped from the cache, or computed and stored there.

    Making factors raises InputError if K is not positive definite or, in balanced units, its condition number
    exceeds 1e14.

    Parameters
    ----------
    key : names K in the cache. model_seconds : seconds of each step that made K.
    source_of : gives the origin of "K", for messages.
    """

    def __init__(
        self,
        assembly: Assembly,
        key: str,
        model_seconds: dict[str, float],
        source_of: SourceOf,
        reporter: Reporter,
    ) -> None:
        super().__init__(replace(assembly, K=Stiffness(assembly.K.blocks, self._open_factors)))
        self.blocks = [b for b in assembly.K.blocks if isinstance(b, dense_block.DenseBlock)]
        code = fingerprint([Path(__file__), Path(dense_block.__file__), Path(operator.__file__)])
        self.factors_key = storage.digest("factors", key, code)
        self.key = storage.digest("Q", self.factors_key, *_contents(assembly))
        self.model_seconds, self.source_of, self.reporter = model_seconds, source_of, reporter

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
        return self.model_seconds | self._factored[1]["seconds"] | ({"Q": Q[1]["seconds"]} if Q else {})

    def make_Q(self) -> Matrix:
        return storage.load_or_make(str(self.key), self._make_compliance)[0]["Q"]

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

    def _make_compliance(self) -> storage.Entry:
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
