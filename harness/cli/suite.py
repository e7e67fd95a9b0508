"""The commands for a suite: run, report, gate."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from .options import NOTHING_WRITTEN, Plugin, ReferenceLimit, Scheduler, error_reporting, option, resumable


def run(
    suite: Annotated[
        str,
        typer.Argument(
            metavar="SUITE", help="Name of a suite, path of its TOML file, or directory that `run` wrote."
        ),
    ] = "default",
    size: Annotated[list[int] | None, option("N", "Only scenes with N unknowns. Repeatable.")] = None,
    scene: Annotated[
        list[str] | None,
        option("NAME", "These scenes: name, glob, .toml or .npz file. Repeatable."),
    ] = None,
    solver: Annotated[
        list[str] | None, option("NAME", "Only these solvers, in the suite or not. Repeatable.")
    ] = None,
    with_: Annotated[
        list[str] | None,
        option(
            "NAME==VERSION",
            "Only this library, in this version; NAME alone: as installed here. Repeatable.",
            "--with",
        ),
    ] = None,
    form: Annotated[
        list[str] | None, option("FORM", "Only this form: primal, dual or sparse. Repeatable.")
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        option("TOL", "Tolerance passed to the solvers, repeatable; auto: the loosest one that suffices."),
    ] = None,
    setting: Annotated[
        list[str] | None, option("SOLVER.KEY=VALUE", "An option of a solver. Repeatable.", "--option")
    ] = None,
    repeat: Annotated[int | None, option("N", "Number of repeats.", min=1)] = None,
    threads: Annotated[
        list[int] | None,
        option(
            "N",
            "Threads for linear algebra. Repeatable.  [with local:N, if the suite has none: cores / N]",
            min=1,
        ),
    ] = None,
    time_limit: Annotated[
        float | None,
        option("SECONDS", "Time limit per measurement, from the start of the solver.", min=0.001),
    ] = None,
    memory_limit: Annotated[
        int | None, option("MIB", "Memory limit, over all processes of the solver.", min=1)
    ] = None,
    reference_limit: ReferenceLimit = None,
    out: Annotated[
        Path | None, option("DIR", "Output directory.  [default: results/SUITE, or the DIR given as SUITE]")
    ] = None,
    plugin: Plugin = None,
    scheduler: Scheduler = None,
    key: Annotated[str | None, option("KEY", "Only the row with this key, and its earlier repeats.")] = None,
) -> None:
    """Measure a suite and write rows, answers and report.

    Each measurement is a process of its own, stopped at its time or memory limit. Rows are saved as they are
    finished: stop with Ctrl-C, run the same command again, and it continues where it stopped. Until all are
    there, the directory takes no run that leaves out some of its measurements.

    --with measures versions of a library side by side. pip installs each once, into an environment in the
    cache that has all other packages from here. A version that cannot be installed, or that its adapter
    cannot call, gives rows `failed` with the reason. If its solver has another name, add --solver.

    \b
    Examples:
      python -m harness run --size 4386
      python -m harness run --scene 4386/0107 --solver ipm --solver piqp --form dual
      python -m harness run --scene my-matrices.npz --tolerance 1e-6 --tolerance 1e-9
      python -m harness run --size 4386 --with piqp --with piqp==0.6.2 --repeat 3 --out results/piqp
      python -m harness run my-suite.toml --repeat 5 --threads 1 --threads 2
      python -m harness run --scheduler tcp://10.0.0.5:8786
      python -m harness run results/default --key "4386/0107 gi dual tol=1e-10 threads=2 repeat=0" --out again

    \b
    Exit codes: 0 measured, 1 incomplete: workers were lost, 2 wrong usage or bad input,
                3 no row has an answer that can be judged, 130 interrupted.
    """
    with resumable() as console:
        from harness.commands.suite_runs import run as run_suite
        from harness.planning.overrides import Overrides, tolerances_of
        from harness.terminal.console import ConsoleReporter

        forms: Any = tuple(form or ())  # checked with the suite
        change = Overrides(
            sizes=tuple(size or ()),
            scenes=tuple(scene or ()),
            solvers=tuple(solver or ()),
            requirements=tuple(with_ or ()),
            forms=forms,
            tolerances=tolerances_of(tolerance or []),
            options=tuple(setting or ()),
            repeats=repeat,
            threads=tuple(threads or ()),
            time_limit_s=time_limit,
            memory_limit_mib=memory_limit,
            reference_limit_s=reference_limit,
            plugin=plugin,
        )
        reporter = ConsoleReporter(console)
        outcome = run_suite(suite, out, change, scheduler=scheduler, key=key, reporter=reporter)
        if outcome.report:
            console.print(f"Report: {outcome.report}")
        raise typer.Exit(outcome.code)


def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory that `run` or `series` wrote.")],
) -> None:
    """Rewrite DIR/report/report.md from the rows.

    \b
    Example:
      python -m harness report results/default
    """
    with error_reporting() as console:
        from harness.commands.suite_runs import report as write_report

        console.print(f"Report: {write_report(directory)}")


def gate(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory that `run` wrote.")],
    reference_limit: ReferenceLimit = None,
    baseline: Annotated[
        Path | None, option("DIR", "An earlier run, whose errors must not be exceeded by the margin.")
    ] = None,
    margin: Annotated[float, option("FACTOR", "The allowed factor over the baseline.", min=1.0)] = 10.0,
    max_slowdown: Annotated[
        float | None,
        option("FACTOR", "The allowed ratio of times to the baseline, beside other solvers.", min=1.0),
    ] = None,
    json: Annotated[Path | None, option("FILE", "Write the findings as JSON.")] = None,
    junit: Annotated[Path | None, option("FILE", "Write the findings as JUnit XML.")] = None,
) -> None:
    """Judge the saved answers again, and fail if accuracy was lost.

    The numbers in the rows are not trusted: each answer is compared with the reference of its scene. With a
    baseline, an error that is still within the limit fails if it is more than the margin times what it was;
    what lies below the reference's error bound does not count.

    --max-slowdown compares a solver's times with those of the other solvers on the scene in the same run, and
    this ratio with the baseline's, which may be of another machine. Both runs need three repeats.

    From a search for a tolerance, the one that it keeps is judged; runs that a trace stopped are not.

    In a GitHub job, the outcome is appended to the page of the job ($GITHUB_STEP_SUMMARY).

    \b
    Examples:
      python -m harness run gate && python -m harness gate results/gate
      python -m harness gate results/gate --baseline baseline --margin 10 --junit gate.xml
      python -m harness gate results/gate --baseline baseline --max-slowdown 1.5

    \b
    Exit codes:
      0  every gated row is within 1e-7 mm (on a rung of a ladder, within what conditioning allows)
      1  accuracy lost: a gated row is outside, cannot be judged, has no answer, was never measured, or is
         worse or slower than the baseline; others can be judged
      2  wrong usage or bad input
      3  no gated row has an answer that can be judged, or nothing, or a time, can be compared
      5  the baseline has none of these measurements, other problems or other limits
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.verification.gate import append_summary, show
        from harness.verification.gate import gate as judge_again

        outcome = judge_again(
            directory,
            reference_limit_s=reference_limit,
            baseline=baseline,
            margin=margin,
            max_slowdown=max_slowdown,
            json_file=json,
            junit_file=junit,
        )
        code = show(outcome, console)  # said also if the page cannot be written
        if page := os.environ.get("GITHUB_STEP_SUMMARY"):
            append_summary(Path(page), outcome)
        raise typer.Exit(code)
