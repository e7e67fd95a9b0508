"""The command `place`: where fasteners go."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from . import options
from .options import option


@options.with_load_cases
def place(
    scene: options.SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    candidates: Annotated[
        str | None,
        option(
            "HOLES",
            "Rows x columns, as 4x32, or a CSV with x, y in mm, perhaps name.  [default: the scene's own]",
        ),
    ] = None,
    allow_gap: Annotated[
        float | None, option("MM", "Find the fewest fasteners that leave no larger gap.", min=0.0)
    ] = None,
    count: Annotated[int | None, option("N", "Find the best N fasteners instead.", min=1)] = None,
    share: options.Share = None,
    *,
    source: Callable[[], Any],
    scheduler: options.Scheduler = None,
) -> None:
    """Find the fewest fasteners that keep a gap limit in most load cases, or the best N, and their order.

    Fasteners of the scene's preload are chosen from candidate holes. The load cases are random or measured
    gaps, as in `series`; a scene without random gaps is one case. The share of cases in which a plan keeps
    the gap comes from fresh cases, not from those of the search; every gap is proven. DIR has the plan as a
    scene (plan.toml) and a table (plan.csv), and a report with the gap against the number of fasteners. Stop
    with Ctrl-C, run the same command again, and it continues.

    \b
    Examples:
      python -m harness place joint.toml --allow-gap 0.05 --out results/fewer
      python -m harness place joint.toml --candidates 4x32 --allow-gap 0.3 --cases 200 --out results/plan
      python -m harness place joint.toml --candidates holes.csv --count 12 --scheduler local:2 --out results/b

    \b
    Exit codes: 0 found, 2 wrong usage or bad input, 4 no plan is shown to keep --allow-gap, 130 interrupted.
    """
    with options.resumable(interrupted=options.TRIED) as console:
        from harness.placement.run import place as place_fasteners
        from harness.terminal.console import ConsoleReporter, show_verdict

        placement = place_fasteners(
            scene,
            out,
            candidates=candidates,
            allow_gap_mm=allow_gap,
            count=count,
            share=share,
            cases=source(),
            scheduler=scheduler,
            reporter=ConsoleReporter(console, plain=True),
        )
        console.print(f"Report: {placement.report}")
        kind = "pass" if placement.passed else "fail"
        raise typer.Exit(show_verdict(kind, [placement.sentence], console))
