"""The accuracy gate: judges the saved answers again; its exit code says whether all are accurate enough.

The figures in the rows are not used. A row only says which answer belongs to which scene, and which
tolerance a search keeps; the problem's data and the reference are made from the scene.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pandas as pd
from pydantic import Field, create_model
from rich.console import Console
from rich.table import Table

from harness.planning.suite import RandomCases
from harness.results import records
from harness.results.answer_files import is_kept
from harness.results.atomic_output import refuse_outputs
from harness.results.counted_rows import counting
from harness.results.records import Row
from harness.results.row_validation import MEASUREMENT, valid_rows
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.console import STYLES
from problems.errors import InputError
from problems.forms import form_family
from problems.input.bounded_types import Positive
from report.document.escape import markdown, quoted, short
from report.document.numbers import counted, error_beside, limit_beside, out_of, proven_to

from .findings import MARGIN, Baseline, Finding, read_baseline, write_json, write_junit
from .judge import LIMIT_MM, REFERENCE_SHARE, Judgement
from .missing_rows import never_measured
from .reference_problem import ReferenceProblem, measurable

#: What the gate reads of a row: which answer belongs to which scene, and how a search went.
NEEDED = (
    *("key", "source", "scene_key", "form", "status", "gated", "limit_mm"),
    *("scene", "solver", "tolerance", "repeat", "verdict"),
)
GATED = create_model(
    "Gated",
    __base__=MEASUREMENT,
    limit_mm=(Positive | None, None),
    case=(Annotated[int, Field(ge=0, lt=10**9)] | None, None),
    series=(RandomCases | None, None),
)
HEADINGS = ["measurement", "error mm", "limit mm", "verdict", "why"]
UNREADABLE = "is missing, damaged or not finite"
#: On the page of a CI job, which GitHub drops whole if it is larger than 1 MiB.
MOST_LINES, LONGEST_CELL = 200, 200

#: The files of a run that no output may replace.
MEASURED = ("*.jsonl", "*.toml", "machine*.json", "answers/*", "answers.zip")


@dataclass(frozen=True)
class GateOutcome:
    """The outcome of a gate.

    Parameters
    ----------
    findings : list of Finding
        One per gated row: its key, its judgement, its limit_mm, and why it has not passed.
    code : int
        Exit code of the command: 0 passed, 1 accuracy lost or slower, 3 nothing judged or a time not
        compared.
    sentences : tuple of str
        The outcome in words.
    """

    findings: list[Finding]
    code: int
    sentences: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every gated row is accurate enough and, if asked, none slower than allowed."""
        return self.code == DONE


def gate(
    directory: str | Path,
    *,
    reference_limit_s: float | None = None,
    baseline: str | Path | None = None,
    margin: float = MARGIN,
    max_slowdown: float | None = None,
    json_file: str | Path | None = None,
    junit_file: str | Path | None = None,
) -> GateOutcome:
    """Judge every gated answer of a run again, and say whether all are accurate enough.

    Parameters
    ----------
    directory : str or Path
        A directory that `run` wrote.
    reference_limit_s : float, optional
        Limit on the search for each reference, s.
    baseline : str or Path, optional
        The directory of an earlier run, whose errors may be exceeded by the margin at most.
    margin : float, optional
        The allowed factor over the baseline.
    max_slowdown : float, optional
        The allowed factor over the baseline's seconds, beside the other solvers of each run.
    json_file, junit_file : str or Path, optional
        Files for the findings: JSON, and JUnit XML.

    Returns
    -------
    GateOutcome
        The findings. The gate passes if every gated row is within 1e-7 mm; on a rung of a ladder, within what
        conditioning allows.

    Raises
    ------
    InputError
        If the directory has no rows, or damaged ones; if no slowdown can be told.
    Incomparable
        If the baseline is of another suite.

    Examples
    --------
    >>> from rivetbench import Overrides, gate, run
    >>> change = Overrides(scenes=("gallery/heavy-sheet-on-tool",), solvers=("gi",), forms=("dual",))
    >>> outcome = run("gate", "results/gi", change)
    >>> gate("results/gi").sentences
    ('Passed: 1 gated row is within 1e-07 mm.',)
    """
    folder, base = Path(directory), Path(baseline) if baseline else None
    if not folder.is_dir():
        raise InputError.one("DIR", "directory", str(folder), "no such directory; `run` makes one")
    sides = [folder] if base is None else [folder, base]
    for option, factor, usual in (("--margin", margin, MARGIN), ("--max-slowdown", max_slowdown, None)):
        if factor != usual and base is None:
            raise InputError.one(option, "factor", factor, "needs --baseline DIR")
        if factor is not None and not factor >= 1:
            raise InputError.one(option, "factor", factor, "1 or larger")
    made = valid_rows(folder / records.MEASUREMENTS, GATED, NEEDED)
    rows = {row["key"]: row for row in counting(made) if row["gated"]}
    inputs = [path for side in sides for files in MEASURED for path in side.glob(files)]
    inputs += [*(side / "suite.toml" for side in sides), *(Path(str(row["source"])) for row in rows.values())]
    named = {"--json": json_file, "--junit": junit_file}
    outputs = {option: Path(file) for option, file in named.items() if file}
    refuse_outputs(outputs, inputs)
    standard = read_baseline(base, margin, str(folder), rows.values(), max_slowdown) if base else None
    findings = [*judged(rows, folder, reference_limit_s, standard), *never_measured(rows, made, folder)]
    code, sentences = concluded(findings, standard)
    if json_file:
        write_json(outputs["--json"], folder, findings, code)
    if junit_file:
        write_junit(outputs["--junit"], findings)
    return GateOutcome(findings, code, sentences)


