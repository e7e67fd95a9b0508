"""The command line: run, report, gate, list; each other file of this folder has further commands.

Modules that are slow to import are imported inside the commands.
"""

from __future__ import annotations

import signal
import sys
from enum import StrEnum
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated

import typer

from . import check as check_command
from . import compare as compare_command
from . import exchange as exchange_commands
from . import scene as scene_commands
from . import series as series_command
from .options import FormName, Plugin, ReferenceLimit, Scheduler, error_reporting, option

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)
app.add_typer(check_command.app)
app.add_typer(compare_command.app)
app.add_typer(exchange_commands.app)
app.add_typer(scene_commands.app)
app.add_typer(series_command.app)


class Listed(StrEnum):
    solvers = "solvers"
    scenes = "scenes"
    suites = "suites"
    formats = "formats"


@app.callback()
def harness() -> None:
    """Compare quadratic-programming solvers on aircraft riveting problems.

    \b
    Start here:
      python -m harness run                       measure the suite `default` (11 minutes) and report on it
      python -m harness run --size 4386           the small problems only
      python -m harness list solvers              what can be measured
      python -m harness run --plugin mine.py      with a solver of your own
      python -m harness init joint.toml           a commented scene to start from
      python -m harness solve scene.toml --out d  one scene: gaps, displacements, forces, with pictures
      python -m harness series SCENE --out DIR    thousands of load cases on one assembly
      python -m harness compare OLD NEW           what became worse between two runs
      python -m harness COMMAND --help            help on each command

    \b
    Exit codes: 0 ok, 1 accuracy lost, 2 wrong usage or bad input, 3 nothing could be judged,
                4 gap larger than allowed, 5 inputs that do not belong together, 130 interrupted.
    """


@app.command()
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
        typer.Option(
            "--with",
            metavar="NAME==VERSION",
            help="Only this library, in this version; NAME alone: as installed here. Repeatable.",
        ),
    ] = None,
    form: Annotated[
        list[FormName] | None, option("FORM", "Only this form: primal, dual or sparse. Repeatable.")
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        option("TOL", "Tolerance passed to the solvers, repeatable; auto: the loosest decade that suffices."),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option("--option", metavar="SOLVER.KEY=VALUE", help="An option of a solver. Repeatable."),
    ] = None,
    repeat: Annotated[int | None, option("N", "Number of repeats.", min=1)] = None,
    threads: Annotated[
        list[int] | None,
        option("N", "Threads for linear algebra. Repeatable.  [with local:N: cores / N]", min=1),
    ] = None,
    time_limit: Annotated[
        float | None,
        option("SECONDS", "Time limit per measurement, from the start of the solver.", min=0.001),
    ] = None,
    memory_limit: Annotated[
        int | None, option("MIB", "Memory limit, over all processes of the solver.", min=1)
    ] = None,
    reference_limit: ReferenceLimit = None,
    out: Annotated[Path | None, option("DIR", "Output directory.  [default: results/SUITE]")] = None,
    plugin: Plugin = None,
    scheduler: Scheduler = None,
    key: Annotated[str | None, option("KEY", "Only the row with this key, measured again.")] = None,
) -> None:
    """Measure a suite and write rows, answers and report.

    Each measurement is a process of its own, stopped at its time or memory limit. Rows are saved as they are
    finished: stop with Ctrl-C, run the same command again, and it continues where it stopped.

    --with measures versions of a library side by side. pip installs each once, into an environment in the
    cache that has all other packages from here. A version that cannot be installed, or that its adapter
    cannot call, gives rows `failed` with the reason. If its solver has another name, add --solver.

    \b
    Examples:
      python -m harness run --size 4386
      python -m harness run --scene 4386/0107 --solver ipm --solver piqp --form dual
      python -m harness run --scene my-matrices.npz --tolerance 1e-6 --tolerance 1e-9
      python -m harness run --scene 4386/1471 --solver osqp --tolerance auto --option osqp.scaling=0
      python -m harness run --size 4386 --with piqp --with piqp==0.6.2 --repeat 3 --out results/piqp
      python -m harness run --solver proxqp --with proxsuite==0.7.2 --with proxsuite==0.8.0
      python -m harness run gate --out results/gate
      python -m harness run my-suite.toml --repeat 5 --threads 1 --threads 2
      python -m harness run --scheduler tcp://10.0.0.5:8786
      python -m harness run results/default --key "4386/0107 gi dual tol=1e-10 threads=2 repeat=0" --out again

    \b
    Exit codes: 0 measured, 1 incomplete: workers were lost, 2 wrong usage or bad input,
                3 nothing could be judged, 130 interrupted.
    """
    with error_reporting() as console:
        from harness.measurement.run import run as run_suite
        from harness.measurement.scheduler import threads_per_worker
        from harness.planning.overrides import Overrides, overridden, tolerances_of
        from harness.planning.suite import read_suite, read_written
        from harness.results.records import MEASUREMENTS

        change = Overrides(
            sizes=tuple(size or ()),
            scenes=tuple(scene or ()),
            solvers=tuple(solver or ()),
            requirements=tuple(with_ or ()),
            forms=tuple(choice.value for choice in form or ()),
            tolerances=tolerances_of(tolerance or []),
            options=tuple(setting or ()),
            repeats=repeat,
            threads=tuple(threads or ()),
            time_limit_s=time_limit,
            memory_limit_mib=memory_limit,
            reference_limit_s=reference_limit,
            plugin=plugin,
        )
        written = Path(suite) / "suite.toml"
        read = read_written(written) if written.is_file() else read_suite(suite)
        chosen = overridden(read, change)
        if not threads and "threads" not in read.model_fields_set:
            chosen = chosen.model_copy(
                update={"threads": [threads_per_worker(scheduler) or chosen.threads[0]]}
            )
        directory = out or Path("results") / chosen.name
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        code = run_suite(chosen, directory, console, scheduler, key)
        if (directory / MEASUREMENTS).is_file():
            from report.writers.markdown import write  # slow to import: not before the first row

            console.print(f"Report: {write(directory)}")
        raise typer.Exit(code)


