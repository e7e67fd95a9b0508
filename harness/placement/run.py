"""Runs a search for the best plan of fasteners and writes it: as a scene, as tables, and as a report.

The plan found, and the scene's own, are then series of load cases like any other, in DIRECTORY/plan and
DIRECTORY/own, on the scenes as a user would read them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import asdict, replace
from math import floor, log10
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from harness.measurement.scheduler import workers
from harness.placement.answer_journal import PLANS, Asked
from harness.placement.candidates import Movable, Plan
from harness.placement.fresh_cases import CONFIDENCE, Cases, Found, Goal, Sample, decided
from harness.placement.search import Search, Step
from harness.placement.session import THREADS, Study
from harness.results import records
from harness.results.provenance import installed_version, provenance
from harness.scene.scene_file import MOVED, edited, with_fasteners, with_gaps
from harness.series.run import run as run_series
from harness.series.session import Job
from harness.terminal import DONE, GAP_EXCEEDED
from harness.terminal.console import ConsoleReporter
from harness.verification.judge import LIMIT_MM
from problems.build import prepared
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import InitialGap
from problems.errors import InputError
from problems.forms.assembly import Matrix
from problems.load_cases import LoadCases
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.load_cases.random_gaps import RandomGaps
from problems.model.scene import JointScene, Scene
from problems.scene_files import read_scene, scene_of
from problems.storage import digest
from report.document.numbers import counted, position

RECORD = "place.json"
SERIES = ("own", "plan")
OUTPUTS = (RECORD, PLANS, *(f"{name}.{kind}" for name in SERIES for kind in ("toml", "csv")))
SERIES_TOLERANCE = 1e-11

CasesOf = Callable[[Scene], LoadCases]


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
    cases = Cases.of(study.cases.count, isinstance(study.cases, MeasuredGaps), goal)
    nodes = prepared(study.bare, form=study.form).assembly.contact_nodes
    assert nodes is not None  # of a joint

    law = _other_gaps(study.bare, study.cases)
    kinds = MOVED if law is None else (*MOVED, "initial_gap")

    def text_of(plan: Plan) -> str:
        def change(document: Any) -> None:
            with_fasteners(plan)(document)
            if law is not None:
                with_gaps(law)(document)

        return edited(source, directory, change, kinds)

    text_of(movable.own)  # refused now rather than after the search
    identity = _identity(study, movable.own, candidates, goal) | facts
    there = [name for name in (*OUTPUTS, *SERIES) if (directory / name).exists()]
    if there and PLANS not in there:
        allowed = f"has {there[0]} of another command: name another directory"
        raise InputError.one("--out", "directory", str(directory), allowed)
    if cases.table:
        console.print("Every second row is held back: it does not choose the plan, but says what it keeps.")
    with records.locked(directory, (), other=records.MEASUREMENTS):
        scene_of(tomllib.loads(text_of(movable.own)), str(directory / "own.toml"))  # as is refused at the end
        pool = workers(scheduler, console) if scheduler else nullcontext()
        reporter = ConsoleReporter(console, plain=True)
        with pool as where, reporter.step("search"):
            ask = Asked(study, directory / PLANS, identity, where)
            search = Search(ask, study.bare, nodes, candidates, 0, 0, goal.limit_mm or 0.0, reporter)

            def again(sample: Sample, more: int) -> None:
                words = f"{_kept(goal, sample)}: that is too few. The search goes on with {more} cases."
                console.print(words, style="yellow", soft_wrap=True)

            found = decided(search, movable.own, goal, cases, again)
        plans = {"own": movable.own} | ({"plan": found.best.plan} if found.best else {})
        for name, plan in plans.items():
            path = directory / f"{name}.toml"
            records.replace_text(path, text_of(plan))
            scene = read_scene(str(path))
            if law is not None and law.points is not None:  # a scene has a scan, or random gaps around it
                assert isinstance(scene, JointScene)
                scene = replace(scene, effects=(*study.bare.effects, *scene.effects_of(Fasteners)))
            made = cases_of(scene)
            if found.samples and isinstance(made, RandomGaps):  # those that decided, too
                made = replace(made, count=found.samples[-1].numbers[-1] + 1)
            job = Job(scene, made, "newton", study.form, SERIES_TOLERANCE, LIMIT_MM, 0, THREADS)
            run_series(job, facts, directory / name, console)
            pd.DataFrame(plan, columns=["x", "y"]).to_csv(directory / f"{name}.csv", index=False)
        words, code = _said(found, goal, nodes)
        record = _record(study, movable, candidates, goal, found, nodes)
        records.replace_object(directory / RECORD, record | {"said": words})
        from report.writers.place_report import write  # slow to import: not before the search

        console.print(f"Report: {write(directory)}")
        console.print(words, style="green" if code == DONE else "red", soft_wrap=True)
        return code


def _other_gaps(bare: JointScene, cases: LoadCases) -> RandomGaps | None:
    """The random gaps, if the scene's file says something else of them than these cases."""
    if not isinstance(cases, RandomGaps):
        return None
    but = {"random": {"seed"}}
    there = [each.model_dump(exclude=but) for each in bare.effects_of(InitialGap)]
    same = there == [cases.field.model_dump(exclude=but)]
    return None if same and cases.points is None else cases