def concluded(findings: list[Finding], baseline: Baseline | None) -> tuple[int, tuple[str, ...]]:
    """The exit code, and the outcome in sentences."""
    verdicts = [finding.judgement.verdict for finding in findings]
    if not {"within", "outside"} & set(verdicts):
        return NOTHING_JUDGED, ("Nothing could be judged: no gated row has an answer that can be.",)
    slower = sum(finding.slowdown is not None for finding in findings)
    untimed = sum(finding.untimed for finding in findings)
    failed = sum(not finding.passed for finding in findings)
    worse = {"Accuracy lost": failed - slower - untimed, "Slower": slower}
    if any(worse.values()):
        told = (f"{what}: {out_of(k, len(findings), 'gated row')}." for what, k in worse.items() if k)
        return FAILED, tuple(told)
    compared = sum(finding.baseline_mm is not None for finding in findings)
    if baseline and not compared:
        why = f"no gated row has an error within its limit in {baseline.name}"
        return NOTHING_JUDGED, (f"Nothing could be compared: {why}.",)
    timed = f"Times compared: {out_of(compared - untimed, compared, 'gated row')}."
    if untimed:
        return NOTHING_JUDGED, (timed,)
    wider = any(finding.limit_mm > LIMIT_MM for finding in findings)
    limits = "their limits" if wider else f"{LIMIT_MM:g} mm"
    rows = counted(len(findings), "gated row")
    passed = f"Passed: {f'all {rows} are' if len(findings) > 1 else f'{rows} is'} within {limits}."
    if not baseline:
        return DONE, (passed,)
    errors = f"none exceeds {baseline.margin:g} times its error in {baseline.name}"
    sentences = passed, f"Errors compared: {out_of(compared, len(findings), 'gated row')}; {errors}."
    return DONE, (*sentences, timed) if baseline.times else sentences


def show(outcome: GateOutcome, console: Console) -> int:
    """Print the findings and the outcome; returns the exit code."""
    console.print(table(outcome.findings))
    first, *others = outcome.sentences
    console.print(first, style="green" if outcome.passed else "red")
    for sentence in others:
        console.print(sentence)
    return outcome.code


def judged(
    rows: dict[str, Row], directory: Path, limit_s: float | None = None, baseline: Baseline | None = None
) -> Iterator[Finding]:
    """A finding per row, scene by scene, so that each scene is opened once for each family of forms.

    A scene all of whose answers were not kept is not opened.
    """
    problem: ReferenceProblem | None = None
    opened: tuple[str, str] | None = None
    for row in sorted(rows.values(), key=lambda row: (str(row["source"]), form_family(row["form"]))):
        if row.get("answer") and not is_kept(directory / row["answer"]):
            missing, limit_mm = Judgement("no_answer"), min(row["limit_mm"], LIMIT_MM)
            yield Finding(row["key"], missing, limit_mm, f"{row['answer']} {UNREADABLE}")
            continue
        wanted = row["source"], form_family(row["form"])
        if problem is None or wanted != opened:
            problem, opened = measurable(row["source"], limit_s=limit_s, form=row["form"]), wanted
        finding = judged_row(row, problem.of_case(row.get("series"), row.get("case")), directory)
        yield baseline.compared(row, finding) if baseline else finding


def judged_row(row: Row, problem: ReferenceProblem, directory: Path) -> Finding:
    limit = problem.limit_mm(min(row["limit_mm"], LIMIT_MM))
    bound = problem.reference.bound_mm
    if not row.get("answer"):
        why = f"{row['status']}: {row.get('message') or 'no answer'}".splitlines()[0]
        return Finding(row["key"], Judgement("no_answer", bound), limit, why)
    if row["scene_key"] != problem.scene_key:
        why = "the scene has changed since it was measured: run again"
        return Finding(row["key"], Judgement("cannot_be_judged", bound), limit, why)
    judgement = problem.judge_file(directory / row["answer"], limit)
    match judgement.verdict:
        case "no_answer":
            why = f"{row['answer']} {UNREADABLE}"
        case "cannot_be_judged":
            why = f"the reference is {proven_to(bound)}; {REFERENCE_SHARE * limit:.3g} mm is needed"
        case "outside":
            why = f"{error_beside(limit, judgement.displacement_error_mm or 0.0)} mm from the reference"
        case _:
            why = ""
    return Finding(row["key"], judgement, limit, why)


def table(findings: list[Finding]) -> Table:
    made = Table(*HEADINGS, title="Gate: the answers judged again")
    for finding in findings:
        verdict = finding.judgement.verdict
        style = STYLES[verdict if finding.passed or verdict != "within" else "outside"]
        made.add_row(*_cells(finding), style=style)
    return made


def _cells(finding: Finding) -> tuple[str, ...]:
    error, limit = finding.judgement.displacement_error_mm, finding.limit_mm
    shown = "–" if error is None else error_beside(limit, error)
    return finding.key, shown, limit_beside(error, limit), finding.judgement.verdict, finding.why


def append_summary(path: Path, outcome: GateOutcome) -> None:
    """Append the outcome to the Markdown of a CI job's page: sentences, then a table of at most MOST_LINES
    measurements, what failed first.
    """
    findings = sorted(outcome.findings, key=lambda finding: finding.passed)
    cells = [[short(cell, LONGEST_CELL) for cell in _cells(one)] for one in findings[:MOST_LINES]]
    told = pd.DataFrame(quoted(cells), columns=HEADINGS).to_markdown(index=False, disable_numparse=True)
    more = len(findings) - MOST_LINES
    told += f"\n\n… and {more} more" if more > 0 else ""
    with path.open("a", encoding="utf-8") as page:
        page.write(markdown(f"## The accuracy gate\n\n{quoted(' '.join(outcome.sentences))}\n\n{told}\n\n"))
