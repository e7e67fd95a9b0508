"""How much is tried: a sample, or with RIVETBENCH_LONG all of it."""

import os

ASKED = int(os.environ.get("RIVETBENCH_LONG") or 0)


def draws(short: int, long: int) -> int:
    """Of a fuzzer: `long` if RIVETBENCH_LONG is 1, its value if it is larger, `short` if it is not set."""
    return {0: short, 1: long}.get(ASKED, ASKED)


def seeds(short: int, long: int) -> range:
    """Of a parametrised test."""
    return range(long if ASKED else short)
