"""Searches for shims and writes them: as a scene, a table and a drawing, and as a report."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from harness.measurement.scheduler import workers
from harness.placement.answer_journal import AnswerJournal, refuse_other_command
from harness.placement.fresh_cases import Cases, Found, Goal, search_in_rounds
from harness.placement.run import HELD_BACK, other_gaps
from harness.planning.form_choice import chosen_form
from harness.results import records
from harness.results.atomic_output import refuse_inputs
from harness.results.provenance import installed_version, provenance
from harness.scene.allowed_gap import check_answer
from harness.scene.fastener_forces import fastener_forces
from harness.scene.mesh_error import estimated, mesh_record
from harness.scene.scene_file import edited
from harness.scene.solution import solve
from harness.scene.stress import refuse_unusable
from harness.series.load_case_source import DEFAULT, RANDOM, GapCases
from harness.solving.call_lock import keeps_threads
from harness.terminal.console import console_of
from problems.build import load_case
from problems.effects.shims import Shims
from problems.errors import Fault, InputError
from problems.load_cases import Listed
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.model.effect import SpringEffect
from problems.model.positions import FORCES
from problems.model.scene import JointScene
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene
from problems.storage import digest
from report.document.numbers import counted

from .patches import patches_of, stock_of
from .search import ShimSearch, ShimStudy

RECORD, ANSWERS = "shim.json", "shims.jsonl"
MOST = 1e9  # of a limit: larger ones are none
OUTPUTS = (RECORD, ANSWERS, "shimmed.toml", "report.md", "shims.csv", "shims.png", "forces.csv")


@dataclass(frozen=True)
class Shimming:
    """The outcome of `shim`.

    Parameters
    ----------
    shims : dict of str to float
        The thickness of each shim by the name of its patch, mm.
    passed : bool
        Whether the shims are shown to keep the limits.
    sentence : str
        The outcome in words.
    report : Path
        The report, in Markdown.
    """

    shims: dict[str, float]
    passed: bool
    sentence: str
    report: Path


@keeps_threads
def shim(
    scene: str | Path,
    out: str | Path,
    *,
    allow_gap_mm: float,
    stock: str,
    patches: str | Path | None = None,
    allow_force: float | None = None,
    allow_stress: float | None = None,
    share: float | None = None,
    cases: GapCases = DEFAULT,
    scheduler: str | None = None,
    reporter: Reporter = SILENT,
) -> Shimming:
    """Find the fewest shims from a stock, then the least, with which the gap after fastening keeps a limit.

    Parameters
    ----------
    scene : str or Path
        Name of a scene, or the path of its file, with fasteners.
    out : str or Path
        Directory for what is written, and the answers so far: the same call continues an interrupted search.
    allow_gap_mm : float
        The largest gap allowed, mm.
    stock : str
        Thicknesses, mm: "0.2,0.3,0.5", or "0.05:1.0:0.05" from the first to the last by steps.
    patches : str or Path, optional
        Columns x rows, as "8x1", or a CSV with columns x_min, x_max, y_min, y_max, mm, and perhaps name; by
        default 16 cells of the junction, about square.
    allow_force, allow_stress : float, optional
        The largest force in a fastener, N, and von Mises stress in a part, N/mm².
    share : float, optional
        Share of the load cases that must keep all limits; by default 0.95, of a single case 1.
    cases : GapCases, optional
        The load cases; by default 100 with random gaps, or the scene alone if its gaps are not random.
    scheduler : str, optional
        Dask workers: local:N, or the address of a scheduler; by default this process.
    reporter : Reporter, optional
        Is told each plan that is kept; silent by default.

    Returns
    -------
    Shimming
        The shims, and whether they are shown to keep the limits.

    Raises
    ------
    InputError
        If an input is wrong, or `out` holds another search.

    Examples
    --------
    >>> from rivetbench import GapCases, shim
    >>> cases = GapCases(count=1)
    >>> found = shim("examples/small-joint.toml", "shims", allow_gap_mm=0.3, stock="0.2,0.4", cases=cases)
    >>> found.passed
    True
    """
    source, directory, bare = str(scene), Path(out), read_scene(str(scene))
    inputs = [Path(file) for file in (scene, patches, *cases.files) if file]
    refuse_inputs([directory / name for name in OUTPUTS], inputs)
    asked: dict[str, Any] = {
        "limit_mm": allow_gap_mm,
        "allow_force": allow_force,
        "allow_stress": allow_stress,
        "share": share,
    }
    faults, thicknesses = cases.faults() + _faults(bare, asked), tuple[float, ...]()
    try:
        thicknesses = stock_of(stock)
    except InputError as error:
        faults += error.faults
    if faults or not isinstance(bare, JointScene):
        raise InputError(faults)
    if allow_stress is not None:
        refuse_unusable(allow_stress, bare)
    single = cases.are_one(bare)
    form = chosen_form(bare, ("dual", "sparse"), None, 1 if single else cases.count or RANDOM).form
    made = Listed((load_case(bare, form),)) if single else cases.of(bare, form)
    for sentence in (*bare.unusual, *made.notes):
        reporter.say(sentence)
    goal = Goal.of(made.count, allow_gap_mm, share)
    order = Cases.of(made.count, isinstance(made, MeasuredGaps), goal)
    there = patches_of(bare.joint, None if patches is None else str(patches))
    study = ShimStudy(bare, made, form, there, (allow_force or inf, allow_stress or inf))
    law = other_gaps(bare, made)

    def text(shims: list[Shims]) -> str:
        def change(document: Any) -> None:
            for one in shims:
                table = tomlkit.table()
                table.update(one.model_dump(mode="json", exclude_none=True))
                document.setdefault("effect", tomlkit.aot()).append(table)

        return edited(source, directory, change, (), law)

    text([])  # refused now rather than after the search
    asked |= {"share": goal.share, "stock": list(thicknesses)}
    identity = asked | {
        "patches": f"{len(there)}, hash {digest(*map(repr, there))[:8]}",
        "scene_key": bare.key,
        "cases_key": made.key,
        "cases": made.count,
        "form": form,
        "rivetbench_version": installed_version("rivetbench"),
    }
    refuse_other_command(directory, OUTPUTS, ANSWERS)
    if order.table:
        reporter.say(HELD_BACK)
    with records.locked(directory, (), other=records.MEASUREMENTS):
        pool = workers(scheduler, console_of(reporter)) if scheduler else nullcontext()
        with pool as executor, reporter.step("search"):
            journal = AnswerJournal(study, directory / ANSWERS, identity, executor)
            search = ShimSearch(journal, 0, 0, allow_gap_mm, study, thicknesses, reporter=reporter)
            result = search_in_rounds(search, (), goal, order)
        from report.writers.shim_report import write  # slow to import: not before the search

        plan = result.best.plan if result.best else ()
        records.replace_text(directory / "shimmed.toml", text([study.effect(item) for item in plan]))
        words, passed = _sentence(result, goal, study)
        record = {"title": bare.title, **asked, "said": words, **_record(result, study)}
        record |= _as_solved(directory / "shimmed.toml", len(plan), allow_gap_mm) | provenance()
        records.replace_object(directory / RECORD, record)
        return Shimming({there[int(k)].name: t for k, t in plan}, passed, words, write(directory))


def _faults(scene: Any, asked: dict[str, Any]) -> list[Fault]:
    """A fault for each number asked for that is no limit, and for what in a scene shims do not fit."""
    faults = [
        Fault("shim", key, value, "above 0, and finite" if key != "share" else "above 0, at most 1")
        for key, value in asked.items()
        if value is not None and not 0 < value <= (1 if key == "share" else MOST)
    ]
    where = f"scene {scene.name}"
    if not isinstance(scene, JointScene):
        return [*faults, Fault(where, "assembly", "own matrices", "a joint: shims are between its parts")]
    if scene.stages:
        names, allowed = [stage.name for stage in scene.stages], "none: shims are found for one stage alone"
        faults.append(Fault(where, "stage", names, allowed))
    if not any(isinstance(e, SpringEffect) or any(hasattr(e, key) for key in FORCES) for e in scene.effects):
        faults.append(Fault(where, "effect", "no fasteners", "one that presses the parts together"))
    if not scene.joint.pairs:
        faults.append(Fault(where, "contacts", "none", "a contact that a shim can fill"))
    return faults


def _sentence(result: Found, goal: Goal, study: ShimStudy) -> tuple[str, bool]:
    """The outcome in words, and whether the plan passed."""
    step, sample, limit = result.best, result.samples[-1] if result.samples else None, goal.limit_mm or 0.0
    if step is None:
        least, names = min(result.steps, key=lambda step: step.gap_mm), [p.name for p in study.patches]
        gaps = np.array(least.outcome.further[least.worst][: len(study.masks)])
        at = [*(f"in patch {name}" for name in names), "beyond all patches"][int(gaps.argmax())]
        words = "no shims of the stock are found with which all limits are kept; the best tried leave"
        return f"FAIL: {words} {gaps.max():.3g} mm {at}, proven.", False
    passed = (sample.step if sample else step).gap_mm <= limit
    leave = "leaves" if len(step.plan) == 1 else "leave"
    words = f"{counted(len(step.plan), 'shim')} {leave} {step.gap_mm:.3g} mm of {limit:g} mm allowed"
    return f"{'PASS' if passed else 'FAIL'}: {sample.sentence(goal) if sample else words}, proven.", passed


def _record(result: Found, study: ShimStudy) -> dict[str, Any]:
    """Of each patch, and of all, the largest figures in the cases that chose, before, and in those that
    decided, after; of a volume the mean.
    """
    best, count = result.best or result.steps[0], len(study.patches)
    after = result.samples[-1].step if result.samples else best
    old, new = (np.array(step.outcome.further) for step in (result.steps[0], after))
    patches = [
        {"patch": patch.name, "x_min": patch.x[0], "x_max": patch.x[1], "y_min": patch.y[0]}
        | {"y_max": patch.y[1], "thickness_mm": dict(best.plan).get(k, 0.0), "area_mm2": patch.area}
        | {"gap_before_mm": old[:, k].max(), "gap_after_mm": new[:, k].max()}
        | {"liquid_mm3": new[:, count + 1 + k].mean()}
        for k, patch in enumerate(study.patches)
    ]
    names, figures = ("gap", "force", "stress"), {"before": old, "after": new}
    whole = {
        when: dict(zip(names, (some[:, : count + 1].max(), *some[:, -2:].max(axis=0)), strict=True))
        for when, some in figures.items()
    }
    samples = [{"cases": len(s.numbers), "kept": s.kept, "interval": s.interval} for s in result.samples]
    steps = [{"moved": step.moved, "gap_mm": step.gap_mm, "plan": step.plan} for step in result.steps]
    drawn = {"bounds": study.bare.joint.bounds.tolist(), "marks": study.bare.marks().tolist()}
    return {"patches": patches, "samples": samples, "steps": steps, **whole, **drawn}


def _as_solved(path: Path, shims: int, allowed_mm: float) -> dict[str, Any]:
    """What `solve` says of the scene with shims, and the forces in its fasteners without and with them."""
    after: Any = read_scene(str(path))
    without = replace(after, effects=after.effects[: len(after.effects) - shims])
    answers = [solve(without), solve(after)]
    check = check_answer(answers[1], allowed_mm, [], mesh := estimated(answers[1]))
    pairs = zip(*(fastener_forces(answer.scene, answer.x) for answer in answers), strict=True)
    sure = [f"Solver: gaps proven to {check['uncertainty_mm']:.1e} mm", mesh_record(mesh)["said"]]
    sure.append(f"Scan: {check.get('beyond_scan', 'no contact is beyond measured points')}")
    return {"sure": sure, "forces": [old | {"with_shims_N": new["force_N"]} for old, new in pairs]}
