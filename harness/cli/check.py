"""The command `check`: does a solver keep its contract?"""

from __future__ import annotations

import signal
from typing import Annotated

import typer

from .options import MemoryLimit, Plugin, error_reporting, option

app = typer.Typer(rich_markup_mode=None)


@app.command()
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
    with error_reporting(interrupted="Interrupted.") as console:
        from harness.conformance.isolated import run as run_checks
        from solvers.registry import modules

        signal.signal(signal.SIGTERM, signal.default_int_handler)
        names = solver or ([plugin.stem] if plugin else list(modules()))
        raise typer.Exit(run_checks(names, plugin, time_limit, memory_limit, console))
