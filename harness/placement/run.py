"""Searches for the best plan of fasteners and writes it: as a scene, as tables, and as a report.

The plan found and the scene's own plan are then solved as series of load cases, in DIRECTORY/plan and
DIRECTORY/own, on the scenes as a user would read them.
"""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from harness.measurement.scheduler import workers
from harness.measurement.solver_descriptions import described
from harness.placement.answer_journal import AnswerJournal, form_of_search
from harness.placement.candidates import MovableFasteners, Place, Plan, without_fasteners
from harness.placement.fresh_cases import Cases, Goal, SearchOutcome, search_in_rounds
from harness.placement.search import Search
from harness.placement.search_record import identity_of, record_of, sentence_on
from harness.placement.session import THREADS, FastenerStudy
from harness.results import records
from harness.results.atomic_output import refuse_changed, refuse_inputs
from harness.results.provenance import fingerprints
from harness.scene.allowed_gap import refuse_unusable
from harness.scene.scene_file import MOVED, edited, file_of, opened, refuse_unreadable, with_fasteners
from harness.scene.solution import Source, load_scene
from harness.series.load_case_source import DEFAULT, GapCases
from harness.series.run import run as run_series
from harness.series.session import Job
from harness.solving.call_lock import keeps_threads
from harness.terminal.console import console_of
from problems.build import prepared
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import InitialGap
from problems.errors import Fault, InputError, number_faults
from problems.load_cases import LoadCases
from problems.load_cases.measured_gaps import MeasuredGaps
from problems.load_cases.random_gaps import RandomGaps
from problems.load_cases.random_inputs import RandomInputs
from problems.load_cases.scan_modes import ScanModes
from problems.model.scene import JointScene, Scene
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene

RECORD = "place.json"
SERIES = ("own", "plan")
OUTPUTS = (RECORD, records.PLANS, *(f"{name}.{kind}" for name in SERIES for kind in ("toml", "csv")))
HELD_BACK = "Every second row is held back: it does not choose the plan, but says what it keeps"


@dataclass(frozen=True)
class Placement:
    """The outcome of `place`.

    Parameters
    ----------
    plan : tuple of (float, float), optional
        Places (x, y) of the fasteners found, mm, sorted; None if not even all candidates keep the limit.
    order : tuple of (float, float)
        The same places in the order in which to set them.
    passed : bool
        Whether the plan is shown to keep the limit; True if none was asked for.
    sentence : str
        The outcome in words.
    report : Path
        The report, in Markdown.
    """

    plan: Plan | None
    order: tuple[Place, ...]
    passed: bool
    sentence: str
    report: Path


