"""The command line: its commands, in the order of the help, and those for solvers: check, list.

Modules that are slow to import are imported inside the commands.
"""

import gc
import sys
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated, Literal

import typer

from harness.terminal.docstrings import docstring

from .compare import compare, merge
from .exchange import export, import_, judge
from .explore import explore
from .options import NOTHING_WRITTEN, MemoryLimit, Plugin, error_reporting, option, resumable
from .place import place
from .scene import init, solve, validate
from .series import series
from .shim import shim
from .suite import gate, report, run
from .tolerance import tolerance

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)


def _show_version(asked: bool) -> None:
    if asked:
        from harness.results.provenance import provenance
        from problems import __version__

        typer.echo(f"rivetbench {__version__}, commit {provenance()['commit']}")
        raise typer.Exit


Version = typer.Option("--version", help="The version and the commit.", callback=_show_version, is_eager=True)


def harness(version: Annotated[bool, Version] = False) -> None:
    """Compare quadratic-programming solvers on aircraft riveting problems.

    \b
    Start here:
      python -m harness run                       measure the suite `default` (8 minutes) and report on it
      python -m harness run --size 4386           the small problems only
      python -m harness list solvers              what can be measured
      python -m harness run --plugin mine.py      with a solver of your own
      python -m harness init joint.toml           a commented scene to start from
      python -m harness solve scene.toml --out d  one scene: gaps, displacements, forces, with pictures
      python -m harness series SCENE --out DIR    thousands of load cases on one assembly
      python -m harness place --help              the fewest fasteners that keep a gap limit
      python -m harness shim --help               the fewest shims that keep a gap limit
      python -m harness tolerance --help          how far a key may go
      python -m harness explore SCENE             a page on which fasteners move
      python -m harness compare OLD NEW           what became worse between two runs
      python -m harness COMMAND --help            help on each command

    \b
    Exit codes: 0 ok, 1 accuracy lost, 2 wrong usage or bad input, 3 nothing could be judged,
                4 gap or stress too large, 5 inputs that do not belong together, 130 interrupted.
    """


def check(
    solver: Annotated[list[str] | None, option("NAME", "A solver by name. Repeatable.")] = None,
    plugin: Plugin = None,
    time_limit: Annotated[
        float, option("SECONDS", "Time limit for each test problem in each form.", min=0.001)
    ] = 60.0,
    memory_limit: MemoryLimit = 8192,
) -> None:
    """Test solvers on small problems with known answers, and say what is wrong with them.

    Each solver runs in a process of its own, stopped at its time or memory limit.

    \b
    Examples:
      python -m harness check --plugin mine.py
      python -m harness check --solver ipm --solver gi

    \b
    Exit codes: 0 nothing found, 1 faults found, 2 wrong usage or bad input.
    """
    with resumable(interrupted="Interrupted.") as console:
        from harness.conformance.isolated import run as run_checks
        from problems.errors import InputError
        from solvers.plugin import unused
        from solvers.registry import modules

        names = solver or ([plugin.stem] if plugin else list(modules()))
        if faults := unused(plugin, names):
            raise InputError(faults)
        raise typer.Exit(run_checks(names, plugin, time_limit, memory_limit, console))


def list_(what: Literal["solvers", "scenes", "suites", "formats"]) -> None:
    """List the available solvers, scenes, suites or file formats.

    \b
    Examples:
      python -m harness list solvers
      python -m harness list scenes
    """
    with error_reporting() as console:
        from .listing import listing

        console.print(listing(what))


def schema(
    what: Literal["scene", "suite", "row"],
    out: Annotated[Path | None, option("FILE", "Write it there.  [default: print it]")] = None,
) -> None:
    """Write the JSON schema of a scene, of a suite, or of a row of measurements.jsonl, for an editor.

    \b
    Example:
      python -m harness schema scene --out scene.schema.json
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.planning.json_schema import schema_of
        from harness.results.atomic_output import atomic_output
        from harness.results.records import to_line

        text = to_line(schema_of(what))
        if out is None:
            console.print(text, soft_wrap=True)
            return
        with atomic_output(out) as new:
            new.write_text(f"{text}\n", "utf-8")


app.callback(help=docstring(harness))(harness)
Command = Callable[..., None]
ONE_SCENE: list[Command] = [init, validate, solve, series, tolerance, place, shim, explore]
OTHERS: list[Command] = [run, report, gate, compare, merge, check, list_, schema, export, import_, judge]
for command in ONE_SCENE + OTHERS:
    app.command(command.__name__.strip("_"), help=docstring(command))(command)


def main() -> None:
    gc.set_threshold(5000)  # importing makes many objects and no garbage
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # what its encoding lacks, as in LANG=C, ends no command
    app(prog_name="python -m harness")
