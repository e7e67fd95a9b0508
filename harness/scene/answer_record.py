"""The files of an answer, from which the report draws it: the arrays solution.npz, the record solution.json.

The record holds how the scene was solved, in which steps and time, what was skipped, and the error bound. It
also says where parts and contacts are in x and λ, what a picture marks, and the force in each fastener.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy.sparse as sp

from harness.results.provenance import resident_mib, stamp
from harness.verification.judge import LIMIT_MM
from harness.verification.reference import UNPROVEN
from problems.forms.assembly import Assembly, Vector
from problems.model.fastener_forces import fastener_forces
from problems.model.joint import Joint
from problems.model.scene import JointScene, MatricesScene, Scene
from problems.reporter import Stage
from problems.stiffness import SAFE, gamma
from report.document.numbers import upwards

from .solution import Solution
from .stages import StageAnswer
from .validate import digits_sentence


def arrays_of(solution: Solution) -> dict[str, Any]:
    """The arrays of DIR/solution.npz.

    Where parts keep more than the displacement along the normal of each node, x and A have these
    displacements alone, and `unknowns` is all of x.
    """
    assembly, scene = solution.problem.prepared.assembly, solution.problem.scene
    x, A, nodes, more = solution.x, *map(assembly.at_junction, (assembly.A, assembly.nodes)), {}
    if isinstance(scene, JointScene) and (D := scene.joint.shown) is not None:
        more, x, A = {"unknowns": x}, D @ x, sp.csc_array(D @ A)
        nodes = np.concatenate([scene.joint.nodes_of(name) for name in scene.joint.names])
    gaps = {"gap_before": solution.problem.load.g, "gap_after": solution.gap}
    arrays: dict[str, Any] = more | gaps | {"x": x, "lam": solution.lam}
    if solution.stages:
        arrays["stage_gaps"] = np.array([stage.gap for stage in solution.stages])
    arrays |= {"A_data": A.data, "A_indices": A.indices, "A_indptr": A.indptr}
    if isinstance(scene, JointScene) and (ids := scene.joint.ids) is not None:
        arrays |= {"node_ids": ids[0], "contact_ids": ids[1]}
    return arrays if nodes is None else arrays | {"nodes": nodes, "contact_nodes": assembly.contact_nodes}


def bound_shown(solution: Solution) -> float:
    """The bound of the reference, no less than that of its normal displacements Dx, if these are shown, mm;
    infinite if fasteners have locked what is not proven.

    Of a row of D with q entries the computed sum is off by at most γ_q |D||x|, and by Σ|D| times the bound.
    """
    bound, scene = solution.problem.reference.bound_mm, solution.problem.scene
    if solution.stages and not np.isfinite(solution.gap_error_mm).all():
        return np.inf
    if not isinstance(scene, JointScene) or (D := scene.joint.shown) is None or not np.isfinite(bound):
        return bound
    size = abs(D)
    away = size.sum(axis=1) * bound + gamma(np.diff(D.indptr) + 1) * (size @ abs(solution.x))
    return max(bound, SAFE * float(away.max(initial=0.0)))


def recorded(solution: Solution, built: set[Stage], solver: str | None) -> dict[str, Any]:
    """The record DIR/solution.json, but for its inputs. built : the stages that the cache did not hold.
    solver : asked for.
    """
    problem, judgement = solution.problem, solution.judgement
    scene, data, reference = solution.scene, problem.prepared, problem.reference
    from_files = isinstance(scene, MatricesScene | JointScene) and not is_of_plates(scene)  # the entries of K
    return {
        "method": solution.method,
        "status": solution.status,
        "verdict": judgement.verdict,
        "judged_error_mm": None if solution.from_reference else judgement.displacement_error_mm,
        "iterations": solution.iterations,
        "scene": scene.name,
        "title": scene.title,
        "scene_key": scene.key,
        "form": problem.form,
        "n": data.assembly.junction_size,
        "unknowns": data.assembly.n,
        "m": data.assembly.m,
        "cond_K": data.facts.get("cond_K"),
        "qp": solution.has_contact,
        "closest_mm": solution.closest_mm,
        "error_bound_mm": bound_shown(solution),
        "route": reference.route,
        "unusual": scene.unusual,
        **layout(problem.scene, data.assembly),
        "fasteners": list(fastener_forces(problem.scene, solution.x)),
        **({"stages": [_stage(stage) for stage in solution.stages]} if solution.stages else {}),
        "digits": digits_sentence(problem, solved=True)[0] if from_files else None,
        "skipped": list(_skipped(solution, built, solver)),
        "steps": solution.seconds,
        "peak_rss_mib": resident_mib("VmHWM"),
        **stamp(),
    }


def _skipped(solution: Solution, built: set[Stage], solver: str | None) -> Iterator[str]:
    if not solution.has_contact:
        instead = f"; {solver} was not run" if solver else ""
        why = "The scene has no contact"
        if solution.closest_mm is not None:
            closest = f"the closest contact stays {solution.closest_mm:.3g} mm open"
            why = f"The answer without contact violates no gap, {closest}"
        yield f"the quadratic program: it was not called for. {why}{instead}"
    if solution.problem.form == "sparse":
        Q = "" if "Q" in solution.problem.prepared.opened else " and Q"
        yield f"condensation, dense factors{Q}: the sparse model was solved as it is"
    elif not built:
        yield "condensation, Cholesky factors and Q: the assembly came from the cache"
    elif is_of_plates(solution.problem.scene) and Stage.CONDENSATION not in built:
        yield "condensation: the parts came from the cache"


def summary(record: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Sentences with their styles: the digits of K, what was skipped, and the answer with its bound."""
    if record["digits"]:
        yield f"{record['digits']}.", ""
    for line in record["skipped"]:
        yield f"Skipped: {line}.", "dim"
    error, bound = record["judged_error_mm"], record["error_bound_mm"]
    proven = np.isfinite(bound)
    if error is None:
        where = " of the last stage" if "stages" in record else ""
        text = f"a bound {UNPROVEN}"
        if proven:
            text = f"every displacement{where} within {upwards(bound)} mm, proven"
    else:
        which = f"with a proven bound ({upwards(bound)} mm)" if proven else f"whose bound {UNPROVEN}"
        away = f"{error:.1e} mm from the answer {which}"
        text = f"{record['status']}, {away}: {record['verdict']} {LIMIT_MM:g} mm"
    yield f"{record['method']}: {text}.", "green" if record["verdict"] == "within" else "red"


