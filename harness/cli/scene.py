"""The commands for one scene: solve, validate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from harness.terminal.console import AllowGap, FormName, ReferenceLimit, SceneName, error_reporting, option

app = typer.Typer(rich_markup_mode=None)

SAFE, INTERRUPTED = "", "Interrupted: nothing was written."


@app.command()
def solve(
    scene: SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    solver: Annotated[
        str | None, option("NAME", "A solver by name.  [default: the active-set method of the references]")
    ] = None,
    tolerance: Annotated[float, option("TOL", "Tolerance passed to a named solver.")] = 1e-9,
    form: Annotated[
        FormName | None,
        option("FORM", "primal, dual or sparse: without condensation.  [default: the cheaper one]"),
    ] = None,
    reference_limit: ReferenceLimit = None,
    allow_gap: AllowGap = None,
) -> None:
    """Solve one scene: gaps, displacements and contact forces, as pictures and files.

    Without --solver the answer comes with a proven bound on its error; with --solver it is judged against
    that answer. If the parts do not meet, this is a linear solve. A ledger lists what was computed, for which
    effect, and what was skipped.

    \b
    Examples:
      python -m harness solve gallery/heavy-sheet-on-tool --out results/sheet
      python -m harness solve my-scene.toml --solver piqp --out results/mine
      python -m harness solve my-scene.toml --allow-gap 0.05 --out results/mine

    \b
    Exit codes: 0 solved, 1 no answer or not within 1e-7 mm, 2 wrong usage or bad input,
                3 --allow-gap cannot be told from what is proven, 4 a gap is larger than --allow-gap.
    """
    with error_reporting(SAFE, INTERRUPTED) as console:
        from harness.scene.solve import solve as solve_scene

        taken: Any = form.value if form else None
        code = solve_scene(scene, solver, tolerance, out, console, reference_limit, taken, allow_gap)
        raise typer.Exit(code)


@app.command()
def validate(scene: SceneName) -> None:
    """Check a scene without solving it; show what would be built, its size, and the approximate time.

    \b
    Examples:
      python -m harness validate my-scene.toml

    \b
    Exit codes: 0 valid, 2 bad input.
    """
    with error_reporting(SAFE, INTERRUPTED) as console:
        from harness.scene.validate import validate as validate_scene

        validate_scene(scene, console)
