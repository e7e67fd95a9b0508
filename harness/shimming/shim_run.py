"""Searches for shims and writes them: as a scene, a table and a drawing, and as a report."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

from harness.measurement.scheduler import workers
from harness.placement.answer_journal import AnswerJournal, form_of_search
from harness.placement.candidates import Plan
from harness.placement.fresh_cases import ALPHA, Cases, Goal, search_in_rounds
from harness.placement.run import HELD_BACK, other_gaps
from harness.placement.session import PlanSession
from harness.results import records
from harness.results.atomic_output import refuse_inputs, refuse_unwritable
from harness.results.provenance import fingerprints, stamp
from harness.scene.scene_file import add_effect, edited, file_of, opened, refuse_unreadable
from harness.scene.solution import Source, load_scene
from harness.scene.stress import none_told, refuse_unusable
from harness.series.load_case_source import DEFAULT, GapCases
from harness.solving.call_lock import keeps_threads
from harness.terminal.console import console_of
from problems.effects.shims import Shims
from problems.errors import Fault, InputError
from problems.forms import Form
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.load_cases.random_inputs import RandomInputs
from problems.model.effect import SpringEffect
from problems.model.positions import Positions
from problems.model.scene import JointScene
from problems.model.stage_answers import last_scene
from problems.reporter import SILENT, Reporter
from problems.storage import digest

from .gap_regions import patches_of_gap
from .joint_shims import each_joint
from .outcome import UNITS, figures_of, record_of, sentence_of, solver_statements
from .patches import patches_of, stock_of
from .shim_search import ShimSearch
from .study import ShimStudy

RECORD = "shim.json"
FORMS: tuple[Form, ...] = ("dual", "sparse")
MOST = 1e9  # of a limit: larger ones are none
MESH = "Mesh error: not part of it; the report of a single joint has it"
REPORT = ("report.md", "index.html", "sheet.pdf", "shims.csv", "shims.png", "forces.csv")
OUTPUTS = (RECORD, records.SHIMS, "shimmed.toml", *REPORT, "stock.csv", "stock.png", "joints.csv")


@dataclass(frozen=True)
class Shimming:
    """The outcome of `shim`.

    Parameters
    ----------
    shims : dict of str to float or (float, float)
        The thickness of each shim by the name of its patch, mm, of a tapered one at either end; none if each
        joint has its own.
    passed : bool
        Whether the shims are shown to keep the limits.
    sentence : str
        The outcome in words.
    report : Path
        The report, in Markdown.
    """

    shims: dict[str, float | tuple[float, ...]]
    passed: bool
    sentence: str
    report: Path


@keeps_threads
def shim(
    scene: Source,
    out: str | Path,
    *,
    allow_gap_mm: float,
    stock: str,
    patches: str | Path | None = None,
    allow_force: float | None = None,
    allow_stress: float | None = None,
    share: float | None = None,
    each: bool = False,
    taper: bool = False,
    cases: GapCases = DEFAULT,
    scheduler: str | None = None,
    reporter: Reporter = SILENT,
) -> Shimming:
    """Find the fewest shims from a stock, then the least, with which the gap after fastening keeps a limit.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene that was read, its name, or the path of its file, with fasteners.
    out : str or Path
        Directory for what is written, and the answers so far: the same call continues an interrupted search.
    allow_gap_mm : float
        The largest gap allowed, mm.
    stock : str
        Thicknesses, mm: "0.2,0.3,0.5", or "0.05:1.0:0.05" from the first to the last by steps.
    patches : str or Path, optional
        Columns x rows, as "8x1", or a CSV, mm: rectangles in columns x_min, x_max, y_min, y_max, and perhaps
        name, or corners of outlines in columns name, x and y; by default rectangles, at most 16, around what
        exceeds the limit after fastening.
    allow_force, allow_stress : float, optional
        The largest force in a fastener, N, and von Mises stress in a part, N/mm².
    share : float, optional
        Share of the load cases that must keep all limits; by default 0.95, of a single case 1.
    each : bool, optional
        Whether each load case has shims of its own; by default all have the same.
    taper : bool, optional
        Whether a shim has a thickness of the stock at each end of its longer range.
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
    read, directory = load_scene(scene), Path(out)
    inputs = [*read.sources, *(Path(file) for file in (patches, *cases.files) if file)]
    refuse_unwritable(directory, inputs)
    refuse_inputs([directory / name for name in OUTPUTS], inputs)
    records.refuse_other_command(directory, records.SHIMS, OUTPUTS)  # before patches are found
    asked: dict[str, Any] = {
        "limit_mm": allow_gap_mm,
        "allow_force": allow_force,
        "allow_stress": allow_stress,
        "share": share,
    }
    faults, thicknesses = cases.faults() + _faults(read, asked), tuple[float, ...]()
    try:
        thicknesses = stock_of(stock)
    except InputError as error:
        faults += error.faults
    if faults or not isinstance(read, JointScene):
        raise InputError(faults)
    bare = last_scene(read)
    scene_text = ("", directory) if each else opened(file_of(scene, read))
    files = fingerprints(file for file in inputs if file.is_file())  # which may change during the search
    if allow_stress is not None:
        refuse_unusable(allow_stress, bare)
        if none_told(bare):  # whatever is between the parts
            allowed = "leave it out: forces at points act near all elements, so that no stress can be read"
            raise InputError.one("--allow-stress", "stress, N/mm²", allow_stress, allowed)
    there = patches_of(bare.joint, None if patches is None else str(patches))
    others = [] if patches is None else list(read.effects_of(Shims))
    touching = [
        Fault("--patches", f"{patch.name}, {key}", value, allowed)
        for patch in there
        for key, value, allowed in patch.shim.faults(bare.joint, others)
    ]
    if touching:
        raise InputError(touching)
    form = form_of_search(directory / records.SHIMS, read, FORMS, cases, len(there))
    made = cases.of_search(read, form)
    if allow_stress is not None and isinstance(made, RandomInputs):
        keys = [one.name for one in made.inputs]
        raise InputError.one("--allow-stress", "random keys", keys, "leave them out: loads are the scene's")
    for sentence in (*read.unusual, *made.notes):
        reporter.say(sentence)
    limits, listed = (allow_force or inf, allow_stress or inf), isinstance(made, MeasuredGaps)
    also = "".join(f", {most:g} {unit}" for most, unit in zip(limits, UNITS, strict=True) if most < inf)
    goal = Goal(allow_gap_mm, Goal.share_of(share, made.count), also=also)
    study = ShimStudy(read, bare, made, form, there, limits, 1 + taper)
    if each and not listed and goal.allowed_fresh(made.count, ALPHA) < 0:
        allowed = f"{made.count} cases cannot show it: take {goal.least(ALPHA / 2)}, or a share of 1"
        raise InputError.one("--share", "share", goal.share, allowed)
    case_numbers = Cases(range(made.count), made.count) if each else Cases.of(made.count, listed, goal)
    if patches is None:
        gap = PlanSession(study).largest_gap(case_numbers.numbers[: case_numbers.choosing])
        own = list(read.effects_of(Shims))
        free = tuple(patch for patch in there if not any(patch.shim.faults(bare.joint, own)))
        there = patches_of_gap(bare.joint, gap, allow_gap_mm) or free or there
        study = replace(study, patches=there)
    law = other_gaps(bare, made)

    def text(shims: list[Shims]) -> str:
        def change(document: Any) -> None:
            for one in shims:
                add_effect(document, one.model_dump(mode="json", exclude_none=True))

        return edited(scene_text, directory, change, (), law)

    with_one = "" if each else text([there[0].shim])  # refused now rather than after the search
    asked |= {"share": goal.share, "stock": list(thicknesses), "each": each, "taper": taper}
    identity = asked | {"patches": f"{len(there)}, hash {digest(*map(repr, there))[:8]}"} | study.identity
    if case_numbers.table:
        reporter.say(HELD_BACK)
    with records.locked(directory, records.SHIMS, outputs=OUTPUTS):
        if not each:
            refuse_unreadable(with_one, directory / "shimmed.toml")  # as is refused at the end
        pool = workers(scheduler, console_of(reporter)) if scheduler else nullcontext()
        with pool as executor, reporter.step("search"):
            journal = AnswerJournal(study, directory / records.SHIMS, identity, executor)
            plan: Plan = ()
            if each:
                joints, *pair, words, passed = each_joint(journal, study, goal, thicknesses, reporter)
                record = {"joints": joints, "samples": [], **figures_of(study, *pair)}
                record |= {"forces": [], "sure": ["Solver: every gap is a proven upper bound", MESH]}
            else:
                search = ShimSearch(journal, 0, 0, allow_gap_mm, study, thicknesses, reporter=reporter)
                result = search_in_rounds(search, (), goal, case_numbers)
                plan, record = result.best.plan if result.best else (), record_of(result, study)
                words, passed = sentence_of(result, goal, study)
        from report.writers.shim_report import write  # slow to import: not before the search

        record |= {"scene": bare.name, "title": bare.title, "scene_key": read.key, "inputs": files}
        record |= asked | {"said": words, **stamp()}
        if not each:
            records.replace_text(directory / "shimmed.toml", text([study.effect(item) for item in plan]))
            record |= solver_statements(directory / "shimmed.toml", len(plan), allow_gap_mm)
        records.replace_object(directory / RECORD, record)
        sizes = {there[int(k)].name: t[0] if len(t) == 1 else tuple(t) for k, *t in plan}
        return Shimming(sizes, passed, words, write(directory))


def _faults(scene: Any, asked: dict[str, Any]) -> list[Fault]:
    """A fault for each number asked for that is no limit, and for what in a scene shims do not fit."""
    faults = [
        Fault("shim", key, value, f"above 0, at most {most:g}")
        for key, value in asked.items()
        for most in [1 if key == "share" else MOST]
        if value is not None and not 0 < value <= most
    ]
    where = f"scene {scene.name}"
    if not isinstance(scene, JointScene):
        return [*faults, Fault(where, "assembly", "own matrices", "a joint: shims are between its parts")]
    if not _has_fasteners(scene):
        faults.append(Fault(where, "effect", "no fasteners", "one that presses the parts together"))
    elif asked["allow_force"] is not None and not _has_fasteners(last_scene(scene)):
        allowed = f"leave it out: no fastener acts in the last stage, {scene.stages[-1].name}"
        faults.append(Fault("--allow-force", "force, N", asked["allow_force"], allowed))
    if not scene.joint.pairs:
        faults.append(Fault(where, "contacts", "none", "a contact that a shim can fill"))
    return faults


def _has_fasteners(scene: Any) -> bool:
    return any(isinstance(effect, SpringEffect | Positions) for effect in scene.effects)
