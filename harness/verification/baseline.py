"""The errors of an earlier run, as a standard that the gate holds later ones to.

A finding is worse than the baseline if

    error > margin · max(error then, floor),    floor: harness/results/sides.py

so that 1e-11 mm becoming 9e-8 mm is news, although both are within the limit. The errors of the baseline are
those in its rows; its answers need not have been kept.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from harness.results.records import Row
from harness.results.sides import Side, floor_mm, measurement, read_side, refuse_incomparable

from .findings import Finding

MARGIN = 10.0


@dataclass(frozen=True)
class Baseline:
    """The largest error of each measurement within its limit, mm, and the error bound of its reference.

    name : of its directory. margin : the allowed factor.
    """

    name: str
    margin: float
    errors: Mapping[str, tuple[float, float]]

    def held(self, row: Row, found: Finding) -> Finding:
        """A row's finding with its error in the baseline, if that was within the limit, and whether it is
        beyond the margin.
        """
        if (known := self.errors.get(measurement(row))) is None:
            return found
        then_mm, then_bound_mm = known
        found = replace(found, baseline_mm=then_mm)
        error_mm, bound_mm = found.judgement.displacement_error_mm, found.judgement.reference_bound_mm or 0.0
        if found.judgement.verdict != "within" or error_mm is None:
            return found
        if error_mm <= self.margin * max(then_mm, floor_mm(max(bound_mm, then_bound_mm), found.limit_mm)):
            return found
        return replace(found, why=f"more than {self.margin:g} times the baseline's {then_mm:.1e} mm")


def read_baseline(directory: Path, margin: float, name: str, rows: Iterable[Row]) -> Baseline:
    """The baseline for the rows of the directory `name`. Raises InputError, Incomparable if it is none of
    theirs.
    """
    side = read_side(str(directory))
    refuse_incomparable(side, Side(name, list(rows)))
    errors: dict[str, tuple[float, float]] = {}
    for row in side.rows:
        error, bound = row.get("displacement_error_mm"), row.get("reference_bound_mm") or 0.0
        if row["verdict"] == "within" and error is not None and isfinite(error + bound):
            key = measurement(row)
            errors[key] = max(errors.get(key, (0.0, 0.0))[0], error), bound
    return Baseline(str(directory), margin, errors)
