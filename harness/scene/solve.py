"""One scene from its file to an answer on disk; the report draws it from there.

DIR is written beside its place and moved there when it is whole; what an older answer left is removed.
DIR/solution.npz holds the arrays, DIR/solution.json what was done: the steps and their time, what was
skipped, and the error bound of the answer.

The record also says where parts and contacts are in x and λ, what a picture marks, and the force in each
fastener. An installed fastener is a spring of stiffness k along t = w_a − w_b, set at the approach a: it
pulls its parts together with k (a − tᵀx), N, and pushes them apart where that is negative.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import product, repeat
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from rich.console import Console

from harness.results.atomic_output import atomic_output, refuse_unwritable, write_record
from harness.results.provenance import machine, provenance, resident_mib
from harness.terminal import DONE, FAILED
from harness.terminal.console import ConsoleReporter
from harness.verification.assess import GapError
from harness.verification.judge import LIMIT_MM
from harness.verification.reference import UNPROVEN
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import Assembly, Vector
from problems.model.effect import Effect, GapEffect, SpringEffect
from problems.model.interface import AnyJoint
from problems.model.joint import Joint
from problems.model.positions import FORCES
from problems.model.scene import JointScene, MatricesScene, Scene
from problems.reporter import Stage
from problems.scene_files import read_scene

from . import allowed_gap, grid_error, solution
from .solution import Solution
from .validate import digits_sentence, print_unusual


class _Builds(ConsoleReporter):
    """Keeps in mind which stages were made."""

    def __init__(self, console: Console) -> None:
        super().__init__(console)
        self.stages = set[Stage]()

    def building(self, stage: Stage, fraction: float = 0.0, part: str = "") -> None:
        self.stages.add(stage)
        super().building(stage, fraction, part)


def solve(
    source: str,
    solver: str | None,
    tolerance: float,
    out: Path,
    console: Console,
    reference_limit_s: float | None = None,
    form: Form | None = None,
    allow_gap_mm: float | None = None,
    refine: bool = False,
) -> int:
    """Solve a scene, write DIR, show the outcome. Returns 0 if the answer is within 1e-7 mm, else 1.

    form : by default see `harness.planning.form_choice`. allow_gap_mm : returns 4 if a remaining
    gap is larger, 3 if that cannot be told. refine : see `grid_error`. Raises InputError.
    """
    started = time.perf_counter()
    if not 0 < tolerance < inf:
        raise InputError.one("--tolerance", "tolerance", tolerance, "must be positive and finite")
    allowed_gap.refuse_unusable(allow_gap_mm)
    scene = read_scene(source)
    refuse_unwritable(out, scene.sources)
    if refine and not _is_of_plates(scene):
        allowed = "left out: the grid of superelements and of given matrices is not known here"
        raise InputError.one("--refine", "scene", scene.name, allowed)
    print_unusual(scene, console)
    reporter = _Builds(console)
    found = solution.solve(
        scene,
        solver,
        form=form,
        tolerance=tolerance,
        limit_s=reference_limit_s,
        reporter=reporter,
    )
    assembly, record = found.problem.prepared.assembly, _record(found, reporter.stages, solver)
    _show(record, console)
    before = time.perf_counter()
    with reporter.step("the same joint on another grid"):
        grid = grid_error.estimated(found, refine)
    if grid is not None:
        found.seconds["grid error"] = time.perf_counter() - before
    record["grid"] = grid_error.recorded(grid)
    console.print(f"{record['grid']['said']}.")
    if allow_gap_mm is not None:
        uncertainty = GapError.of(assembly)(found.problem.load.g, found.unknowns, found.error_bound_mm)
        check = allowed_gap.checked(allow_gap_mm, found.gap, uncertainty, record["pairs"])
        if grid is not None and abs(check["largest_mm"] - allow_gap_mm) <= grid.error_mm:
            check["closer_than_grid_mm"] = grid.error_mm
        beyond = _beyond_scan(scene, check["contacts"])
        record["allowed_gap"] = check | ({"beyond_scan": beyond} if beyond else {})
    code = DONE if record["verdict"] == "within" else FAILED
    if allow_gap_mm is not None:
        code = code or allowed_gap.show(record["allowed_gap"], found.gap, assembly.contact_nodes, console)
    with reporter.step("pictures and files"), atomic_output(out, scene.sources) as new:
        from report.writers.answer_report import write  # slow to import: not before the answer is shown

        new.mkdir()
        np.savez(new / "solution.npz", **_arrays(found))
        write_record(new, record)
        written = out / write(new).name
        write_record(new, record)  # with the files that were added
    console.print(f"{time.perf_counter() - started:.1f} s in all. Answer: {written}")
    return code


def _beyond_scan(scene: Scene, contacts: list[int]) -> str:
    """How many of these contacts, and of all, are beyond the points of a measured gap; empty if none is."""
    if not isinstance(scene, JointScene):
        return ""
    beyond = [effect.beyond(scene.joint) > 0 for effect in scene.effects_of(GapEffect)]
    if not (some := np.any(beyond, axis=0)).any():
        return ""
    return f"{some.sum()} of {some.size} contacts are beyond the measured points" + (
        f", {some[contacts].sum()} of those that exceed" if contacts else ""
    )


def _arrays(found: Solution) -> dict[str, Any]:
    """DIR/solution.npz: of x and A, what is asked for. Where parts keep more than the displacement along the
    normal of each node, x and A are of these displacements alone, and `unknowns` is all of x.
    """
    assembly, scene = found.problem.prepared.assembly, found.problem.scene
    x, A, nodes, more = found.x, assembly.asked_contacts, assembly.asked_nodes, {}
    if isinstance(scene, JointScene) and (D := scene.joint.shown) is not None:
        more, x, A = {"unknowns": x}, D @ x, sp.csc_array(D @ A)
        nodes = np.concatenate([scene.joint.nodes_of(name) for name in scene.joint.names])
    arrays = more | {"x": x, "lam": found.lam, "gap_before": found.problem.load.g, "gap_after": found.gap}
    arrays |= {"A_data": A.data, "A_indices": A.indices, "A_indptr": A.indptr}
    return arrays if nodes is None else arrays | {"nodes": nodes, "contact_nodes": assembly.contact_nodes}


def _record(found: Solution, built: set[Stage], solver: str | None) -> dict[str, Any]:
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
        "unusual": scene.unusual if isinstance(scene, JointScene) else [],
        **layout(scene, data.assembly),
        "fasteners": fastener_forces(scene, found.x),
        "digits": digits_sentence(problem, solved=True)[0] if _is_given(scene) else None,
        "skipped": list(_skipped(found, built, solver)),
        "steps": found.seconds,
        "peak_rss_mib": resident_mib("VmHWM"),
        "machine": machine()["machine"],
        **provenance(),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _skipped(found: Solution, built: set[Stage], solver: str | None) -> Iterator[str]:
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
    elif _is_of_plates(found.problem.scene) and Stage.CONDENSATION not in built:
        yield "condensation: the parts came from the cache"


def _is_given(scene: Scene) -> bool:
    """Whether the entries of its K were read from files."""
    return isinstance(scene, MatricesScene) or (isinstance(scene, JointScene) and not _is_of_plates(scene))


def _is_of_plates(scene: Scene) -> bool:
    return isinstance(scene, JointScene) and isinstance(scene.joint, Joint)


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


def layout(scene: Scene, assembly: Assembly) -> dict[str, Any]:
    """The ranges of parts in the displacements shown and of pairs in λ, and what a picture marks."""
    if not isinstance(scene, JointScene):
        nodes = assembly.nodes if assembly.nodes is not None else np.zeros((assembly.n, 2))
        spans = zip(assembly.parts, assembly.K.slices, strict=True)
        parts = [_part(name, s.start, s.stop, _extent(nodes[s])) for name, s in spans]
        pairs = [{"pair": ["all parts"], "start": 0, "stop": assembly.m}] if assembly.m else []
        return {"parts": parts, "pairs": pairs, "marks": {}}
    joint, parts, start = scene.joint, [], 0
    for name in joint.names:
        stop, (outline, clamped) = start + len(joint.nodes_of(name)), joint.outline(name)
        held = [point for e in scene.stiffness_effects if e.part == name for point in e.held_points]
        parts.append(_part(name, start, stop, outline, clamped, held))
        start = stop
    own = [(pair, joint.span(pair)) for pair in joint.pairs]
    pairs = [{"pair": pair, "start": span.start, "stop": span.stop} for pair, span in own]
    marks: dict[str, list[list[float]]] = {}
    for effect in scene.effects:
        if len(points := effect.marks(joint)):
            marks.setdefault(effect.kind, []).extend(points.tolist())
    return {"parts": parts, "pairs": pairs, "marks": marks}


def _part(
    name: str, start: int, stop: int, outline: list[float], clamped: Sequence[str] = (), supports: Any = ()
) -> dict[str, Any]:
    ends = {"name": name, "start": start, "stop": stop, "outline": outline}
    return ends | {"clamped": list(clamped), "supports": list(supports)}


def _extent(nodes: Vector) -> list[float]:
    """The smallest and largest x, then y, of some nodes."""
    return np.column_stack([nodes.min(axis=0), nodes.max(axis=0)]).ravel().tolist()


def fastener_forces(scene: Scene, x: Vector) -> list[dict[str, Any]]:
    """One entry per fastener and contact: kind, pair, x and y in mm, force_N. x : (n,) mm."""
    if not isinstance(scene, JointScene):
        return []
    return [entry for effect in scene.effects for entry in _of_effect(effect, scene.joint, x)]


def _of_effect(effect: Effect, joint: AnyJoint, x: Vector) -> Iterator[dict[str, Any]]:
    given: Any = effect  # its kind is not imported here, so that no other is
    if isinstance(effect, SpringEffect):
        T, k = effect.springs(joint)
        pairs, forces = effect.tied(joint), (k * (given.approach - T.T @ x)).tolist()
    elif preloads := [getattr(effect, name) for name in FORCES if hasattr(effect, name)]:
        pairs, forces = given.pairs(joint), repeat(*preloads)
    else:
        return
    places = product(pairs, given.marks(joint).tolist())
    for (pair, (x, y)), force in zip(places, forces, strict=False):
        yield {"kind": effect.kind, "pair": list(pair), "x": x, "y": y, "force_N": force}