def _identity(study: Study, own: Plan, candidates: Plan, goal: Goal) -> dict[str, Any]:
    """All that decides what is written, so that one directory holds one search."""
    holes = {"candidates": candidates, "the scene's fasteners": own}
    return {
        **asdict(goal),
        **{name: f"{counted(len(plan), 'place')}, hash {digest(plan)[:8]}" for name, plan in holes.items()},
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
    def step(each: Step, numbers: Sequence[int] = found.numbers) -> dict[str, Any]:
        limit = float("inf") if goal.limit_mm is None else goal.limit_mm
        return {
            "moved": each.moved,
            "fasteners": len(each.plan),
            "gap_mm": each.gap_mm,
            "failing": [numbers[k] for k, gap in enumerate(each.outcome.largest) if gap > limit],
            "worst_case": numbers[each.worst],
            "worst_at": nodes[each.outcome.contact[each.worst]].tolist(),
            "plan": each.plan,
        }

    return {
        "scene": study.bare.name,
        "title": study.bare.title,
        "cases": len(found.numbers),
        "chosen_by_share": 1 - goal.allowed(len(found.numbers)) / len(found.numbers),
        "preload": study.fastener.preload,
        **asdict(goal),
        "confidence": CONFIDENCE,
        "samples": [
            step(sample.step, sample.numbers)
            | {"cases": len(sample.numbers), "numbers": list(sample.numbers)}
            | {"kept": sample.kept, "interval": sample.interval}
            for sample in found.samples
        ],
        "candidates": candidates,
        "own": movable.own,
        "steps": [step(each) for each in found.steps],
        "best": None if found.best is None else step(found.best),
        "order": [step(each) for each in found.order],
        **provenance(),
    }


def _kept(goal: Goal, sample: Sample, which: str = "") -> str:
    """3 fasteners keep 0.12 mm in 96.7 % of 300 fresh cases (95 % interval 94.0 to 98.4 %)"""
    step, cases = sample.step, len(sample.numbers)
    plan = f"{which}{counted(len(step.plan), 'fastener')} {'keeps' if len(step.plan) == 1 else 'keep'}"
    digits = max(1, floor(1e-9 - log10(1 - goal.share))) if goal.share < 1 else 1
    share, low, high = (f"{100 * value:.{digits}f}" for value in (sample.kept / cases, *sample.interval))
    limit = f"{step.gap_mm:.3g}" if goal.limit_mm is None else f"{goal.limit_mm:g}"
    of = f"all {cases}" if sample.kept == cases > 1 else f"{share} % of {cases}"
    interval = f"{100 * CONFIDENCE:g} % interval {low} to {high} %"
    return f"{plan} {limit} mm in {of} {sample.what} ({interval})"


def _said(found: Found, goal: Goal, nodes: Matrix) -> tuple[str, int]:
    """The outcome in words, and the exit code."""
    which, count = "all of the " if found.best is None else "", len((found.best or found.steps[0]).plan)
    sample = found.samples[-1] if found.samples else None
    step = sample.step if sample else found.best or found.steps[0]
    if sample:
        left = _kept(goal, sample, which)
    else:
        leave = "leaves" if count == 1 else "leave"
        left = f"{which}{counted(count, 'fastener')} {leave} {step.gap_mm:.3g} mm in the one load case"
    if goal.limit_mm is None:
        return f"{left}, proven.", DONE
    if step.gap_mm <= goal.limit_mm:
        return f"PASS: {left}, proven.", DONE
    worst = step.worst if sample is None else sample.numbers[step.worst]
    place = position(*nodes[step.outcome.contact[step.worst]])
    if sample:
        share = f"{100 * goal.share:.4g} % of the cases" if goal.share < 1 else "every case"
        left += f"; in {share} it is {step.gap_mm:.3g} mm"
    more = f"{step.gap_mm - goal.limit_mm:.3g} mm more than allowed"
    return f"FAIL: {left}, {more}; case {worst} is the worst, at {place}.", GAP_EXCEEDED
