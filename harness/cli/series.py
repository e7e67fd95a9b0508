"""The command `series`: many load cases on one assembly."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from . import options
from .options import option


@options.with_load_cases
def series(
    scene: options.SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    source: Callable[[], Any],
    sweep: Annotated[
        list[str] | None,
        option("KEY=VALUES", "A key of the scene and its values. Repeatable, for all combinations."),
    ] = None,
    find: Annotated[
        str | None, option("KEY=LOW:HIGH", "Find how far a key may go to keep --allow-gap in a --share.")
    ] = None,
    share: options.Share = None,
    resolution: options.Resolution = None,
    solver: Annotated[str, option("NAME", "The solver.")] = "newton",
    form: Annotated[
        options.FormName | None, option("FORM", "primal, dual or sparse.  [default: the cheaper one]")
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
    plugin: options.Plugin = None,
    time_limit: Annotated[
        float, option("SECONDS", "Time limit per load case; for a plug-in.", min=0.001)
    ] = 60.0,
    memory_limit: options.MemoryLimit = 8192,
    scheduler: options.Scheduler = None,
    allow_gap: options.AllowGap = None,
    contributors: Annotated[
        int | None, option("N", "Base points, a power of 2: what does each random input contribute?")
    ] = None,
) -> None:
    """Solve many load cases on one assembly: random gaps and keys, measured gaps, or a sweep.

    The assembly is opened and the solver prepared once. Each case is a row with a proven bound on its error,
    and its gaps are saved: stop with Ctrl-C, run the same command again, and it continues where it stopped;
    more --cases extend it. A plug-in runs in a process of its own, stopped at its time or memory limit.

    \b
    Examples:
      python -m harness series 4386/1074 --cases 1000 --out results/gaps
      python -m harness series 4386/0107 --sd 0.2 --correlation-length 150 --cases 200 --out results/var
      python -m harness series 4386/0107 --around scan.csv --sd 0.2 --correlation-length 150 \\
                                         --allow-gap 0.05 --out results/scanned
      python -m harness series 4386/1074 --random 'fasteners.preload=each normal(1000, 100)' \\
                                         --random 'pressure.0.value=uniform(2e-4, 1e-4)' --out results/random
      python -m harness series 4386/1074 --gaps measured.csv --out results/measured
      python -m harness series 4386/0107 --scans 'scans/*.csv' --cases 500 --out results/batch
      python -m harness series 4386/1074 --gaps measured.csv --allow-gap 0.05 --out results/measured
      python -m harness series 4386/0107 --sweep initial_gap.mean=0.1:1.0:10 --out results/sweep
      python -m harness series 4386/0107 --sweep initial_gap.mean=0.2,0.4 \\
                                         --sweep fasteners.preload=500:1500:11 --out results/both
      python -m harness series 4386/0107 --find fasteners.preload=100:4000 --allow-gap 0.05 --share 0.95 \\
                                         --sd 0.2 --correlation-length 150 --out results/force
      python -m harness series 4386/1074 --cases 1000 --threads 1 --scheduler local:2 --out results/gaps

    \b
    Exit codes: 0 solved, 1 a case is outside the limit or has no answer, 2 wrong usage or bad input,
                3 a case, or --find, could not be judged, 4 a gap is larger than --allow-gap, 130 interrupted.
    """
    with options.resumable() as console:
        from harness.commands.limit_search import tolerance as find_limit
        from harness.commands.load_case_series import run_series
        from harness.series.session import SeriesOptions
        from harness.terminal import GAP_EXCEEDED
        from harness.terminal.console import ConsoleReporter, show_verdict
        from problems.errors import InputError

        accuracy, limits = (tolerance, limit, check), (time_limit, memory_limit)
        cases = replace(source(), contributors=contributors)
        settings = SeriesOptions(solver, form, *accuracy, threads, plugin, *limits)
        if find is not None or share is not None or resolution is not None:
            if sweep or not find or allow_gap is None:
                raise InputError.one("--find", "KEY=LOW:HIGH", find, "with --allow-gap, without --sweep")
            goal, told = (allow_gap, share, resolution), ConsoleReporter(console, plain=True)
            answer = find_limit(scene, out, find, *goal, cases, settings, scheduler, told)
            kind = {True: "pass", False: "fail", None: ""}[answer.passed]
            raise typer.Exit(show_verdict(kind, answer.sentences, console))
        outcome = run_series(
            scene,
            out,
            cases,
            settings,
            sweep=sweep or (),
            allow_gap_mm=allow_gap,
            scheduler=scheduler,
            reporter=ConsoleReporter(console),
        )
        if outcome.report:
            console.print(f"Report: {outcome.report}")
        code = outcome.code
        if outcome.sentences:
            shown = show_verdict(outcome.kind, outcome.sentences, console)
            code = shown if shown == GAP_EXCEEDED else code or shown
        raise typer.Exit(code)
