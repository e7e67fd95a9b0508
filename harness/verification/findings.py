"""What the gate finds, and its files for a CI: JSON, and JUnit XML, which most of them show row by row."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from harness.results.records import replace_text, to_line
from harness.terminal.console import legible

from .judge import Judgement

SUITE = "rivetbench gate"


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
