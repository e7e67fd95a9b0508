"""The command `series`: many load cases on one assembly."""

from __future__ import annotations

import signal
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import (
    AllowGap,
    Around,
    Cases,
    FormName,
    Gaps,
    Length,
    Mean,
    MemoryLimit,
    Plugin,
    SceneName,
    Scheduler,
    Seed,
    Spread,
    error_reporting,
    option,
)

if TYPE_CHECKING:
    from problems.load_cases import LoadCases


def series(
    scene: SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    cases: Cases = None,
    seed: Seed = None,
    mean: Mean = None,
    sd: Spread = None,
    correlation_length: Length = None,
    around: Around = None,
    gaps: Gaps = None,
    sweep: Annotated[
        list[str] | None,
        option("KEY=VALUES", "A key of the scene and its values. Repeatable, for all combinations."),
    ] = None,
    solver: Annotated[str, option("NAME", "The solver.")] = "newton",
    form: Annotated[
        FormName | None, option("FORM", "primal, dual or sparse.  [default: the cheaper one]")
    ] = None,
    tolerance: Annotated[float, option("TOL", "Tolerance passed to the solver.")] = 1e-11,
    limit: Annotated[float, option("MM", "Limit on the error.")] = 1e-7,
    check: Annotated[
        int, option("N", "Compare every N-th case with the certified reference; 0: none.", min=0)
    ] = 100,
    threads: Annotated[
        int | None,
        option(
            "N",
            "Threads for linear algebra.  [default: 2; 1 in the sparse form; with local:N: cores / N]",
            min=1,
        ),
    ] = None,
    plugin: Plugin = None,
    time_limit: Annotated[
        float, option("SECONDS", "Time limit per load case; for a plug-in.", min=0.001)
    ] = 60.0,
    memory_limit: MemoryLimit = 8192,
    scheduler: Scheduler = None,
    allow_gap: AllowGap = None,
) -> None:
    """Solve many load cases on one assembly: random gaps, measured gaps, or a sweep.

    The assembly is opened and the solver prepared once. Each case is a row with a proven bound on its error,
    and its gaps are saved: stop with Ctrl-C, run the same command again, and it continues where it stopped;
    more --cases extend it. A plug-in runs in a process of its own, stopped at its time or memory limit.

    \b
    Examples:
      python -m harness series 4386/1074 --cases 1000 --out results/gaps
      python -m harness series 4386/0107 --sd 0.2 --correlation-length 150 --cases 200 --out results/var
      python -m harness series 4386/0107 --around scan.csv --sd 0.2 --correlation-length 150 \\
                                         --allow-gap 0.05 --out results/scanned
      python -m harness series 4386/1074 --gaps measured.csv --out results/measured
      python -m harness series 4386/1074 --gaps measured.csv --allow-gap 0.05 --out results/measured
      python -m harness series 4386/0107 --sweep initial_gap.mean=0.1:1.0:10 --out results/sweep
      python -m harness series 4386/0107 --sweep initial_gap.mean=0.2,0.4 \\
                                         --sweep fasteners.preload=500:1500:11 --out results/both
      python -m harness series 4386/1074 --cases 1000 --threads 1 --scheduler local:2 --out results/gaps

    \b
    Exit codes: 0 solved, 1 a case is outside the limit or has no answer, 2 wrong usage or bad input,
                3 a case could not be judged, 4 a gap is larger than --allow-gap, 130 interrupted.
    """
    with error_reporting() as console:
        from harness.measurement.scheduler import threads_per_worker
        from harness.measurement.solver_descriptions import described
        from harness.planning.form_choice import chosen_form
        from harness.results.atomic_output import refuse_inputs, refuse_unwritable
        from harness.results.schema import SERIES
        from harness.results.series_file import read_facts
        from harness.scene.allowed_gap import check_series, refuse_unusable
        from harness.scene.validate import print_unusual
        from harness.series.load_case_source import RANDOM, GapCases
        from harness.series.run import run
        from harness.series.session import Job
        from harness.terminal import DONE, NOTHING_JUDGED
        from harness.terminal.console import ConsoleReporter, show_verdict
        from problems.errors import Fault, InputError
        from problems.load_cases.sweep import sweep as swept
        from problems.scene_files import read_scene

        refuse_unusable(allow_gap)
        given = GapCases(cases, seed, mean, sd, correlation_length, around, gaps)
        faults = given.faults(sweep or ())
        if sweep and cases is not None:
            faults.append(Fault("--cases", "cases", cases, "a sweep has one per combination of values"))
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        (made,) = described([(solver, {})], plugin, "--solver", ConsoleReporter(console))
        if form and form.value not in made.forms:
            faults.append(Fault("--form", "form", form.value, f"{solver} takes {' and '.join(made.forms)}"))
        if not (0 < tolerance < inf and 0 < limit < inf):
            allowed = "must be positive and finite"
            faults.append(Fault("series", "tolerance, limit", (tolerance, limit), allowed))
        if faults:
            raise InputError(faults)
        inputs = [Path(each) for each in (scene, around, gaps, plugin) if each]
        refuse_unwritable(out, inputs)
        refuse_inputs([out / SERIES], inputs)
        read = read_scene(scene)
        before = (read_facts(out) or {}).get("identity", {}).get("form")
        asked: Any = form.value if form else before if before in made.forms else None
        count = swept(read, sweep).count if sweep else cases or RANDOM
        choice = chosen_form(read, made.forms, asked, count)
        if choice.why:
            console.print(f"In the sparse form, without condensation: {choice.why}.", style="dim")
        taken: Any = choice.form
        chosen: LoadCases = swept(read, sweep, taken) if sweep else given.of(read, taken)
        print_unusual(read, console, chosen.notes)
        limits = time_limit, memory_limit
        threads = threads or threads_per_worker(scheduler) or (1 if taken == "sparse" else 2)
        job = Job(read, chosen, solver, taken, tolerance, limit, check, threads, {}, plugin, *limits)
        facts = {"solver_version": made.version, "solver_code": made.code}
        code = run(job, facts, out, console, scheduler)
        verdict = None
        if allow_gap is not None and code in (DONE, NOTHING_JUDGED):
            verdict = check_series(out, allow_gap)
        if read_facts(out):
            from report.writers.series_report import write  # slow to import: not before the first row

            console.print(f"Report: {write(out)}")
        if verdict:
            code = show_verdict(verdict["kind"], verdict["said"], console) or code
        raise typer.Exit(code)
