"""The command `place`: where fasteners go."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from . import options
from .options import error_reporting, option

if TYPE_CHECKING:
    from problems.load_cases import LoadCases
    from problems.model.scene import Scene


def place(
    scene: options.SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    candidates: Annotated[
        str | None,
        option("HOLES", "Rows x columns, as 4x32, or a CSV with x and y in mm.  [default: the scene's own]"),
    ] = None,
    allow_gap: Annotated[
        float | None, option("MM", "Find the fewest fasteners that leave no larger gap.", min=0.0)
    ] = None,
    count: Annotated[int | None, option("N", "Find the best N fasteners instead.", min=1)] = None,
    share: Annotated[
        float | None,
        option("SHARE", "Of the cases that must keep it.  [default: 0.95; of one, 1]", min=0.01, max=1.0),
    ] = None,
    cases: options.Cases = None,
    seed: options.Seed = None,
    mean: options.Mean = None,
    sd: options.Spread = None,
    correlation_length: options.Length = None,
    around: options.Around = None,
    gaps: options.Gaps = None,
    scheduler: options.Scheduler = None,
) -> None:
    """Find the fewest fasteners that keep a gap in most load cases, or the best N, and their order.

    Fasteners of the scene's preload are chosen from candidate holes. The load cases are random or measured
    gaps, as of `series`; a scene without random gaps is one case. In what share of the cases a plan keeps the
    gap is said of fresh ones, which did not choose it; every gap is proven. DIR has the plan as a scene
    (plan.toml) and a table (plan.csv), and a report with the gap against the number of fasteners. Stop with
    Ctrl-C, run the same command again, and it continues.

    \b
    Examples:
      python -m harness place joint.toml --allow-gap 0.05 --out results/fewer
      python -m harness place joint.toml --candidates 4x32 --allow-gap 0.3 --cases 200 --out results/plan
      python -m harness place joint.toml --candidates holes.csv --count 12 --scheduler local:2 --out results/b

    \b
    Exit codes: 0 found, 2 wrong usage or bad input, 4 no plan is shown to keep --allow-gap, 130 interrupted.
    """
    with error_reporting(
        interrupted="Interrupted. What was tried is kept: run the same command again."
    ) as console:
        from harness.measurement.solver_descriptions import described
        from harness.placement.candidates import Movable
        from harness.placement.fresh_cases import Goal
        from harness.placement.run import OUTPUTS, run
        from harness.placement.session import Study
        from harness.planning.form_choice import chosen_form
        from harness.results.atomic_output import refuse_inputs
        from harness.scene.allowed_gap import refuse_unusable
        from harness.scene.validate import print_unusual
        from harness.series.load_case_source import RANDOM, GivenCases
        from harness.terminal.console import ConsoleReporter
        from problems.build import load_case
        from problems.effects.initial_gap import InitialGap
        from problems.errors import Fault, InputError
        from problems.load_cases import Listed
        from problems.scene_files import read_scene

        signal.signal(signal.SIGTERM, signal.default_int_handler)
        refuse_unusable(allow_gap)
        inputs = [Path(each) for each in (scene, candidates, around, gaps) if each]
        refuse_inputs([out / name for name in OUTPUTS], inputs)
        read = read_scene(scene)
        movable = Movable.of(read)
        holes = movable.candidates(candidates)
        given = GivenCases(cases, seed, mean, sd, correlation_length, around, gaps)
        faults = given.faults()
        if allow_gap is None and count is None:
            faults.append(Fault("place", "goal", None, "--allow-gap MM, or --count N"))
        if count is not None and count > len(holes):
            faults.append(Fault("--count", "N", count, f"at most {len(holes)}, the candidates"))
        if faults:
            raise InputError(faults)
        one = not (gaps or given.drawn or cases) and not any(
            each.random for each in movable.bare.effects_of(InitialGap)
        )
        total = 1 if one else cases or RANDOM
        (made,) = described([("newton", {})], None, "--solver", ConsoleReporter(console))
        choice = chosen_form(movable.bare, made.forms, None, total * len(holes))

        def cases_of(of: Scene) -> LoadCases:
            return Listed((load_case(of, choice.form),)) if one else given.of(of, choice.form)

        bare = cases_of(movable.bare)
        print_unusual(movable.bare, console, bare.notes)
        share = share if share is not None else (1.0 if bare.count == 1 else 0.95)
        study = Study(movable.bare, movable.fastener, bare, choice.form)
        facts = {"solver_version": made.version, "solver_code": made.code}
        goal = Goal(allow_gap, share, count)
        raise typer.Exit(run(scene, movable, holes, goal, cases_of, study, facts, out, console, scheduler))
