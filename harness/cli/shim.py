"""The command `shim`: what goes between the parts."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from . import options
from .options import option

CSV = "x_min, x_max, y_min, y_max in mm, or outlines: name, x, y"


@options.with_load_cases
def shim(
    scene: options.SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    allow_gap: Annotated[float, option("MM", "The largest gap allowed after fastening.")],
    stock: Annotated[str, option("MM", "Thicknesses: 0.2,0.3,0.5, or FIRST:LAST:STEP, as 0.05:1.0:0.05.")],
    patches: Annotated[
        str | None, option("PATCHES", f"Columns x rows, as 8x1, or a CSV with {CSV}.  [default: by the gap]")
    ] = None,
    allow_force: Annotated[float | None, option("N", "The largest force allowed in a fastener.")] = None,
    allow_stress: Annotated[
        float | None, option("MPA", "The largest von Mises stress allowed, N/mm².")
    ] = None,
    taper: Annotated[
        bool, typer.Option("--taper", help="A thickness of the stock at each end of a patch's longer side.")
    ] = False,
    share: options.Share = None,
    each: Annotated[
        bool, typer.Option("--each", help="Each case has shims of its own: what stock do all of them need?")
    ] = False,
    *,
    source: Callable[[], Any],
    scheduler: options.Scheduler = None,
) -> None:
    """Find the fewest shims from a stock, then the least volume, that keep a gap limit after fastening.

    The load cases are random or measured gaps, as in `series`; a scene without random gaps is one case. For
    many, one set of shims is found, and fresh cases say in what share of all it keeps the limits; each gap is
    proven. DIR has the scene with shims (shimmed.toml), their table and drawing (shims.csv, shims.png), and a
    report. Stop with Ctrl-C, run the same command again, and it continues.

    \b
    Examples:
      python -m harness shim joint.toml --allow-gap 0.1 --stock 0.2,0.3,0.5 --patches 8x1 --out results/shims
      python -m harness shim joint.toml --allow-gap 0.1 --stock 0.05:1.0:0.05 --gaps g.csv --out results/many

    \b
    Exit codes: 0 found, 2 wrong usage or bad input, 4 no shims are shown to keep the limits, 130 interrupted.
    """
    with options.resumable(interrupted=options.TRIED) as console:
        from harness.shimming.shim_run import shim as find_shims
        from harness.terminal.console import ConsoleReporter, show_verdict

        shims = find_shims(
            scene,
            out,
            allow_gap_mm=allow_gap,
            stock=stock,
            patches=patches,
            allow_force=allow_force,
            allow_stress=allow_stress,
            share=share,
            each=each,
            taper=taper,
            cases=source(),
            scheduler=scheduler,
            reporter=ConsoleReporter(console, plain=True),
        )
        console.print(f"Report: {shims.report}")
        kind = "pass" if shims.passed else "fail"
        raise typer.Exit(show_verdict(kind, [shims.sentence], console))