@keeps_threads
def place(
    scene: Source,
    out: str | Path,
    *,
    candidates: str | Path | None = None,
    allow_gap_mm: float | None = None,
    count: int | None = None,
    share: float | None = None,
    cases: GapCases = DEFAULT,
    scheduler: str | None = None,
    reporter: Reporter = SILENT,
) -> Placement:
    """Find the fewest fasteners that keep a gap in most load cases, or the best `count` of them.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene that was read, its name, or the path of its file, with fasteners of one preload.
    out : str or Path
        Directory for the plan (plan.toml, plan.csv), the report and the answers so far: the same call
        continues an interrupted search.
    candidates : str or Path, optional
        The holes: rows x columns, as "4x32", or a CSV with columns x and y, mm, and perhaps name, which
        plan.csv keeps; by default the places of the scene's fasteners.
    allow_gap_mm : float, optional
        The largest gap allowed, mm.
    count : int, optional
        Number of fasteners, to find the best plan of that number instead of the fewest.
    share : float, optional
        Share of the load cases that must keep the gap, 0 to 1; by default 0.95, of a single case 1.
    cases : GapCases, optional
        The load cases; by default 100 with random gaps, or the scene alone if its gaps are not random.
    scheduler : str, optional
        Dask workers: local:N, or the address of a scheduler; by default this process.
    reporter : Reporter, optional
        Is told each plan that is kept; silent by default.

    Returns
    -------
    Placement
        The plan, its order, and whether fresh load cases show that it keeps the gap.

    Raises
    ------
    InputError
        If an input is wrong, or `out` holds another search.

    Examples
    --------
    >>> from rivetbench import GapCases, place
    >>> cases = GapCases(count=4)
    >>> best = place("examples/small-joint.toml", "results/two", count=2, share=1.0, cases=cases)
    >>> best.plan
    ((40.0, 30.0), (280.0, 30.0))
    """
    read, directory = load_scene(scene), Path(out)
    refuse_unusable(allow_gap_mm)
    inputs = [*read.sources, *(Path(file) for file in (candidates, *cases.files) if file)]
    report_files = (directory / "report").glob("*")
    refuse_inputs([*(directory / name for name in OUTPUTS), *report_files], inputs)
    movable, source = MovableFasteners.of(read), file_of(scene, read)
    holes, names = movable.candidates(None if candidates is None else str(candidates), cases.options)
    faults = cases.faults(table=candidates is not None and Path(candidates).is_file())
    if allow_gap_mm is None and count is None:
        faults.append(Fault("place", "goal", None, "--allow-gap MM, or --count N"))
    faults += number_faults(count=(count, 1, len(holes)))  # of the candidates
    if share is not None and not 0 < share <= 1:
        faults.append(Fault("--share", "share", share, "above 0, at most 1"))
    moving = [law for law in cases.laws(movable.scene) if law.strip().startswith("fasteners.")]
    faults += [Fault("--random", "key", law, "leave it out: the fasteners change places") for law in moving]
    if faults:
        raise InputError(faults)
    (newton,) = described([("newton", {})], None, "--solver", reporter)
    form = form_of_search(directory / records.PLANS, movable.scene, newton.forms, cases, len(holes))
    study = FastenerStudy.of(movable, cases.of_search(movable.scene, form), form)
    for sentence in (*study.scene.unusual, *study.cases.notes):
        reporter.say(sentence)
    goal = Goal(allow_gap_mm, Goal.share_of(share, study.cases.count), count)
    case_numbers = Cases.of(study.cases.count, isinstance(study.cases, MeasuredGaps), goal)
    law = other_gaps(study.bare, study.cases)
    preload: Any = movable.fastener.preload
    text = opened(source)  # these files may change while plans are searched
    files = fingerprints(file for file in inputs if file.is_file())
    data = [file for file in inputs if file.is_file() and file != Path(source)]
    of_data = fingerprints(data)

    def text_of(plan: Plan) -> str:
        return edited(text, directory, with_fasteners(plan, preload), MOVED, law)

    current = text_of(movable.current)  # refused now rather than after the search
    facts = {"solver_version": newton.version, "solver_code": newton.code}
    identity = identity_of(study, movable.current, holes, goal) | facts
    if case_numbers.table:
        reporter.say(HELD_BACK)
    console = console_of(reporter)
    with records.locked(directory, records.PLANS, outputs=(*OUTPUTS, *SERIES, "report")):
        refuse_unreadable(current, directory / "own.toml")  # as is refused at the end
        nodes = prepared(study.bare, form=form).assembly.contact_nodes
        assert nodes is not None  # of a joint
        pool = workers(scheduler, console) if scheduler else nullcontext()
        with pool as executor, reporter.step("search"):
            journal = AnswerJournal(study, directory / records.PLANS, identity, executor)
            whole = journal, 0, 0, goal.limit_mm or 0.0
            search = Search(*whole, study.bare, nodes, holes, reporter=reporter)
            result = search_in_rounds(search, movable.current, goal, case_numbers)
        from report.document.escape import csv_frame  # slow to import: not before the search
        from report.writers.place_report import write

        refuse_changed(data, of_data)  # which the series of the plans read again
        plans = {"own": movable.current} | ({"plan": result.best.plan} if result.best else {})
        for name, plan in plans.items():
            records.replace_text(directory / f"{name}.toml", text_of(plan))
            table = pd.DataFrame(plan, columns=["x", "y"])
            if names:
                table.insert(0, "name", [names.get(place, "") for place in plan])
            csv_frame(table).to_csv(directory / f"{name}.csv", index=False)
            moved, made = _written_scene(directory / f"{name}.toml", study, law, cases, result)
            job = Job(scene=moved, cases=made, form=form, check=0, threads=THREADS)
            run_series(job, facts, directory / name, console)
        words, passed = sentence_on(result, goal, nodes)
        record = record_of(study, movable.current, holes, goal, result, nodes)
        labels = [names.get(place, "") for place in holes]
        told = {"said": words, "names": labels, "inputs": files}
        records.replace_object(directory / RECORD, record | told)
        steps = zip(result.order[1:], result.order, strict=False)
        added = tuple(next(iter(set(step.plan) - set(earlier.plan))) for step, earlier in steps)
        return Placement(plans.get("plan"), added, passed, words, write(directory))


def _written_scene(
    path: Path,
    study: FastenerStudy,
    law: RandomGaps | None,
    source: GapCases,
    result: SearchOutcome,
) -> tuple[Scene, LoadCases]:
    """The scene of a file that was written, and its load cases: those that decided, too."""
    scene = read_scene(str(path))
    assert isinstance(scene, JointScene)
    if law is not None and law.points is not None:  # a scene has a scan, or random gaps around it
        others = without_fasteners(study.scene).effects
        scene = replace(scene, effects=(*others, *scene.effects_of(Fasteners)), random=study.scene.random)
    cases = source.of_search(scene, study.form)
    if result.samples and isinstance(cases, RandomGaps | RandomInputs | ScanModes):
        cases = replace(cases, count=result.samples[-1].numbers[-1] + 1)
    return scene, cases


def other_gaps(bare: JointScene, cases: LoadCases) -> RandomGaps | None:
    """The random gaps of the cases, unless the scene's file has the same."""
    cases = cases.gaps or cases if isinstance(cases, RandomInputs) else cases
    if not isinstance(cases, RandomGaps):
        return None
    but = {"random": {"seed"}}
    in_file = [effect.model_dump(exclude=but) for effect in bare.effects_of(InitialGap)]
    same = in_file == [cases.field.model_dump(exclude=but)]
    return None if same and cases.points is None else cases
