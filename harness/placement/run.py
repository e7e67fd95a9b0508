"""Runs a search for the best plan of fasteners and writes it: as a scene, as tables, and as a report.

The plan found, and the scene's own, are then series of load cases like any other, in DIRECTORY/plan and
DIRECTORY/own, on the scenes as a user would read them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from math import ceil, floor, log
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console
from rich.text import Text

from harness.measurement.scheduler import workers
from harness.placement.asked import PLANS, Asked
from harness.placement.candidates import Movable, Plan
from harness.placement.opponents import bisected, farthest_plans, uniform_plans
from harness.placement.search import Search, Step
from harness.placement.session import Study, distances
from harness.results import records
from harness.results.provenance import installed_version, provenance
from harness.scene.edited import edited, with_fasteners
from harness.series.run import run as run_series
from harness.series.session import Job
from harness.terminal import DONE, GAP_EXCEEDED
from harness.verification.judge import LIMIT_MM
from problems.build import prepared
from problems.errors import InputError
from problems.forms.assembly import Matrix
from problems.load_cases import LoadCases
from problems.model.scene import Scene
from problems.scene import read_scene

CONFIDENCE = 0.95  # that a share is shown
RECORD = "place.json"
SERIES_TOLERANCE = 1e-11

CasesOf = Callable[[Scene], LoadCases]


@dataclass(frozen=True)
class Goal:
    """The fewest fasteners with which at least `share` of the cases keep limit_mm, or the best `count`."""

    limit_mm: float | None
    share: float
    count: int | None

    def allowed(self, cases: int) -> int:
        """How many cases may fail. Raises InputError if so many cannot show the share."""
        if self.share < 1 and self.share**cases > 1 - CONFIDENCE:
            least = ceil(log(1 - CONFIDENCE) / log(self.share))
            allowed = f"{cases} cases cannot show it: take {least}, or a share of 1"
            raise InputError.one("--share", "share", self.share, allowed)
        return min(floor((1 - self.share) * cases + 1e-9), cases - 1)


@dataclass(frozen=True)
class Found:
    """steps : all plans that were kept. best : that of the goal; None if all candidates do not keep the
    limit. order : the plans while it is set, with 0, 1, … fasteners.
    """

    steps: list[Step]
    best: Step | None
    order: list[Step]


def run(
    source: str,
    movable: Movable,
    candidates: Plan,
    goal: Goal,
    cases_of: CasesOf,
    study: Study,
    facts: dict[str, Any],
    directory: Path,
    console: Console,
    scheduler: str | None,
) -> int:
    """Search, and write DIRECTORY. Returns 0, or 4 if no plan keeps the limit.

    facts : of the solver, for the series. The same command resumes what was interrupted. Raises InputError.
    """
    allowed = goal.allowed(study.cases.count)
    nodes = prepared(study.bare, form=study.form).assembly.contact_nodes
    assert nodes is not None  # of a joint
    with records.locked(directory, (), other=records.MEASUREMENTS):
        with _workers(scheduler, console) as where, _showing(console) as said:
            ask = Asked(study, directory / PLANS, _identity(study), where)
            search = Search(ask, nodes, study.cases.count, allowed, goal.limit_mm or 0.0, said)
            found = searched(search, movable, candidates, goal, lambda: _distances(study, candidates, where))
        plans = {"own": movable.own} | ({"plan": found.best.plan} if found.best else {})
        for name, plan in plans.items():
            path = directory / f"{name}.toml"
            records.replace_text(path, edited(source, directory, with_fasteners(plan)))
            scene = read_scene(str(path))
            limits = SERIES_TOLERANCE, LIMIT_MM, 0, study.threads
            job = Job(scene, cases_of(scene), "newton", study.form, *limits)
            run_series(job, facts, directory / name, console)
            pd.DataFrame(plan, columns=["x", "y"]).to_csv(directory / f"{name}.csv", index=False)
        record = _record(study, movable, candidates, goal, found, nodes)
        records.replace_object(directory / RECORD, record)
        from report.writers.place import write  # slow to import: not before the search

        console.print(f"Report: {write(directory)}")
        return _show(found, goal, nodes, console)


def searched(
    search: Search, movable: Movable, candidates: Plan, goal: Goal, apart: Callable[[], Matrix]
) -> Found:
    """All candidates, the scene's own plan, removal and exchange, the patterns and points to beat, the order.

    apart : gives the distances of the candidates.
    """
    steps = [search.whole(candidates, "all candidates")]
    if movable.own != candidates:
        steps.append(search.whole(movable.own, "own"))
    limit = goal.limit_mm
    if goal.count is None:
        assert limit is not None
        if steps[0].gap_mm > limit:
            return Found(steps, None, [])
        best, way = search.fewest(steps[0], candidates, limit)
        steps += way
    else:
        way, removal = [steps[0]], search.removal(steps[0])
        while len(way[-1].plan) > goal.count:
            way.append(next(removal))
        best = search.exchanged(way[-1], candidates, limit or 0.0)
        steps += [*way[1:], best]
    steps += _opponents(search, movable, candidates, goal, apart())
    order = [best, *search.removal(best)]
    return Found(steps, best, order[::-1])


def _opponents(
    search: Search, movable: Movable, candidates: Plan, goal: Goal, apart: Matrix
) -> Iterator[Step]:
    """Uniform patterns and farthest points: of as many fasteners, or the fewest that keep the limit."""
    families = {"uniform": uniform_plans(movable.bare, len(candidates) + 1)}
    families["farthest points"] = [farthest_plans(candidates, apart)]
    for name, family in families.items():
        for plans in family:
            if goal.count is None:
                assert goal.limit_mm is not None
                yield from bisected(plans, goal.limit_mm, partial(search.whole, moved=name))
            else:
                yield from search.wholes([plan for plan in plans if len(plan) == goal.count], name)


def _identity(study: Study) -> dict[str, Any]:
    return {
        "scene_key": study.bare.key,
        "fastener": study.fastener.model_dump(mode="json", include={"preload", "between"}),
        "cases_key": study.cases.key,
        "cases": study.cases.count,
        "form": study.form,
        "threads": study.threads,
        "rivetbench_version": installed_version("rivetbench"),
    }


def _record(
    study: Study, movable: Movable, candidates: Plan, goal: Goal, found: Found, nodes: Matrix
) -> dict[str, Any]:
    def step(each: Step) -> dict[str, Any]:
        limit = float("inf") if goal.limit_mm is None else goal.limit_mm
        return {
            "moved": each.moved,
            "fasteners": len(each.plan),
            "gap_mm": each.gap_mm,
            "failing": [k for k, gap in enumerate(each.outcome.largest) if gap > limit],
            "worst_case": each.worst,
            "worst_at": nodes[each.outcome.contact[each.worst]].tolist(),
            "plan": each.plan,
        }

    return {
        "scene": study.bare.name,
        "title": study.bare.title,
        "cases": study.cases.count,
        "preload": study.fastener.preload,
        "limit_mm": goal.limit_mm,
        "share": goal.share,
        "count": goal.count,
        "candidates": candidates,
        "own": movable.own,
        "steps": [step(each) for each in found.steps],
        "best": None if found.best is None else step(found.best),
        "order": [step(each) for each in found.order],
        **provenance(),
    }


def _show(found: Found, goal: Goal, nodes: Matrix, console: Console) -> int:
    """Print the outcome; returns the exit code."""
    of = f"in {goal.share:.4g} of the cases" if goal.share < 1 else "in every case"
    step = found.best or found.steps[0]
    fails = goal.limit_mm is not None and step.gap_mm > goal.limit_mm
    left = f"{len(step.plan)} fasteners leave at most {step.gap_mm:.3g} mm {of}, proven"
    if not fails:
        console.print(f"{left}.", style="green")
        return DONE
    x, y = nodes[step.outcome.contact[step.worst]]
    all_set = "all of the " if found.best is None else ""
    console.print(
        f"FAIL: {all_set}{left}, {step.gap_mm - (goal.limit_mm or 0.0):.3g} mm more than allowed; case "
        f"{step.worst} is the worst, at ({x:.4g}, {y:.4g}) mm.",
        style="red",
    )
    return GAP_EXCEEDED


def _distances(study: Study, places: Plan, where: tuple[Executor, int] | None) -> Matrix:
    if where is None:
        return distances((study, places))
    return where[0].submit(distances, (study, places)).result()


@contextmanager
def _workers(scheduler: str | None, console: Console) -> Iterator[tuple[Executor, int] | None]:
    if scheduler is None:
        yield None
        return
    with workers(scheduler) as (executor, count):
        console.print(f"{count} workers at {scheduler}")
        yield executor, count


@contextmanager
def _showing(console: Console) -> Iterator[Callable[[Step], None]]:
    """Shows each plan that is kept."""
    with console.status(Text("all candidates")) as status:
        kept = 0

        def said(step: Step) -> None:
            nonlocal kept
            kept += 1
            fasteners = f"{len(step.plan)} fasteners, {step.moved}: {step.gap_mm:.3g} mm"
            status.update(Text(f"{fasteners} ({kept} plans proven)"))

        yield said
