"""What commands share: arguments, and user errors shown as red lines with an exit code."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial, update_wrapper
from inspect import Signature, signature
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from harness.terminal import INTERRUPTED, NOT_COMPARABLE, WRONG_USAGE

if TYPE_CHECKING:
    from rich.console import Console

NOTHING_WRITTEN = ("", "Interrupted: nothing was written.")
TRIED = "Interrupted. What was tried is kept: run the same command again."
WIDTH_OF_A_LOG = 160
MOST_FAULTS = 100  # shown at once
LONGEST_LINE = 200  # characters of a file quoted in a message


def option(metavar: str, help: str, *names: str, **limits: Any) -> Any:
    callback = _refuse_nan if limits else None
    return typer.Option(*names, metavar=metavar, help=help, callback=callback, **limits)


def _refuse_nan(value: Any) -> Any:
    """The value of an option with limits, none of which stops NaN."""
    if isinstance(value, float) and isnan(value):
        raise typer.BadParameter("nan is no number")
    return value


FormName = Literal["primal", "dual", "sparse"]
SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a scene, path of its .toml, or .npz with matrices.")
]
Plugin = Annotated[Path | None, option("FILE", "Python file with your own solver.")]
MemoryLimit = Annotated[int, option("MIB", "Memory limit, over all processes of the solver.", min=1)]
ReferenceLimit = Annotated[
    float | None,
    option(
        "SECONDS",
        "Limit on the search for each reference.  [default: 60 per thousand contacts, at least 60]",
        min=0.001,
    ),
]
AllowStress = Annotated[
    float | None, option("MPA", "Fail if a von Mises stress is larger than this, N/mm².", min=0.0)
]
AllowGap = Annotated[
    float | None, option("MM", "Fail if a remaining gap is larger than this, and say where.", min=0.0)
]
Cases = Annotated[
    int | None,
    option("N", "Number of cases.  [default: 100 random ones; all of a table]", min=1, max=10**7),
]
Seed = Annotated[int | None, option("SEED", "Seed of the random gaps.  [default: 0]", min=0)]
Scheduler = Annotated[
    str | None, option("WHERE", "Dask: local:N for N local workers, or the address of a scheduler.")
]
Share = Annotated[
    float | None,
    option(
        "SHARE",
        "Share of the cases that must keep the limits.  [default: 0.95; 1 of a single case]",
        min=0.01,
    ),
]
Resolution = Annotated[
    float | None, option("SHARE", "Step between values, as a share of the range.  [default: 0.01]")
]


def _load_cases(
    cases: Cases = None,
    seed: Seed = None,
    mean: Annotated[float | None, option("MM", "Mean of the random gaps.  [default: the scene's]")] = None,
    sd: Annotated[
        float | None, option("MM", "Standard deviation of the random gaps.  [default: the scene's]")
    ] = None,
    correlation_length: Annotated[
        float | None, option("MM", "Correlation length of the random gaps.  [default: the scene's]")
    ] = None,
    around: Annotated[
        Path | None, option("FILE", "A scan, CSV with x, y, gap in mm, that the random gaps pass through.")
    ] = None,
    gaps: Annotated[
        Path | None,
        option("FILE", "Measured gaps, .csv .npz .npy: one row per case, one column per contact, mm."),
    ] = None,
    scans: Annotated[
        str | None,
        option("FILES", "Scans of many joints, as 'scans/*.csv': gaps vary by their principal modes."),
    ] = None,
    variance: Annotated[
        float | None, option("SHARE", "Share of the scans' variance that the modes keep.  [default: 0.99]")
    ] = None,
    random: Annotated[
        list[str] | None,
        option("KEY=LAW", "A random key, as fasteners.preload='normal(1000, 100)'. Repeatable."),
    ] = None,
    columns: Annotated[
        str | None,
        option("HEADINGS", "Headings of x, y and gap in FILE, as 'Pos X,Pos Y,Gap'.  [default: x,y,gap]"),
    ] = None,
    missing: Annotated[
        list[str] | None, option("MARK", "Mark of a missing gap in FILE, as 9999. Repeatable.")
    ] = None,
) -> Any:
    from harness.series.load_case_source import GapCases
    from problems.input.tables import TableOptions

    headings = tuple(heading.strip() for heading in columns.split(",")) if columns else ()
    tables = TableOptions(headings, tuple(missing or ()))
    sources = around, gaps, tables, tuple(random or ()), None, scans, variance
    return GapCases(cases, seed, mean, sd, correlation_length, *sources)


def with_load_cases(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the options of load cases in place of its argument `source`, which makes GapCases of
    them.
    """
    shared, own = (signature(some, eval_str=True).parameters for some in (_load_cases, command))
    in_turn = [shared.values() if name == "source" else [one] for name, one in own.items()]
    whole = Signature([one for some in in_turn for one in some])

    def run(*arguments: Any, **words: Any) -> None:
        values = whole.bind(*arguments, **words)
        values.apply_defaults()
        source = partial(_load_cases, **{name: values.arguments.pop(name) for name in shared})
        command(**values.arguments, source=source)

    update_wrapper(run, command, assigned=("__module__", "__name__", "__qualname__", "__doc__"))
    run.__dict__["__signature__"] = whole
    run.__annotations__ = {name: parameter.annotation for name, parameter in whole.parameters.items()}
    return run


@contextmanager
def error_reporting(
    safe: str = "; rows already written are safe, run again to continue",
    interrupted: str = "Interrupted. The rows so far are kept: run the same command again to continue.",
) -> Iterator[Console]:
    """A console; each user error becomes a red line and an exit code, not a traceback."""
    from harness.results.comparison import Incomparable
    from harness.terminal.console import PlainConsole
    from problems.errors import InputError

    errors = PlainConsole(stderr=True, soft_wrap=True)
    try:
        yield PlainConsole(width=None if sys.stdout and sys.stdout.isatty() else WIDTH_OF_A_LOG)
    except InputError as error:
        for fault in error.faults[:MOST_FAULTS]:
            errors.print(str(fault), style="red")
        if (more := len(error.faults) - MOST_FAULTS) > 0:
            errors.print(f"… and {more} more", style="red")
        raise typer.Exit(NOT_COMPARABLE if isinstance(error, Incomparable) else WRONG_USAGE) from None
    except UnicodeEncodeError as error:
        where = error.object.count("\n", 0, error.start)
        line = error.object.split("\n")[where][:LONGEST_LINE]
        errors.print(f"{line}: a name that is not UTF-8 cannot be written: rename the file", style="red")
        raise typer.Exit(WRONG_USAGE) from None
    except (OSError, MemoryError) as error:
        why = "Not enough memory: " if isinstance(error, MemoryError) else ""
        errors.print(f"{why}{error}{safe}", style="red")
        raise typer.Exit(WRONG_USAGE) from None
    except KeyboardInterrupt:
        errors.print(interrupted, style="yellow")
        raise typer.Exit(INTERRUPTED) from None


@contextmanager
def resumable(**words: str) -> Iterator[Console]:
    """As `error_reporting`, of work that the same command continues; SIGTERM interrupts it as Ctrl-C does."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with error_reporting(**words) as console:
        yield console
