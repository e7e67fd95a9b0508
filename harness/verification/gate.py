"""The accuracy gate: judges the saved answers again; its exit code says whether all are accurate enough.

The figures in the rows are not used. A row only says which answer belongs to which scene; the problem's
data and the reference are made from the scene.
"""

from collections.abc import Iterator
from math import inf
from pathlib import Path

from pydantic import ValidationError
from rich.console import Console
from rich.table import Table

from harness.planning.plan import expand
from harness.planning.suite import RandomCases, read_written
from harness.results import records
from harness.results.answer_files import is_kept
from harness.results.atomic_output import refuse_outputs
from harness.results.records import Row
from harness.results.row_validation import refuse_wrong_kinds
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.console import STYLES
from problems.errors import Fault, InputError
from problems.forms import form_family
from problems.input.bounded_types import validation_faults

from .findings import MARGIN, Baseline, Finding, read_baseline, write_json, write_junit
from .judge import LIMIT_MM, REFERENCE_SHARE, Judgement
from .reference_problem import ReferenceProblem, reference_problem

#: What the gate reads of a row: which answer belongs to which scene.
NEEDED = ("key", "source", "scene_key", "form", "status", "gated", "limit_mm")
MAX_CASES = 10**9
UNREADABLE = "is missing, damaged or not finite"

#: The files of a run that no output may replace.
MEASURED = ("*.jsonl", "*.toml", "machine*.json", "answers/*")


def gate(
    directory: Path,
    console: Console,
    reference_limit_s: float | None = None,
    baseline: Path | None = None,
    margin: float = MARGIN,
    json_file: Path | None = None,
    junit_file: Path | None = None,
) -> int:
    """Judge every gated row of DIRECTORY. Raises InputError; Incomparable if the baseline is another suite's.

    baseline : the directory of an earlier run, whose errors may be exceeded by the factor `margin` at most.
    Returns 0 if all gated rows are within 1e-7 mm (on a rung of a ladder, what conditioning allows), 1 if
    not (a row is outside, has no answer, is missing, cannot be judged, or is worse than the baseline), 3 if
    no answer at all could be judged, or compared with the baseline.
    """
    if not directory.is_dir():
        raise InputError.one("DIR", "directory", str(directory), "no such directory; `run` makes one")
    sides = [directory] if baseline is None else [directory, baseline]
    inputs = [path for side in sides for files in MEASURED for path in side.glob(files)]
    outputs = {"--json": json_file, "--junit": junit_file}
    refuse_outputs(outputs, [*inputs, *(side / "suite.toml" for side in sides)])
    rows = gated_rows(directory / records.MEASUREMENTS)
    refuse_outputs(outputs, [Path(str(row["source"])) for row in rows.values()])
    standard = read_baseline(baseline, margin, str(directory), rows.values()) if baseline else None
    findings = [*judged(rows, directory, reference_limit_s, standard), *never_measured(rows, directory)]
    console.print(table(findings))
    code = concluded(findings, standard, console)
    if json_file:
        write_json(json_file, directory, findings, code)
    if junit_file:
        write_junit(junit_file, findings)
    return code


def concluded(findings: list[Finding], baseline: Baseline | None, console: Console) -> int:
    """Print the outcome; returns the exit code."""
    verdicts = [finding.judgement.verdict for finding in findings]
    if not {"within", "outside"} & set(verdicts):
        console.print("Nothing could be judged: no gated row has an answer that can be.", style="red")
        return NOTHING_JUDGED
    failed = sum(not finding.passed for finding in findings)
    if failed:
        console.print(f"Accuracy lost: {failed} of {len(findings)} gated rows.", style="red")
        return FAILED
    compared = sum(finding.baseline_mm is not None for finding in findings)
    if baseline and not compared:
        why = f"no gated row has an error within its limit in {baseline.name}"
        console.print(f"Nothing could be compared: {why}.", style="red")
        return NOTHING_JUDGED
    wider = any(finding.limit_mm > LIMIT_MM for finding in findings)
    limits = "their limits" if wider else f"{LIMIT_MM:g} mm"
    console.print(f"Passed: all {len(findings)} gated rows are within {limits}.", style="green")
    if baseline:
        times = f"none exceeds its error there {baseline.margin:g} times"
        console.print(f"{compared} of them are in {baseline.name}: {times}.")
    return DONE


