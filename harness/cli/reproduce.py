"""The command `reproduce`: one published row measured again."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer

from harness.terminal.console import Plugin, error_reporting

app = typer.Typer(rich_markup_mode=None)

MAX_DIGITS_LOST = 1.0


@app.command()
def reproduce(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory that `run` wrote.")],
    key: Annotated[
        list[str], typer.Argument(metavar="KEY...", help="A row's key, or words of one key alone.")
    ],
    plugin: Plugin = None,
) -> None:
    """Measure one row of a results directory again, and show then and now side by side.

    The scene, solver, options, form, tolerance, threads and limits are those of the row; nothing is written.
    Times can be compared on the same machine only.

    \b
    Examples:
      python -m harness reproduce results/published/scaling scaling/1170 newton dual
      python -m harness reproduce results/default 4386/0107 gi dual tol=1e-10

    \b
    Exit codes: 0 reproduced, 1 another verdict, or more than a digit of the error lost,
                2 wrong usage or bad input, 5 the scene is another problem now, 130 interrupted.
    """
    with error_reporting(interrupted="Interrupted.") as console:
        from harness.measurement.reproduce import reproduce as measure_again
        from harness.results.digits import digits_lost, floor_mm
        from harness.results.machine import machine
        from harness.results.schema import VERDICTS
        from harness.terminal.exit_codes import DONE, FAILED
        from harness.terminal.then_and_now import then_and_now
        from harness.terminal.waiting import waiting

        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with waiting(console) as show:
            found = measure_again(directory, key, plugin, show)
        then, now = found.then, found.now
        console.print(then_and_now(then, now))
        if then.get("machine") != machine()["machine"]:
            console.print("Times are not comparable: that was another machine.", style="dim")
        if found.moved_mm is not None:
            console.print(
                f"The displacements differ by {found.moved_mm:.2e} mm at most from those saved then."
            )
        lost = 0.0
        before, after = then.get("displacement_error_mm"), now["displacement_error_mm"]
        if before is not None and after is not None:
            bound = max(then.get("reference_bound_mm") or 0.0, now["reference_bound_mm"] or 0.0)
            lost = digits_lost(before, after, floor_mm(bound, now["limit_mm"]))
        worse = VERDICTS.index(now["verdict"]) > VERDICTS.index(then["verdict"]) or lost > MAX_DIGITS_LOST
        text = f"Not reproduced: {then['verdict']} then, {now['verdict']} now, {lost:+.1f} digits lost."
        console.print(text if worse else "Reproduced.", style="red" if worse else "green")
        raise typer.Exit(FAILED if worse else DONE)