@app.command()
def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory that `run` or `series` wrote.")],
) -> None:
    """Rewrite DIR/report/report.md from the rows.

    \b
    Example:
      python -m harness report results/default
    """
    with error_reporting() as console:
        from harness.planning.suite import read_written
        from harness.results import records
        from harness.results.kinds import refuse_unreadable
        from harness.results.schema import SERIES
        from harness.results.series_file import refuse_damaged
        from problems.errors import InputError

        if (directory / SERIES).exists():
            from report.writers.series import write as write_series

            refuse_damaged(directory)
            console.print(f"Report: {write_series(directory)}")
            return
        path = directory / records.MEASUREMENTS
        if not path.is_file():
            raise InputError.one("DIR", "directory", str(directory), f"has no {path.name}; `run` creates one")
        refuse_unreadable(directory)
        suite = directory / "suite.toml"
        if suite.is_file():
            read_written(suite)
        from report.writers.markdown import write

        console.print(f"Report: {write(directory)}")


@app.command()
def gate(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory that `run` wrote.")],
    reference_limit: ReferenceLimit = None,
    baseline: Annotated[
        Path | None, option("DIR", "An earlier run, whose errors must not be exceeded by the margin.")
    ] = None,
    margin: Annotated[float, option("FACTOR", "The allowed factor over the baseline.", min=1.0)] = 10.0,
    json: Annotated[Path | None, option("FILE", "Write the findings as JSON.")] = None,
    junit: Annotated[Path | None, option("FILE", "Write the findings as JUnit XML.")] = None,
) -> None:
    """Judge the saved answers again, and fail if accuracy was lost.

    The numbers in the rows are not trusted: each answer is compared with the reference of its scene. With a
    baseline, an error that is still within the limit fails if it is more than the margin times what it was;
    what lies below the reference's error bound does not count.

    \b
    Examples:
      python -m harness run gate && python -m harness gate results/gate
      python -m harness gate results/gate --baseline baseline --margin 10 --junit gate.xml

    \b
    Exit codes:
      0  every gated row is within 1e-7 mm (on a rung of a ladder, within what conditioning allows)
      1  accuracy lost: a gated row is outside, cannot be judged, has no answer, was never measured, or is
         worse than the baseline
      2  wrong usage or bad input
      3  nothing could be judged
      5  the baseline has none of these measurements, other problems or other limits
    """
    with error_reporting() as console:
        from harness.verification.gate import gate as judge_directory

        code = judge_directory(directory, console, reference_limit, baseline, margin, json, junit)
        raise typer.Exit(code)


@app.command("list")
def list_(what: Listed) -> None:
    """List the available solvers, scenes, suites or file formats.

    \b
    Examples:
      python -m harness list solvers
      python -m harness list scenes
    """
    with error_reporting() as console:
        from .listing import listing

        console.print(listing(what.value))


def main() -> None:
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # what its encoding lacks, as in LANG=C, ends no command
    app(prog_name="python -m harness")
