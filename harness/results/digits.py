"""Digits lost between two errors of the same measurement:

    log10( max(after, floor) / max(before, floor) ),    floor = max(bound, NEGLIGIBLE · limit)

bound is the error bound of the reference: below it, a difference says nothing of the answers. What lies a
million times below the limit is not worth a difference either.
"""

from __future__ import annotations

from math import log10

NEGLIGIBLE = 1e-6


def floor_mm(bound_mm: float, limit_mm: float) -> float:
    """The smallest error that counts, mm."""
    return max(bound_mm, NEGLIGIBLE * limit_mm)


def digits_lost(before_mm: float, after_mm: float, floor: float) -> float:
    """Negative if digits were gained. floor : positive."""
    return log10(max(after_mm, floor) / max(before_mm, floor))
