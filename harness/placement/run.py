"""Runs a search for the best plan of fasteners and writes it: as a scene, as tables, and as a report.

The plan found, and the scene's own, are then series of load cases like any other, in DIRECTORY/plan and
DIRECTORY/own, on the scenes as a user would read them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from itertools import count, islice
from math import ceil, floor, log
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from harness.measurement.scheduler import workers
from harness.placement.asked import PLANS, Asked
from harness.placement.candidates import Movable, Plan
from harness.placement.search import Search, Step, Values
from harness.placement.session import THREADS, Study
from harness.results import records
from harness.results.provenance import installed_version, provenance
from harness.scene.edited import MOVED, edited, with_fasteners
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
from problems.storage import digest

CONFIDENCE = 0.95  # that a share is shown
RECORD = "place.json"
SERIES = ("own", "plan")
OUTPUTS = (RECORD, PLANS, *(f"{name}.{kind}" for name in SERIES for kind in ("toml", "csv")))
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
    """best : None if all candidates do not keep the limit. order : the plans with 0, 1, … fasteners set."""

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

    def text_of(plan: Plan) -> str:
        return edited(source, directory, with_fasteners(plan), MOVED)

    text_of(movable.own)  # refused now rather than after the search
    identity = _identity(study, movable.own, candidates, goal) | facts
    there = [name for name in (*OUTPUTS, *SERIES) if (directory / name).exists()]
    if there and PLANS not in there:
        allowed = f"has {there[0]} of another command: name another directory"
        raise InputError.one("--out", "directory", str(directory), allowed)
    with records.locked(directory, (), other=records.MEASUREMENTS):
        pool = workers(scheduler, console) if scheduler else nullcontext()
        with pool as where, _showing(console) as said:
            ask = Asked(study, directory / PLANS, identity, where)
            limit_mm = goal.limit_mm or 0.0
            search = Search(ask, study.bare, nodes, candidates, study.cases.count, allowed, limit_mm, said)
            found = searched(search, movable.own, goal)
        plans = {"own": movable.own} | ({"plan": found.best.plan} if found.best else {})
        for name, plan in plans.items():
            path = directory / f"{name}.toml"
            records.replace_text(path, text_of(plan))
            scene = read_scene(str(path))
            job = Job(scene, cases_of(scene), "newton", study.form, SERIES_TOLERANCE, LIMIT_MM, 0, THREADS)
            run_series(job, facts, directory / name, console)
            pd.DataFrame(plan, columns=["x", "y"]).to_csv(directory / f"{name}.csv", index=False)
        words, code = _said(found, goal, nodes)
        record = _record(study, movable, candidates, goal, found, nodes)
        records.replace_object(directory / RECORD, record | {"said": words})
        from report.writers.place import write  # slow to import: not before the search

        console.print(f"Report: {write(directory)}")
        console.print(words, style="green" if code == DONE else "red")
        return code


def searched(search: Search, own: Plan, goal: Goal) -> Found:
    """All candidates, the scene's own plan, uniform patterns, removal and exchange, the order."""
    steps = [search.whole(search.candidates, "all candidates")]
    if own != search.candidates:
        steps.append(search.whole(own, "own"))
    if goal.count is None:
        if steps[0].gap_mm > search.limit_mm:
            return Found(steps, None, [])
        best, way = search.fewest(steps[0])
        steps += [*way, *search.uniform()]
    else:
        before: Values = {}
        more = len(search.candidates) - goal.count
        steps += (way := list(islice(search.removal(steps[0], before), max(more - 1, 0))))
        best = [steps[0], *way][-1]
        if more:
            steps.append(best := search.fewer(best, before)[0])
        steps += search.wholes(search.even(goal.count), "uniform")
    order = [best, *search.removal(best, {})]
    return Found(steps, best, order[::-1])


def _identity(study: Study, own: Plan, candidates: Plan, goal: Goal) -> dict[str, Any]:
    """All that decides what is written, so that one directory holds one search."""
    holes = {"candidates": candidates, "the scene's fasteners": own}
    return {
        **asdict(goal),
        **{name: f"{_counted(len(plan), 'place')}, hash {digest(plan)[:8]}" for name, plan in holes.items()},
        "scene_key": study.bare.key,
        "fastener": study.fastener.model_dump(mode="json", include={"preload", "between"}),
        "cases_key": study.cases.key,
        "cases": study.cases.count,
        "form": study.form,
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
        **asdict(goal),
        "candidates": candidates,
        "own": movable.own,
        "steps": [step(each) for each in found.steps],
        "best": None if found.best is None else step(found.best),
        "order": [step(each) for each in found.order],
        **provenance(),
    }


def _said(found: Found, goal: Goal, nodes: Matrix) -> tuple[str, int]:
    """The outcome in words, and the exit code."""
    of = f"in {100 * goal.share:.4g} % of the cases" if goal.share < 1 else "in every case"
    step = found.best or found.steps[0]
    count = len(step.plan)
    leave = "1 fastener leaves" if count == 1 else f"{count} fasteners leave"
    left = f"{leave} at most {step.gap_mm:.3g} mm {of}, proven"
    if goal.limit_mm is None or step.gap_mm <= goal.limit_mm:
        return f"{left}.", DONE
    x, y = nodes[step.outcome.contact[step.worst]]
    all_set = "all of the " if found.best is None else ""
    more = f"{step.gap_mm - goal.limit_mm:.3g} mm more than allowed"
    worst = f"case {step.worst} is the worst, at ({x:.4g}, {y:.4g}) mm"
    return f"FAIL: {all_set}{left}, {more}; {worst}.", GAP_EXCEEDED


def _counted(number: int, word: str) -> str:
    return f"{number} {word}{'s' * (number != 1)}"


@contextmanager
def _showing(console: Console) -> Iterator[Callable[[Step], None]]:
    """Shows each plan that is kept, as a line of its own if the console is no terminal."""
    with console.status("all candidates") as status:
        numbers = count(1)

        def said(step: Step) -> None:
            proven = _counted(next(numbers), "plan")
            plan = f"{_counted(len(step.plan), 'fastener')}, {step.moved}"
            line = f"{plan}: {step.gap_mm:.3g} mm ({proven} proven)"
            if console.is_terminal:
                status.update(line)
            else:
                console.print(line)

        yield said