def is_of_plates(scene: Scene) -> bool:
    """Whether its joint is made of plates, so that their mesh is known."""
    return isinstance(scene, JointScene) and isinstance(scene.joint, Joint)


def layout(scene: Scene, assembly: Assembly) -> dict[str, Any]:
    """The ranges of parts in the displacements shown and of pairs in λ, and points that a picture marks."""
    if not isinstance(scene, JointScene):
        nodes = assembly.nodes if assembly.nodes is not None else np.zeros((assembly.n, 2))
        spans = zip(assembly.parts, assembly.K.slices, strict=True)
        parts = [_part(name, rows, _extent(nodes[rows])) for name, rows in spans]
        pairs = [{"pair": ["all parts"], "start": 0, "stop": assembly.m}] if assembly.m else []
        return {"parts": parts, "pairs": pairs, "marks": {}}
    joint, parts, start = scene.joint, [], 0
    for name in joint.names:
        stop, (outline, clamped) = start + len(joint.nodes_of(name)), joint.outline(name)
        held = [point for e in scene.stiffness_effects if e.part == name for point in e.held_points]
        parts.append(_part(name, slice(start, stop), outline) | {"clamped": list(clamped), "supports": held})
        start = stop
    pairs = [{"pair": p, "start": joint.span(p).start, "stop": joint.span(p).stop} for p in joint.pairs]
    return {"parts": parts, "pairs": pairs, "marks": _marks(scene)}


def _marks(scene: JointScene) -> dict[str, list[list[float]]]:
    """The points that a picture marks, by the kind of effect."""
    marks: dict[str, list[list[float]]] = {}
    for effect in scene.effects:
        if len(points := effect.marks(scene.joint)):
            marks.setdefault(effect.kind, []).extend(points.tolist())
    return marks


def _stage(stage: StageAnswer) -> dict[str, Any]:
    return {
        "name": stage.name,
        "verdict": stage.judgement.verdict,
        "error_bound_mm": stage.error_bound_mm,
        "closed": None if np.isnan(stage.lam).any() else int((stage.lam > 0).sum()),
        "forces_N": stage.forces,
        "marks": _marks(stage.scene),
    }


def _part(name: str, rows: slice, outline: list[float]) -> dict[str, Any]:
    ends = {"start": rows.start, "stop": rows.stop}
    return {"name": name, **ends, "outline": outline, "clamped": [], "supports": []}


def _extent(nodes: Vector) -> list[float]:
    """The smallest and largest x, then y, of some nodes."""
    return np.column_stack([nodes.min(axis=0), nodes.max(axis=0)]).ravel().tolist()
