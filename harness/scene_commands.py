"""The commands for one scene: solve, validate, export, import."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .console import option, reported

app = typer.Typer(rich_markup_mode=None)

SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a scene, path of its .toml, or own matrices .npz.")
]
SAFE, INTERRUPTED = "", "Interrupted: nothing was written."


@app.command()
def solve(
    scene: SceneName,
    out: Annotated[Path, option("DIR", "Where the answer goes.")],
    solver: Annotated[
        str | None, option("NAME", "A solver by name.  [default: the active-set method of the references]")
    ] = None,
    tolerance: Annotated[float, option("TOL", "Tolerance handed to a named solver.", min=0.0)] = 1e-9,
) -> None:
    """Solve one scene: gaps, displacements and contact forces, as pictures and files.

    Without --solver the answer comes with a proven bound on its error; with one it is judged against that
    answer. A scene whose parts do not meet is a linear solve. What was computed, by which effect, and what
    was skipped stands in a ledger.

    \b
    Examples:
      python -m harness solve gallery/strip-on-tool --out results/strip
      python -m harness solve my-scene.toml --solver piqp --out results/mine

    \b
    Exit codes: 0 solved, 1 no answer or not within 1e-7 mm, 2 wrong usage or bad input.
    """
    with reported(SAFE, INTERRUPTED) as console:
        from .solve import solve as solve_scene

        raise typer.Exit(solve_scene(scene, solver, tolerance, out, console))


@app.command()
def validate(scene: SceneName) -> None:
    """Check a scene without solving it, and say what will be built, how large, and in about what time.

    \b
    Examples:
      python -m harness validate my-scene.toml

    \b
    Exit codes: 0 fine, 2 bad input.
    """
    with reported(SAFE, INTERRUPTED) as console:
        from .validate import validate as validate_scene

        validate_scene(scene, console)
