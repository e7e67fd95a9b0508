"""Solves many load cases on one assembly into a directory, which keeps rows, gaps, report and verdict."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

from harness.measurement.scheduler import threads_per_worker
from harness.measurement.solver_descriptions import described
from harness.planning.form_choice import chosen_form
from harness.results import records, series_file
from harness.results.atomic_output import refuse_inputs, refuse_unwritable
from harness.results.provenance import fingerprints
from harness.results.records import Row
from harness.results.schema import SERIES
from harness.scene.allowed_gap import check_series, refuse_unusable
from harness.scene.solution import Source, load_scene, refuse_other_units
from harness.series.derivatives import derivatives
from harness.series.load_case_source import DEFAULT, RANDOM, GapCases
from harness.series.run import run
from harness.series.session import Job, SeriesOptions, is_rung
from harness.solving.call_lock import keeps_threads
from harness.terminal import DONE
from harness.terminal.console import console_of
from problems.errors import Fault, InputError, number_faults, refuse_text
from problems.load_cases import LoadCases
from problems.load_cases.sweep import sweep as swept
from problems.model.scene import ManufacturedScene
from problems.reporter import SILENT, Reporter
from solvers.plugin import unused

STANDARD = SeriesOptions()
OUTPUTS = ("report", *series_file.CHECK_FILES)


@dataclass(frozen=True)
class SeriesOutcome:
    """A series in its directory.

    Parameters
    ----------
    directory : Path
        Where its rows, gaps and report are.
    code : int
        Exit code of the command: 0 if every case is within the limit.
    sentences : tuple of str
        The outcome for the allowed gap in words; empty if none was asked for.
    kind : str
        "pass" or "fail"; "" where that cannot be told.
    report : Path, optional
        The report, in Markdown; None if no case was solved.
    """

    directory: Path
    code: int
    sentences: tuple[str, ...]
    kind: str
    report: Path | None

    @property
    def rows(self) -> list[Row]:
        """One row per case: status, seconds, residuals, gaps in mm, the proven bound_mm, verdict."""
        return list(series_file.rows(self.directory))


@keeps_threads
def run_series(
    scene: Source,
    out: str | Path,
    cases: GapCases = DEFAULT,
    options: SeriesOptions = STANDARD,
    *,
    sweep: Sequence[str] = (),
    allow_gap_mm: float | None = None,
    scheduler: str | None = None,
    reporter: Reporter = SILENT,
    report: bool = True,
) -> SeriesOutcome:
    """Solve many load cases on one assembly, and keep them in a directory.

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or the content of its file.
    out : str or Path
        The directory; the same call continues what was interrupted, more cases extend it.
    cases : GapCases, optional
        Random or measured gaps; by default 100 random ones.
    options : SeriesOptions, optional
        Solver, accuracy and limits.
    sweep : sequence of str, optional
        KEY=VALUES, a key of the scene and its values, in place of `cases`; all combinations of several.
    allow_gap_mm : float, optional
        The largest gap allowed, mm: the outcome says whether a gap is larger.
    scheduler : str, optional
        Dask workers: local:N, or the address of a scheduler; by default this process.
    reporter : Reporter, optional
        Is told what to know beforehand; silent by default.
    report : bool, optional
        Whether the report is written.

    Returns
    -------
    SeriesOutcome
        Where the rows are, and what they say.

    Raises
    ------
    InputError
        If an input is wrong, or `out` holds another series.

    Examples
    --------
    >>> from rivetbench import run_series
    >>> done = run_series("gallery/installed-fasteners", "results/tips", sweep=["initial_gap.mean=0.6,0.7"])
    >>> [row["verdict"] for row in done.rows]
    ['within', 'within']
    """
    directory, solver = Path(out), options.solver
    refuse_text("run_series", sweep=sweep)
    refuse_unusable(allow_gap_mm)
    refuse_other_units("series", read := load_scene(scene))
    cases = cases if sweep else replace(cases, random=cases.laws(read))
    faults = cases.faults(sweep)
    if sweep and cases.count is not None:
        faults.append(Fault("--cases", "cases", cases.count, "a sweep has one per combination of values"))
    faults += unused(options.plugin, [solver])
    faults += number_faults(threads=(options.threads, 1), check=(options.check, 0))
    if options.plugin and isinstance(read, ManufacturedScene) and not is_rung(read):
        allowed = "a scene that another process can read, by its name or from a file: `export` makes one"
        faults.append(Fault("--plugin", "scene", read.name, allowed))
    for name, value, usual in (
        ("time-limit", options.time_limit_s, STANDARD.time_limit_s),
        ("memory-limit", options.memory_limit_mib, STANDARD.memory_limit_mib),
    ):
        if value != usual and not options.plugin:
            faults.append(Fault(f"--{name}", "limit", value, "with --plugin, whose solver alone is ended"))
        if not value > 0:
            faults.append(Fault(f"--{name}", "limit", value, "above 0"))
    (made,) = described([(solver, {})], options.plugin, "--solver", reporter)
    if options.form and options.form not in made.forms:
        faults.append(Fault("--form", "form", options.form, f"{solver} takes {' and '.join(made.forms)}"))
    if not (0 < options.tolerance < inf and 0 < options.limit_mm < inf):
        accuracy = options.tolerance, options.limit_mm
        faults.append(Fault("series", "tolerance, limit", accuracy, "must be positive and finite"))
    if faults:
        raise InputError(faults)
    inputs = [*read.sources, *(Path(file) for file in (*cases.files, options.plugin) if file)]
    refuse_unwritable(directory, inputs)
    report_files = (directory / "report").glob("*")
    refuse_inputs([*(directory / name for name in (SERIES, *OUTPUTS)), *report_files], inputs)
    records.refuse_other_command(directory, SERIES, OUTPUTS)
    earlier = (series_file.read_facts(directory) or {}).get("identity", {}).get("form")
    wanted = options.form or (earlier if earlier in made.forms else None)
    alien = [*sweep, *([str(options.plugin)] if options.plugin else [])]
    if read.stages and alien:
        where = "--sweep, --plugin"
        raise InputError.one(where, "given", ", ".join(alien), f"leave them out: {read.name} has stages")
    steps = swept(read, sweep) if sweep else None
    count = steps.count if steps else cases.count or RANDOM * (cases.contributors or 1)
    choice = chosen_form(read, made.forms, wanted, count)
    if choice.why:
        reporter.say(f"In the sparse form, without condensation: {choice.why}")
    chosen: LoadCases = (
        replace(steps, form=choice.form) if steps else cases.of(read, choice.form, stiffness=True)
    )
    for sentence in (*read.unusual, *chosen.notes):
        reporter.say(sentence)
    threads = options.threads or threads_per_worker(scheduler) or (1 if choice.form == "sparse" else 2)
    plugin = Path(options.plugin).absolute() if options.plugin else None  # workers may be elsewhere
    settled: dict[str, Any] = {"form": choice.form, "threads": threads, "plugin": plugin}
    settled |= {"plugin_version": made.version} if plugin else {}
    job = Job(**vars(options) | settled, scene=read, cases=chosen)
    facts = {"solver_version": made.version, "solver_code": made.code}
    files = fingerprints(inputs) if report else {}  # now: they may change meanwhile
    code = run(job, facts, directory, console_of(reporter), scheduler)
    verdict: dict[str, Any] = {"kind": "", "said": []}
    if allow_gap_mm is not None and sum(1 for _ in series_file.rows(directory)) == chosen.count:
        verdict = check_series(directory, allow_gap_mm)
    path = None
    if report and series_file.read_facts(directory):
        more: dict[str, Any] = {"inputs": files}
        whole = cases.contributors and code == DONE and not read.stages
        more |= {"derivatives": derivatives(job)} if whole else {}
        series_file.add_facts(directory, more)
        from report.writers.series_report import write  # slow to import: not before the first row

        path = write(directory)
    return SeriesOutcome(directory.absolute(), code, tuple(verdict["said"]), verdict["kind"], path)
