"""The number of draws of a fuzzer: a few hundred, or with RIVETBENCH_LONG many."""

from __future__ import annotations

import os


def draws(short: int, long: int) -> int:
    """`long` if RIVETBENCH_LONG is 1, its value if it is larger, `short` if it is not set."""
    asked = int(os.environ.get("RIVETBENCH_LONG") or 0)
    return {0: short, 1: long}.get(asked, asked)
