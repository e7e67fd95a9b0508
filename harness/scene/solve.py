"""One scene from its file to an answer on disk; the report draws it from there.

DIR is written beside its place and moved there when it is whole; what an older answer left is removed.
"""

import time
from pathlib import Path

import numpy as np
from rich.console import Console

from harness.results.atomic_output import RECORD, atomic_output, refuse_inputs, refuse_unwritable
from harness.results.provenance import fingerprints
from harness.results.records import refuse_other_command, replace_text, to_line
from harness.terminal import DONE, FAILED
from harness.terminal.console import ConsoleReporter, show_verdict, table_of
from problems.errors import InputError
from problems.forms import Form
from problems.scene_files import read_scene

from . import allowed_gap, mesh_error
from .answer_record import arrays_of, is_of_plates, recorded, summary
from .solution import refuse_not_positive, refuse_other_units, solve
from .validate import print_unusual

TOLERANCE = 1e-9  # of a named solver, by default
PAGE = "answer.md"  # a folder with it has an answer
TABLES = ("contacts", "exceeding", "fasteners", "nodes", "stages", "stress")
PICTURES = ("deformed", "displacement", "forces", "gap", "history", "section", "stage-gaps", "stress")
#: Files of an answer that a folder without one may have from elsewhere.
OUTPUTS = (
    *(f"{name}.csv" for name in TABLES),
    *(f"{name}.png" for name in PICTURES),
    *("answer.pdf", "index.html", "solution.npz", "solution.vtu", "stress.vtu"),
)


def solve_into(
    source: str,
    solver: str | None,
    tolerance: float,
    out: Path,
    console: Console,
    reference_limit_s: float | None = None,
    form: Form | None = None,
    allow_gap_mm: float | None = None,
    refine: bool = False,
    allow_stress: float | None = None,
) -> int:
    """Solve a scene, write DIR, show the outcome. Returns 0 if the answer is within 1e-7 mm, else 1.

    form : by default see `harness.planning.form_choice`. allow_gap_mm, allow_stress : returns 4 if a
    remaining gap or a von Mises stress in N/mm² is larger, 3 if that cannot be told. refine : see
    `mesh_error`. Raises InputError.
    """
    started = time.perf_counter()
    refuse_not_positive("--tolerance", tolerance=tolerance)
    if solver is None and tolerance != TOLERANCE:
        raise InputError.one("--tolerance", "tolerance", tolerance, "needs --solver NAME")
    allowed_gap.refuse_unusable(allow_gap_mm)
    scene = read_scene(source)
    if allow_gap_mm is not None:
        refuse_other_units("--allow-gap", scene)
    refuse_unwritable(out, scene.sources)
    refuse_inputs([out / name for name in OUTPUTS], scene.sources)
    refuse_other_command(out, PAGE, OUTPUTS)
    stressed = allow_stress is not None or scene.output.stress
    if stressed:
        from . import stress  # only what a scene calls for

        stress.refuse_unusable(allow_stress, scene)
    if refine and not is_of_plates(scene):
        allowed = "leave it out: the mesh of superelements and of given matrices is not known"
        raise InputError.one("--refine", "scene", scene.name, allowed)
    print_unusual(scene, console)
    files = fingerprints(scene.sources)  # now: they may change meanwhile
    reporter = ConsoleReporter(console)
    solution = solve(
        scene, solver, form=form, tolerance=tolerance, limit_s=reference_limit_s, reporter=reporter
    )
    record, arrays = recorded(solution, reporter.stages, solver) | {"inputs": files}, arrays_of(solution)
    for text, style in summary(record):
        console.print(text, style=style)
    begun = time.perf_counter()
    with reporter.step("the same joint on another mesh"):
        mesh = mesh_error.estimated(solution, refine, stress.largest_of if stressed else None)
    if mesh is not None:
        solution.seconds["mesh error"] = time.perf_counter() - begun
    record["grid"] = mesh_error.mesh_record(mesh)
    console.print(f"{record['grid']['said']}.")
    if stressed:
        with reporter.step("stresses"):
            assembly_stress = stress.stresses(solution)
            for stage, line in zip(solution.stages, record.get("stages", ()), strict=True):
                line["largest_stress"] = stress.largest_of(stage.scene, stage.x)
        arrays |= assembly_stress.arrays
        record["stress"] = stress.stress_record(assembly_stress, mesh, allow_stress)
    verdicts = [record["verdict"], *(stage.judgement.verdict for stage in solution.stages)]
    code = DONE if set(verdicts) == {"within"} else FAILED
    if allow_gap_mm is not None:
        for stage, line in zip(solution.stages, record.get("stages", ()), strict=True):
            check = allowed_gap.checked(allow_gap_mm, stage.gap, stage.gap_error_mm, [])
            line["exceeded"] = check["exceeded"]
        record["allowed_gap"] = allowed_gap.check_answer(solution, allow_gap_mm, record["pairs"], mesh)
    if allow_gap_mm is not None or stressed or solution.stages:
        # Slow to import: not before the answer.
        from report.page.answer_page_data import headline, stage_lines

        verdict = headline(record, arrays)
        if solution.stages:
            console.print(table_of(stage_lines(record, arrays)))
        if allow_gap_mm is not None or allow_stress is not None:
            code = code or show_verdict(verdict["kind"], [verdict["text"]], console)
        elif stressed:
            console.print(verdict["text"])
    with reporter.step("pictures and files"), atomic_output(out, scene.sources) as new:
        from report.writers.answer_report import write

        new.mkdir()
        np.savez(new / "solution.npz", **arrays)
        replace_text(new / RECORD, to_line(record) + "\n")
        written = out / write(new).name
    console.print(f"{time.perf_counter() - started:.1f} s in all. Answer: {written}")
    return code
