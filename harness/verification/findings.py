"""Findings of the gate, and their files for a CI: JSON, and JUnit XML, which most CI tools show row by row.

The gate may hold the errors of a run to those of an earlier run, the baseline. A finding is worse than the
baseline if

    error > margin · max(error then, floor),    floor: harness/results/comparison.py

so that a change from 1e-11 mm to 9e-8 mm is reported, although both are within the limit. The errors of the
baseline are read from its rows; its answers need not have been kept.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree

from harness.results.comparison import (
    Side,
    floor_mm,
    measurement,
    read_side,
    refuse_incomparable,
    refuse_other_options,
)
from harness.results.counted_rows import counting
from harness.results.records import Row, replace_text, to_line
from harness.terminal.console import legible

from .judge import Judgement
from .slowdown import NEEDED, slowdowns

SUITE = "rivetbench gate"
JUDGED = ("verdict", "displacement_error_mm", "reference_bound_mm")  # of a finding, in JSON
MARGIN = 10.0  # by which an error may exceed the baseline's


@dataclass(frozen=True)
class Finding:
    """One gated measurement, judged again.

    why : the reason if it failed. baseline_mm : its error in the baseline.
    slowdown : S of slowdown.py if that is why. untimed : whether its time was to be compared and cannot be.
    """

    key: str
    judgement: Judgement
    limit_mm: float
    why: str = ""
    baseline_mm: float | None = None
    slowdown: float | None = None
    untimed: bool = False

    @property
    def passed(self) -> bool:
        return self.judgement.verdict == "within" and not self.why

    @property
    def judged(self) -> bool:
        return self.judgement.verdict in ("within", "outside") and not self.untimed


@dataclass(frozen=True)
class Baseline:
    """The largest error of each measurement within its limit, mm, and the error bound of its reference.

    name : of its directory. margin : the allowed factor. times : see `slowdowns`; None if they do not count.
    """

    name: str
    margin: float
    errors: Mapping[str, tuple[float, float]]
    times: Mapping[str, float | None] | None = None

    def compared(self, row: Row, finding: Finding) -> Finding:
        """The finding of a row beside the baseline: failed if its error is beyond the margin, or by its time.

        Unchanged if the baseline has no error of this measurement within the limit.
        """
        then_mm, then_bound_mm = self.errors.get(measurement(row), (None, 0.0))
        if then_mm is None:
            return finding
        finding, judged = replace(finding, baseline_mm=then_mm), finding.judgement
        error_mm, bound_mm = judged.displacement_error_mm, judged.reference_bound_mm or 0.0
        if judged.verdict != "within" or error_mm is None:
            return finding
        if error_mm <= self.margin * max(then_mm, floor_mm(max(bound_mm, then_bound_mm), finding.limit_mm)):
            return self._timed(finding, measurement(row))
        return replace(finding, why=f"more than {self.margin:g} times the baseline's {then_mm:.1e} mm")

    def _timed(self, finding: Finding, name: str) -> Finding:
        if self.times is None:
            return finding
        if name not in self.times:
            return replace(finding, why=f"its time cannot be compared: that takes {NEEDED}", untimed=True)
        slowdown = self.times[name]
        why = f"{slowdown:.2f} times the baseline's time, beside other solvers" if slowdown else ""
        return replace(finding, why=why, slowdown=slowdown)


def read_baseline(
    directory: Path, margin: float, name: str, rows: Iterable[Row], max_slowdown: float | None = None
) -> Baseline:
    """The baseline for the rows of the directory `name`. Raises InputError; Incomparable if it has none of
    these measurements.
    """
    side, new = read_side(str(directory)), Side(name, list(rows))
    refuse_other_options(new)
    refuse_incomparable(side, new)
    times = slowdowns(side, read_side(name), max_slowdown) if max_slowdown else None
    errors: dict[str, tuple[float, float]] = {}
    for row in counting(side.rows):
        error, bound = row.get("displacement_error_mm"), row.get("reference_bound_mm") or 0.0
        if row["verdict"] == "within" and error is not None and isfinite(error + bound):
            key = measurement(row)
            errors[key] = max(errors.get(key, (0.0, 0.0))[0], error), bound
    return Baseline(str(directory), margin, errors, times)


def write_json(path: Path, directory: Path, findings: Sequence[Finding], code: int) -> None:
    """An object with `directory`, `exit_code`, `passed` and `measurements`, one object per finding."""
    content = {
        "directory": str(directory),
        "exit_code": code,
        "passed": code == 0,
        "measurements": [
            {
                "key": finding.key,
                "passed": finding.passed,
                **{name: getattr(finding.judgement, name) for name in JUDGED},
                "limit_mm": finding.limit_mm,
                "baseline_mm": finding.baseline_mm,
                "slowdown": finding.slowdown,
                "why": finding.why,
            }
            for finding in findings
        ],
    }
    _write(path, json.dumps(json.loads(to_line(content)), indent=1) + "\n")


def write_junit(path: Path, findings: Sequence[Finding]) -> None:
    """A test case per finding: a failure if it became worse, an error if that could not be told."""
    kinds = ["" if one.passed else "failure" if one.judged else "error" for one in findings]
    count = Counter(kinds)
    counts = {"tests": str(len(findings)), "failures": str(count["failure"]), "errors": str(count["error"])}
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(root, "testsuite", {"name": SUITE} | counts)
    for finding, kind in zip(findings, kinds, strict=True):
        scene, _, name = legible(finding.key).partition(" ")
        case = ElementTree.SubElement(suite, "testcase", {"classname": scene, "name": name or scene})
        if kind:
            reason = {"type": finding.judgement.verdict, "message": legible(finding.why)}
            ElementTree.SubElement(case, kind, reason)
    ElementTree.indent(root)
    _write(path, ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_text(path, text)
