"""What the gate finds, and its files for a CI: JSON, and JUnit XML, which most of them show row by row.

The errors of an earlier run are a standard that the gate holds later ones to. A finding is worse than that
baseline if

    error > margin · max(error then, floor),    floor: harness/results/comparison.py

so that 1e-11 mm becoming 9e-8 mm is news, although both are within the limit. The errors of the baseline are
those in its rows; its answers need not have been kept.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree

from harness.results.comparison import Side, floor_mm, measurement, read_side, refuse_incomparable
from harness.results.records import Row, replace_text, to_line
from harness.terminal.console import legible

from .judge import Judgement

SUITE = "rivetbench gate"
MARGIN = 10.0  # by which an error may exceed the baseline's


@dataclass(frozen=True)
class Finding:
    """One gated measurement, judged again. why : the reason if it has not passed.

    baseline_mm : its error in the baseline.
    """

    key: str
    judgement: Judgement
    limit_mm: float
    why: str = ""
    baseline_mm: float | None = None

    @property
    def passed(self) -> bool:
        return self.judgement.verdict == "within" and not self.why

    @property
    def judged(self) -> bool:
        return self.judgement.verdict in ("within", "outside")


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
                "verdict": finding.judgement.verdict,
                "displacement_error_mm": finding.judgement.displacement_error_mm,
                "reference_bound_mm": finding.judgement.reference_bound_mm,
                "limit_mm": finding.limit_mm,
                "baseline_mm": finding.baseline_mm,
                "why": finding.why,
            }
            for finding in findings
        ],
    }
    _write(path, json.dumps(json.loads(to_line(content)), indent=1) + "\n")


def write_junit(path: Path, findings: Sequence[Finding]) -> None:
    """A test case per finding: a failure if accuracy was lost, an error if nothing could be said."""
    kinds = ["" if each.passed else "failure" if each.judged else "error" for each in findings]
    of = Counter(kinds)
    counts = {"tests": str(len(findings)), "failures": str(of["failure"]), "errors": str(of["error"])}
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(root, "testsuite", {"name": SUITE} | counts)
    for finding, kind in zip(findings, kinds, strict=True):
        scene, _, name = legible(finding.key).partition(" ")
        case = ElementTree.SubElement(suite, "testcase", {"classname": scene, "name": name or scene})
        if kind:
            said = {"type": finding.judgement.verdict, "message": legible(finding.why)}
            ElementTree.SubElement(case, kind, said)
    ElementTree.indent(root)
    _write(path, ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_text(path, text)
