"""One scene from its file to an answer on disk; the report draws it from there.

DIR is written beside its place and moved there when it is whole; what an older answer left is removed.
DIR/solution.npz holds the arrays, DIR/solution.json what was done: the steps and their time, what was
skipped, and the error bound of the answer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from harness.results.provenance import machine, provenance, resident_mib
from harness.terminal.exit_codes import DONE, FAILED
from harness.verification.assess import GapError
from harness.verification.judge import LIMIT_MM
from harness.verification.reference import UNPROVEN
from problems.errors import InputError
from problems.forms.names import Form
from problems.model.scene import JointScene, MatricesScene
from problems.scene import read_scene

from . import allowed_gap, solution
from .atomic_output import atomic_output, write_record
from .layout import fastener_forces, layout
from .solution import Solution
from .validate import digits_sentence


def solve(
    source: str,
    solver: str | None,
    tolerance: float,
    out: Path,
    console: Console,
    reference_limit_s: float | None = None,
    form: Form | None = None,
    allow_gap_mm: float | None = None,
) -> int:
    """Solve a scene, write DIR, show the outcome. Returns 0 if the answer is within 1e-7 mm, else 1.

    form : by default see `harness.planning.form_choice`. allow_gap_mm : returns 4 if a remaining
    gap is larger, 3 if that cannot be told. Raises InputError.
    """
    started = time.perf_counter()
    if not 0 < tolerance < inf:
        raise InputError.one("--tolerance", "tolerance", tolerance, "must be positive and finite")
    allowed_gap.refuse_unusable(allow_gap_mm)
    scene = read_scene(source)
    built: dict[str, float] = {}  # what the cache did not hold, and how far it is
    found = solution.solve(
        scene,
        solver,
        form=form,
        tolerance=tolerance,
        limit_s=reference_limit_s,
        progress=built.__setitem__,
        doing=lambda step: console.status(Text(step)),
        said=lambda sentence: console.print(Text(f"{sentence}.", style="yellow")),
    )
    assembly = found.problem.prepared.assembly
    record = _record(found, list(built), solver)
    if allow_gap_mm is not None:
        uncertainty = GapError.of(assembly)(found.problem.load.g, found.unknowns, found.error_bound_mm)
        record["allowed_gap"] = allowed_gap.checked(allow_gap_mm, found.gap, uncertainty, record["pairs"])
    _show(record, console)
    try:
        with console.status(Text("pictures and files")), atomic_output(out, [Path(source)]) as new:
            from report.writers.solution import write  # slow to import: not before the answer is shown

            new.mkdir()
            np.savez(new / "solution.npz", **_arrays(found))
            write_record(new, record)
            written = out / write(new).name
            write_record(new, record)  # with the files that were added
    except OSError as error:
        raise InputError.one("--out", "directory", str(out), f"cannot be written: {error}") from error
    console.print(f"{time.perf_counter() - started:.1f} s in all. Answer: {written}")
    code = DONE if record["verdict"] == "within" else FAILED
    if allow_gap_mm is not None:
        code = code or allowed_gap.show(record["allowed_gap"], found.gap, assembly.contact_nodes, console)
    return code


def _arrays(found: Solution) -> dict[str, Any]:
    """DIR/solution.npz: of x and A, what is asked for."""
    assembly = found.problem.prepared.assembly
    A, nodes = assembly.asked_contacts, assembly.asked_nodes
    arrays = {"x": found.x, "lam": found.lam, "gap_before": found.problem.load.g, "gap_after": found.gap}
    arrays |= {"A_data": A.data, "A_indices": A.indices, "A_indptr": A.indptr}
    return arrays if nodes is None else arrays | {"nodes": nodes, "contact_nodes": assembly.contact_nodes}


def _record(found: Solution, built: list[str], solver: str | None) -> dict[str, Any]:
    """DIR/solution.json. built : what the cache did not hold."""
    problem, known, judged = found.problem, found.problem.reference, found.judgement
    scene, data = problem.scene, problem.prepared
    by_solver = found.unknowns is not known.x
    return {
        "method": found.method,
        "status": found.status,
        "verdict": judged.verdict,
        "judged_error_mm": judged.displacement_error_mm if by_solver else None,
        "iterations": found.iterations,
        "scene": scene.name,
        "title": scene.title,
        "scene_key": scene.key,
        "form": problem.form,
        "n": data.assembly.asked,
        "unknowns": data.assembly.n,
        "m": data.assembly.m,
        "cond_K": data.facts.get("cond_K"),
        "qp": found.has_contact,
        "closest_mm": found.closest_mm,
        "error_bound_mm": known.bound_mm,
        "route": known.route,
        **layout(scene, data.assembly),
        "fasteners": fastener_forces(scene, found.x),
        "digits": digits_sentence(problem)[0] if isinstance(scene, MatricesScene) else None,
        "skipped": list(_skipped(found, built, solver)),
        "steps": found.seconds,
        "peak_rss_mib": resident_mib("VmHWM"),
        "machine": machine()["machine"],
        **provenance(),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _skipped(found: Solution, built: list[str], solver: str | None) -> Iterator[str]:
    if not found.has_contact:
        instead = f"; {solver} was not run" if solver else ""
        why = "The scene has no contact"
        if found.closest_mm is not None:
            closest = f"the closest contact stays {found.closest_mm:.3g} mm open"
            why = f"The answer without contact violates no gap, {closest}"
        yield f"the quadratic program: it was not called for. {why}{instead}"
    if found.problem.form == "sparse":
        yield "condensation, dense factors and Q: the sparse model was solved as it is"
    elif not built:
        yield "condensation, Cholesky factors and Q: the assembly came from the cache"
    elif isinstance(found.problem.scene, JointScene) and not any(
        step.startswith("condensing") for step in built
    ):
        yield "condensation: the parts came from the cache"


def _show(record: dict[str, Any], console: Console) -> None:
    """Print what was skipped, and the answer with its bound."""
    if record["digits"]:
        console.print(f"{record['digits']}.")
    for line in record["skipped"]:
        console.print(f"Skipped: {line}.", style="dim")
    error, bound = record["judged_error_mm"], record["error_bound_mm"]
    proven = np.isfinite(bound)
    if error is None:
        text = f"every displacement within {bound:.1e} mm, proven" if proven else f"a bound {UNPROVEN}"
    else:
        known = f"with a proven bound ({bound:.1e} mm)" if proven else f"whose bound {UNPROVEN}"
        text = (
            f"{record['status']}, {error:.1e} mm from the answer {known}: {record['verdict']} {LIMIT_MM:g} mm"
        )
    console.print(f"{record['method']}: {text}.", style="green" if record["verdict"] == "within" else "red")
