"""The stresses of a scene's plates, or those that superelements recover, with the error proven for them.

No stress is off by more than its sensitivity (problems/model/stress.py) times ‖x − x*‖_K, which the proof
bounds for the x that is stored, with its rounding. To an answer of a solver its distance from the reference
is added. The sparse form has all unknowns in x. In the dense forms those inside a part are recovered, and
‖x − x*‖_K is that of all of them, too; the roundings of condensation and recovery are not counted. Nor is the
error of the mesh (mesh_error.py). No error is known if fasteners have locked what is not proven.

The sensitivity of a row s of a recovery matrix is ‖s‖_{K⁻¹} ≤ ‖z‖_K + ‖r‖₂/√κ in balanced units, r = s − K z
with z ≈ K⁻¹s, κ ≤ λmin(K). r is rounded by γ_{n+2} (‖s‖₂ + ‖K‖_∞ ‖z‖₂).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from harness.results.schema import EXCEEDED
from harness.verification.enclosure import SAFE, length
from harness.verification.proof import Proof
from harness.verification.reference import proof_of
from problems.build import model_of
from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector
from problems.model.joint import Joint
from problems.model.joint_model import JointModel
from problems.model.positions import Positions
from problems.model.scene import JointScene, Scene
from problems.model.stress import PartStress, part_stress
from problems.stiffness import gamma
from report.document.numbers import beside, proven_to

from .mesh_error import MeshError
from .solution import Solution

NONE = "leave it out: only plates have stresses, and superelements with `stress` and `stress_points`"
FACES = ("both faces", "the top", "the bottom")  # 0, 1, -1
ROWS = 300  # of a recovery matrix, at a time


@dataclass(frozen=True)
class Stresses:
    """The stresses of all parts.

    Parameters
    ----------
    parts : tuple of PartStress
        Those of each part, N/mm².
    errors : tuple of array
        (k,) N/mm², of each part: how far its stresses are from the exact ones at most.
    """

    parts: tuple[PartStress, ...]
    errors: tuple[Vector, ...]

    @cached_property
    def largest(self) -> dict[str, Any]:
        """The largest von Mises stress where no force at a point is near: part, x, y, face, value, error."""
        best: dict[str, Any] = {}
        for part, error in zip(self.parts, self.errors, strict=True):
            value = np.where(part.near_force, -1.0, part.von_mises)
            if value.max(initial=-1.0) > best.get("von_mises", -1.0):
                k = int(value.argmax())
                x, y = part.places[k].tolist()
                best = {"part": part.part, "x": x, "y": y, "face": FACES[part.side[k]]}
                best |= {"von_mises": float(value[k]), "error": float(error[k])}
        return best

    @property
    def arrays(self) -> dict[str, Any]:
        """The arrays of DIR/solution.npz; part is its number."""
        counts = [len(part.places) for part in self.parts]
        return {
            "stress_part": np.arange(len(counts)).repeat(counts),
            "stress_places": np.concatenate([part.places for part in self.parts]),
            "stress": np.concatenate([part.components for part in self.parts]),
            "stress_side": np.concatenate([part.side for part in self.parts]),
            "stress_error": np.concatenate(self.errors),
            "stress_near_force": np.concatenate([part.near_force for part in self.parts]),
        }

    def exceeded(self, allowed: float) -> bool | None:
        """Whether a von Mises stress away from forces at points is larger; None if it cannot be told, as
        where a stress or its error overflows.
        """
        pairs = zip(self.parts, self.errors, strict=True)
        told = [(part.von_mises[~part.near_force], e[~part.near_force]) for part, e in pairs]
        if any((value[value < np.inf] - e[value < np.inf] > allowed).any() for value, e in told):
            return True
        return False if all((value + e <= allowed).all() for value, e in told) else None


def stress_record(assembly_stress: Stresses, mesh: MeshError | None, allowed: float | None) -> dict[str, Any]:
    """The entry `stress` of solution.json: the largest von Mises stress, and a sentence with a verdict.

    kind : "pass", "fail", or "" without a limit or if it cannot be told.
    """
    largest = assembly_stress.largest
    if not largest:
        untold = {} if allowed is None else {"allowed": allowed, "exceeded": None}
        return untold | {"kind": "", "said": "Forces at points act near all elements: no stress is told"}
    at = f"{largest['part']}, on {largest['face']}, x = {largest['x']:.4g} mm, y = {largest['y']:.4g} mm"
    shown = beside(0.0 if allowed is None else allowed)(largest["von_mises"])
    said = f"largest von Mises stress {shown} N/mm², {at}"
    said += f"; {proven_to(largest['error'], 'N/mm²')}"
    grid = None if mesh is None else mesh.stress
    said += ", mesh error not known" if grid is None else f", mesh error about {grid:.1g} N/mm²"
    if none := [part.part for part in assembly_stress.parts if part.near_force.all()]:  # or no point at all
        said += f", none known of {', '.join(none)}"
    record: dict[str, Any] = {"largest": largest, "mesh_error": grid, "kind": ""}
    if allowed is None:
        return record | {"said": said[0].upper() + said[1:]}
    exceeded = assembly_stress.exceeded(allowed)
    if grid is not None and abs(largest["von_mises"] - allowed) <= grid:
        said += ", closer to the limit than the mesh can tell"
    kind = {None: "", True: "fail", False: "pass"}[exceeded]
    said = f"{EXCEEDED[exceeded].upper()}: limit {allowed:g} N/mm²; {said}"
    return record | {"allowed": allowed, "exceeded": exceeded, "kind": kind, "said": said}


def refuse_unusable(allowed: float | None, scene: Scene) -> None:
    """Raise InputError unless it is a stress, or None, and parts have stresses."""
    if allowed is not None and not 0 < allowed < np.inf:
        raise InputError.one("--allow-stress", "stress, N/mm²", allowed, "must be positive and finite")
    _ = [part.recovery for part, _ in _superelements(scene)]


def none_told(scene: JointScene) -> bool:
    """Whether forces at points act near all elements of all parts; factors no K."""
    model = model_of(scene)
    size = model.numbering.size if isinstance(model, JointModel) else scene.joint.size[0]
    return all(part.near_force.all() for part in stresses_of(scene, np.zeros(size)))


def largest_of(
    scene: JointScene, x: Vector, energy: float = 0.0, point_sensitivities: Sequence[Vector] = ()
) -> float:
    """The largest von Mises stress away from forces at points, N/mm², no less than it can be; infinite
    if no place is away from them.

    x : as in `stresses_of`, ± energy, ‖x − x*‖_K. point_sensitivities : see `sensitivities`.
    """
    parts, largest = stresses_of(scene, x), 0.0
    if all(part.near_force.all() for part in parts):
        return np.inf
    for part, error in zip(parts, point_sensitivities or [part.sensitivity for part in parts], strict=True):
        with np.errstate(over="ignore", invalid="ignore"):
            upper = part.von_mises + (energy * error if energy else 0.0)  # an error may be infinite
        known = np.where(np.isnan(upper), np.inf, upper)[~part.near_force]
        largest = max(largest, float(known.max(initial=0.0)))
    return largest


def sensitivities(scene: Scene, proof: Proof) -> list[Vector]:
    """The sensitivities (k,) at the points of each superelement.

    An empty list for plates, whose stresses have them.
    """
    return [_sensitivity(part.recovery.S, at, proof) for part, at in _superelements(scene)]


def stresses(solution: Solution) -> Stresses:
    """The stresses of a solution's plates or superelements, after its last stage.

    Parameters
    ----------
    solution : Solution
        Of a joint of plates, or of superelements with recovery matrices.

    Returns
    -------
    Stresses
        N/mm². Of plates at the 2 × 2 Gauss points of each element, on the face in the direction of positive
        displacements; on the other face they have the other sign. Of superelements at their points.

    Raises
    ------
    InputError
        If no part has stresses, or a recovery matrix is wrong.

    Examples
    --------
    >>> from rivetbench import solve, stresses
    >>> of_sheet = stresses(solve("gallery/heavy-sheet-on-tool")).largest
    >>> print(f"{of_sheet['von_mises']:.2f} N/mm², {of_sheet['part']}")
    2.13 N/mm², sheet
    """
    problem, reference = solution.problem, solution.problem.reference
    parts = stresses_of(problem.scene, solution.unknowns)
    proof = proof_of(problem.prepared)
    energy = proof.energy_error(problem.load, reference.x, reference.lam)
    point_sensitivities = sensitivities(problem.scene, proof) or [part.sensitivity for part in parts]
    locks = np.inf if solution.stages and not np.isfinite(solution.gap_error_mm).all() else 0.0
    errors = [energy * one + locks for one in point_sensitivities]
    if not solution.from_reference:
        exact = stresses_of(problem.scene, reference.x)
        for part, other, error in zip(parts, exact, errors, strict=True):
            error += np.sqrt(3) * abs(part.components - other.components).sum(axis=1)
    return Stresses(parts, tuple(np.where(np.isnan(error), np.inf, error) for error in errors))


def stresses_of(scene: Scene, x: Vector) -> tuple[PartStress, ...]:
    """The stresses of each part. x : (n,) at the junction or û (N,), mm. Raises InputError as `stresses`."""
    if elements := _superelements(scene):
        return tuple(part.recovery.stress(part.name, x[at]) for part, at in elements)
    assert isinstance(scene, JointScene)
    model = model_of(scene)
    assert isinstance(model, JointModel)
    return tuple(
        part_stress(name, part, model.part_loads(k), model.part_unknowns(k, x), _forces(scene, name))
        for k, (name, part) in enumerate(zip(scene.joint.names, model.parts, strict=True))
    )


def _superelements(scene: Scene) -> list[tuple[Any, slice]]:
    """The superelements, and their unknowns; none of plates. Raises InputError if no part has stresses."""
    joint: Any = getattr(scene, "joint", None)
    if isinstance(joint, Joint):
        return []
    if joint is None or not any(part.stress_files for part in joint.parts):
        raise InputError.one("stress", "scene", scene.name, NONE)
    return [(part, joint.unknowns(part.name)) for part in joint.parts]


def _sensitivity(S: sp.csr_array, at: slice, proof: Proof) -> Vector:
    """The sensitivities (k,) of the points of a recovery matrix S (3k, n) of the unknowns `at`.

    See PartStress.
    """
    units, norms = proof.balanced, np.zeros(S.shape[0])
    for start in range(0, len(norms), ROWS):
        rows = slice(start, start + ROWS)
        s = np.zeros((len(units.D), len(norms[rows])))
        s[at] = S[rows].toarray().T
        s *= units.D
        z = units.solve(s)
        r = length(s - units.D * units.assembly.K.multiply(units.D * z))
        r += gamma(len(s) + 2) * (length(s) + units.stiffest * length(z))
        norms[rows] = units.energy_norm(z) + SAFE * r / np.sqrt(proof.kappa)
    xx, yy, xy = norms.reshape(-1, 3).T
    return np.asarray(SAFE * np.sqrt(1.5 * (xx**2 + yy**2) + 3 * xy**2))


def _forces(scene: JointScene, part: str) -> Matrix:
    """(k, 2) the places of forces at points of a part, mm."""
    held = [
        point for effect in scene.stiffness_effects if effect.part == part for point in effect.held_points
    ]
    pressed = [
        effect.marks(scene.joint)
        for effect in scene.effects_of(Positions)
        if effect.in_holes and part in effect.parts(scene.joint)
    ]
    return np.concatenate([np.reshape(held, (-1, 2)), *pressed])