def gated_rows(path: Path) -> dict[str, Row]:
    """The gated rows by key. Raises InputError if a field is missing, of another kind or out of bounds."""
    rows = records.read(path)
    refuse_wrong_kinds(path, rows, needed=NEEDED)
    faults = []
    for number, row in enumerate(rows, start=1):
        if not 0 < row["limit_mm"] < inf:
            allowed = "must be positive and finite"
            faults.append(Fault(str(path), f"line {number}: limit_mm", row["limit_mm"], allowed))
        case = row.get("case")
        if case is not None and not (type(case) is int and 0 <= case < MAX_CASES):
            allowed = f"an integer from 0 to {MAX_CASES - 1}"
            faults.append(Fault(str(path), f"line {number}: case", case, allowed))
        if row.get("series") is not None:
            try:
                RandomCases.model_validate(row["series"])
            except ValidationError as error:
                faults += validation_faults(path, RandomCases, error, f"line {number}: series")
    if faults:
        raise InputError(faults)
    return {row["key"]: row for row in rows if row["gated"]}


def judged(
    rows: dict[str, Row], directory: Path, limit_s: float | None = None, baseline: Baseline | None = None
) -> Iterator[Finding]:
    """A finding per row, scene by scene, so that each scene is opened once for each family of forms.

    A scene all of whose answers were not kept is not opened.
    """
    problem: ReferenceProblem | None = None
    opened: tuple[str, str] | None = None
    for row in sorted(rows.values(), key=lambda row: (str(row["source"]), form_family(row["form"]))):
        if row["answer"] and not is_kept(directory / row["answer"]):
            missing, limit_mm = Judgement("no_answer"), min(row["limit_mm"], LIMIT_MM)
            yield Finding(row["key"], missing, limit_mm, f"{row['answer']} {UNREADABLE}")
            continue
        wanted = row["source"], form_family(row["form"])
        if problem is None or wanted != opened:
            problem, opened = reference_problem(row["source"], limit_s=limit_s, form=row["form"]), wanted
        finding = judged_row(row, problem.of_case(row.get("series"), row.get("case")), directory)
        yield baseline.compared(row, finding) if baseline else finding


def judged_row(row: Row, problem: ReferenceProblem, directory: Path) -> Finding:
    limit = problem.limit_mm(min(row["limit_mm"], LIMIT_MM))
    bound = problem.reference.bound_mm
    if not row.get("answer"):
        why = f"{row['status']}: {row.get('message') or 'no answer'}".splitlines()[0]
        return Finding(row["key"], Judgement("no_answer", bound), limit, why)
    if row["scene_key"] != problem.scene.key:
        why = "the scene has changed since it was measured: run again"
        return Finding(row["key"], Judgement("cannot_be_judged", bound), limit, why)
    judgement = problem.judge_file(directory / row["answer"], limit)
    match judgement.verdict:
        case "no_answer":
            why = f"{row['answer']} {UNREADABLE}"
        case "cannot_be_judged":
            why = f"the reference is known only to {bound:.0e} mm, not to {REFERENCE_SHARE * limit:.0e}"
        case "outside":
            why = f"{judgement.displacement_error_mm:.3e} mm from the reference"
        case _:
            why = ""
    return Finding(row["key"], judgement, limit, why)


def never_measured(rows: dict[str, Row], directory: Path) -> Iterator[Finding]:
    """The gated measurements of the suite that have no row; suite.toml itself if it is missing."""
    path = directory / "suite.toml"
    if not path.is_file():
        why = "is missing, so that nobody knows which rows there should be: run again"
        yield Finding(path.name, Judgement("cannot_be_judged"), LIMIT_MM, why)
    else:
        for measurement in expand(read_written(path)):
            if measurement.entry.gated and measurement.key not in rows:
                why = "never measured: the run did not end"
                yield Finding(measurement.key, Judgement("no_answer"), measurement.suite.limit_mm, why)


def table(findings: list[Finding]) -> Table:
    headings = "measurement", "error mm", "limit mm", "verdict", "why"
    made = Table(*headings, title="Gate: the answers judged again")
    for finding in findings:
        error, verdict = finding.judgement.displacement_error_mm, finding.judgement.verdict
        shown = "–" if error is None else f"{error:.1e}"
        limit = f"{finding.limit_mm:.0e}"
        style = STYLES[verdict if finding.passed or verdict != "within" else "outside"]
        made.add_row(finding.key, shown, limit, verdict, finding.why, style=style)
    return made
