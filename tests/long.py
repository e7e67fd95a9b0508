"""How much is tried: a sample, or with RIVETBENCH_LONG all of it."""

import os
from collections.abc import Iterable, Sequence
from typing import Any

ASKED = int(os.environ.get("RIVETBENCH_LONG") or 0)


def draws(short: int, long: int) -> int:
    """Of a fuzzer: `long` if RIVETBENCH_LONG is 1, its value if it is larger, `short` if it is not set."""
    return {0: short, 1: long}.get(ASKED, ASKED)


def tried(names: Iterable[str], solvers: Sequence[Any]) -> list[tuple[Any, ...]]:
    """(name, *solver): newton on every name, the others on every third; all with RIVETBENCH_LONG."""
    return [
        (name, *solver)
        for i, name in enumerate(names)
        for j, solver in enumerate(solvers)
        if ASKED or solver[0] == "newton" or (i + j) % 3 == 0
    ]


def seeds(short: int, long: int) -> range:
    """Of a parametrised test."""
    return range(long if ASKED else short)
