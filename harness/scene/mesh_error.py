"""Estimates how far the gaps of an answer move on a finer mesh, from the same joint on other meshes.

The proven bound of an answer does not cover the error of the mesh. That error is not known, but shows when
the joint is solved on another mesh. On a coarser one, with r times the distance between lines,

    e_h ≈ max |y_h − y_rh| / (r − 1)

at its contacts, or of the largest gaps of a pair, as gaps may be all between them: a rough figure, which
assumes that the error falls like h. On a finer one, with h/2,

    e_h ≈ 4/3 max |y_h − y_h/2|,

which assumes that it falls like h²; the order observed on three meshes is printed beside it. On ten scenes,
compared with meshes of 3 to 6 times as many lines, the second figure was within a factor of two on nine, the
first on four; the tenth is a sheet over a former, whose contact ends at one node or the next. The initial gap
is that of the answer, interpolated. All meshes are solved in the sparse form.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from harness.scene.solution import Solution
from harness.solving.solver_session import candidate_forces
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.model.effect import GapEffect
from problems.model.joint import Extension, Joint, Part
from problems.model.junction_terms import junction_load
from problems.model.scene import JointScene
from problems.model.stage_answers import Elongations, locked, through


@dataclass(frozen=True)
class MeshError:
    """An estimate. error_mm : of the gaps. grids : number of meshes. order : observed on three, else None.
    stress : of the largest von Mises stress, N/mm², from the coarser mesh; None unless it was asked for, and
    where a stress is not known.
    """

    error_mm: float
    grids: int
    order: float | None = None
    stress: float | None = None


def estimated(
    solution: Solution,
    refine: bool = False,
    largest_stress: Callable[[JointScene, Vector], float] | None = None,
) -> MeshError | None:
    """The mesh error of an answer.

    None for given matrices and superelements, whose mesh is not known; without contacts or a coarser mesh;
    and where another mesh has no answer. refine : solve on a finer mesh too, with four times the unknowns. r
    is the smaller of the ratios of the distances between lines, along x and along y, that are above 1.
    largest_stress : of an answer û to a scene without stages.
    """
    scene = solution.problem.scene
    joint = scene.joint if isinstance(scene, JointScene) else None
    if not isinstance(joint, Joint) or not len(solution.gap):
        return None
    coarse = remeshed(joint, 0.5)
    pairs = zip(joint.junction.nodes, coarse.junction.nodes, strict=True)
    ratios = [(fine - 1) / (few - 1) for fine, few in pairs if few < fine]
    if not ratios:
        return None
    try:
        moved, last, x = on_mesh(solution, coarse)
        halved = on_mesh(solution, remeshed(joint, 2.0))[0] if refine else None
    except InputError:  # the answer stands without
        return None
    stress = None
    if largest_stress is not None:
        here, there = largest_stress(replace(last, joint=joint), solution.unknowns), largest_stress(last, x)
        if max(here, there) < np.inf:
            stress = abs(here - there) / (min(ratios) - 1)
    if halved is None:
        return MeshError(moved / (min(ratios) - 1), 2, stress=stress)
    return MeshError(halved * 4 / 3, 3, float(np.log2(moved / halved)) if moved and halved else None, stress)


def mesh_record(error: MeshError | None) -> dict[str, Any]:
    """The entry `grid` of solution.json, with a sentence."""
    if error is None:
        return {"said": "Mesh error: not known here"}
    how = "estimated from two meshes; --refine: three"
    if error.grids == 3:
        order = "" if error.order is None else f", of observed order {error.order:.1f}"
        how = f"estimated from three meshes{order}"
    return asdict(error) | {"said": f"Mesh error: about {error.error_mm:.1g} mm of a gap ({how})"}


def remeshed(joint: Joint, factor: float) -> Joint:
    """The joint with `factor` times as many elements along each side, at least one, rounded up."""

    def elements(count: int) -> int:
        return max(int(np.ceil(count * factor)), 1)

    def extensions(part: Part) -> dict[str, Extension | None]:
        sides = {"south": part.south, "north": part.north}
        return {k: e and e.model_copy(update={"elements": elements(e.elements)}) for k, e in sides.items()}

    nx, ny = (elements(count - 1) + 1 for count in joint.junction.nodes)
    parts = [part.model_copy(update=extensions(part)) for part in joint.part]
    junction = joint.junction.model_copy(update={"nodes": (nx, ny)})
    return joint.model_copy(update={"junction": junction, "part": tuple(parts)})


def _at_its_points(effect: Any, joint: Joint) -> Any:
    """The effect with the points of its pattern, which may be moved to the nodes of a mesh."""
    if getattr(effect, "pattern", None) is None:
        return effect
    points = tuple(map(tuple, effect.marks(joint).tolist()))
    return effect.model_copy(update={"points": points, "pattern": None})


def on_mesh(solution: Solution, joint: Joint) -> tuple[float, JointScene, Vector]:
    """max |y_h − y| over the contacts of the coarser of the two meshes, y the gaps on another mesh, and over
    the largest gaps of the pairs, mm; and the scene there, without stages, with its û.

    Raises InputError if the other mesh has no answer.
    """
    scene: Any = solution.scene
    here = scene.joint
    effects = [_at_its_points(effect, here) for effect in scene.effects]
    other = replace(scene, joint=joint, effects=tuple(effects))

    def answer(part: JointScene, approaches: Matrix) -> tuple[Elongations, tuple[Vector, JointScene, Vector]]:
        """Elongations of a stage on the other mesh; its gaps, its scene, and û."""
        gaps = [effect for effect in part.effects if isinstance(effect, GapEffect)]
        rest = [effect for effect in part.effects if not isinstance(effect, GapEffect)]
        one = locked(replace(part, effects=tuple(rest)), approaches[:, 0])
        data = prepared(one, form="sparse")
        load = LoadCase(load_case(one, "sparse").f, _at(here, junction_load(gaps, here)[1], joint.nodes))
        _, lam = next(candidate_forces(data, load), ("", None))
        if lam is None:
            raise InputError.one(other.name, "mesh", list(joint.junction.nodes), "one with an answer")
        A = data.assembly.A
        x = data.assembly.K.solve(load.f - A @ lam)
        return lambda T: T.T @ data.assembly.at_junction(x), (load.g - A.T @ x, one, x)

    *_, (_, _, _, (gap, last, x)) = through(other, answer)
    nodes = min(here.nodes, joint.nodes, key=len)
    moved = _at(here, solution.gap, nodes) - _at(joint, gap, nodes)
    mine, its = (each.reshape(len(joint.pairs), -1).max(axis=1) for each in (solution.gap, gap))
    return float(abs(np.append(moved, mine - its)).max()), last, x


def _at(joint: Joint, values: Vector, places: Matrix) -> Vector:
    """Values at the contacts, interpolated to the same places of each pair."""
    of_pairs = values.reshape(len(joint.pairs), joint.node_count)
    return np.asarray(joint.weights(places) @ of_pairs.T).T.ravel()
