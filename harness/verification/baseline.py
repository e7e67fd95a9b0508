"""The errors of an earlier run, as a standard that the gate holds later ones to.

A finding is worse than the baseline if

    error > margin · max(error then, floor),    floor: harness/results/digits.py

so that 1e-11 mm becoming 9e-8 mm is news, although both are within the limit. The errors of the baseline are
those in its rows; its answers need not have been kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from harness.results.digits import floor_mm
from harness.results.records import Row
from harness.results.sides import Side, measurement, read_side, refuse_incomparable

MARGIN = 10.0


@dataclass(frozen=True)
class Baseline:
    """The largest error of each measurement within its limit, mm, and the error bound of its reference.

    name : of its directory. margin : the allowed factor.
    """

    name: str
    margin: float
    errors: Mapping[str, tuple[float, float]]

    def error_mm(self, row: Row) -> float | None:
        """What the error of a row's measurement was; None if the baseline has none within the limit."""
        found = self.errors.get(measurement(row))
        return None if found is None else found[0]

    def exceeded(self, row: Row, error_mm: float, bound_mm: float, limit_mm: float) -> bool:
        """Whether the row's error is beyond the margin."""
        found = self.errors.get(measurement(row))
        if found is None:
            return False
        then_mm, then_bound_mm = found
        return error_mm > self.margin * max(then_mm, floor_mm(max(bound_mm, then_bound_mm), limit_mm))


def read_baseline(directory: Path, margin: float, name: str, rows: Iterable[Row]) -> Baseline:
    """The baseline for the rows of the directory `name`. Raises InputError, Incomparable if it is none of
    theirs.
    """
    side = read_side(str(directory))
    refuse_incomparable(side, Side(name, list(rows)))
    errors: dict[str, tuple[float, float]] = {}
    for key, error, bound in _within(side.rows):
        largest = max(errors.get(key, (0.0, 0.0))[0], error)
        errors[key] = largest, bound
    return Baseline(str(directory), margin, errors)


def _within(rows: Iterable[Row]) -> Iterator[tuple[str, float, float]]:
    for row in rows:
        error = row.get("displacement_error_mm")
        bound = row.get("reference_bound_mm") or 0.0
        if row["verdict"] == "within" and error is not None and isfinite(error + bound):
            yield measurement(row), error, bound
