"""A scene with its matrices and its reference, on which answers are judged; its row in problems.jsonl."""

import time
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from harness.planning.form_choice import form_of_stages
from harness.results import records
from harness.results.answer_files import read_answer
from problems import storage
from problems.build import adopts_model, load_case, prepared
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.prepared import Prepared
from problems.model.effect import code_of
from problems.model.scene import JointScene, Scene
from problems.model.stage_answers import Elongations, last_scene, locked, through
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene

from .judge import LIMIT_MM, REFERENCE_SHARE, Judgement, Reference, conditioned_limit, judge
from .reference import UNPROVEN, Candidate, default_limit_s, reference, reference_of

PROBLEMS = "problems.jsonl"


@dataclass(frozen=True)
class ReferenceProblem:
    """A scene whose answers can be measured and judged; its reference is proven when it is first asked for.

    limit_s : after it no further candidate for the reference is tried. case : the number of the load case in
    a series; None for the scene's own. first : candidates that are tried before the in-house methods.
    locks_proven : whether the answers of earlier stages, in which fasteners lock, are proven; if not, nor is
    the reference. scene_key : that of the scene before its files were read.
    """

    scene: Scene
    prepared: Prepared
    load: LoadCase
    form: Form
    limit_s: float | None = None
    case: int | None = None
    first: list[Candidate] = field(default_factory=list)
    locks_proven: bool = True
    scene_key: str = ""

    @cached_property
    def reference(self) -> Reference:
        return self._proven[0]

    @property
    def reference_s(self) -> float:
        """The seconds that the reference took."""
        return self._proven[1]

    @cached_property
    def _proven(self) -> tuple[Reference, float]:
        start = time.perf_counter()
        if self.case is None:
            proven = reference_of(self.scene, self.prepared, self.load, self.limit_s, self.first)
        else:
            proven = reference(self.prepared, self.load, self.limit_s, self.first)
        if not self.locks_proven:
            proven = replace(proven, bound_mm=inf, route=f"{UNPROVEN}: what earlier stages lock")
        return proven, time.perf_counter() - start

    def add_candidate(self, name: str, path: Path) -> None:
        """Let the forces of a saved answer be a candidate of that name, if they can be read."""
        with suppress(OSError, ValueError, KeyError):
            lam = read_answer(path)["lam"]
            if lam.dtype.kind == "f" and lam.shape == self.load.g.shape and np.isfinite(lam).all():
                self.first.append((f"{name}, refined", lam))

    def limit_mm(self, usual_mm: float) -> float:
        """The limit on an answer: the usual one; on a rung of a ladder no less than conditioning allows."""
        if not self.scene.on_ladder:
            return usual_mm
        data = self.prepared
        largest = float(np.max(np.abs(self.reference.x) * self.reference.unit_mm))
        return conditioned_limit(usual_mm, data.condition, largest)

    def of_case(self, series: dict[str, Any] | None, case: int | None) -> "ReferenceProblem":
        """The problem of a load case of a series, with a reference of its own."""
        if series is None or case is None:
            return self
        from problems.load_cases.stream import drawn_cases  # of a series only

        load = drawn_cases(self.scene, self.form, **series).load(case)
        return replace(self, load=load, case=case, first=[])

    def judged(self, x: Vector, lam: Vector, limit_mm: float) -> Judgement:
        """The judgement of x (all unknowns of the form, mm) and lam (m,) N, NaN if there are none."""
        return judge(self.prepared, self.load, self.reference, x, lam, limit_mm)

    def judge_file(self, path: Path, limit_mm: float) -> Judgement:
        """Judge a saved answer; one that cannot be read is none."""
        try:
            saved = read_answer(path)
            x, lam = saved["x"], saved["lam"]
        except (OSError, ValueError, KeyError):
            return Judgement("no_answer", self.reference.bound_mm)
        if not x.dtype.kind == lam.dtype.kind == "f":
            return Judgement("no_answer", self.reference.bound_mm)
        return self.judged(x, lam, limit_mm)


def open_problem(
    scene: Scene,
    form: Form = "dual",
    reporter: Reporter = SILENT,
    limit_s: float | None = None,
    like: ReferenceProblem | None = None,
) -> ReferenceProblem:
    """Open or build the problem of a scene, or of its last stage. Raises InputError.

    form : the form of the answers; in the sparse form, x has an entry per unknown of the model. like : a
    problem in this form whose matrices are taken, with their factors, if they are those of the scene.
    """
    if limit_s is not None and not limit_s >= 0:
        raise InputError.one("--reference-limit", "seconds", limit_s, "0 or larger")
    key = scene.key  # its files may change when they have been read
    last, locks_proven = last_stage(scene, limit_s)
    shared = like is not None and adopts_model(last, like.scene)
    data = like.prepared if like is not None and shared else prepared(last, reporter, form)
    limit_s = default_limit_s(data.assembly.m) if limit_s is None else limit_s
    load = load_case(last, form)
    return ReferenceProblem(scene, data, load, form, limit_s, locks_proven=locks_proven, scene_key=key)


def last_stage(scene: Scene, limit_s: float | None = None) -> tuple[Scene, bool]:
    """The last stage of a scene as a scene of its own, and whether the approaches that it has are proven; the
    scene itself if it has no stages.

    The approaches are those of the references of the stages before, solved in the sparse form unless matrices
    are dense. Proven ones are in the cache, so that all processes have the same. Raises InputError.
    limit_s : see ReferenceProblem.
    """
    if not (isinstance(scene, JointScene) and scene.stages):
        return scene, True
    files = [Path(__file__), *code_of(scene.effects)]
    code = storage.fingerprint(files, within=["harness/verification", "problems"])
    key, last = storage.digest("stages", scene.key, code), last_scene(scene)
    if (stored := storage.load(key)) is not None:
        return locked(last, stored[0]["approaches"][:, 0]), True
    form, like, bounds = form_of_stages(scene), None, [0.0]

    def solve(part: JointScene, approaches: Matrix) -> tuple[Elongations, None]:
        nonlocal like
        like = open_problem(locked(part, approaches[:, 0]), form, limit_s=limit_s, like=like)
        answer, at_junction = like.reference, like.prepared.assembly.at_junction

        def elongations(T: sp.csc_array) -> Matrix:
            bounds.append(answer.bound_mm)
            return T.T @ at_junction(answer.x)

        return elongations, None

    *_, (_, _, approaches, _) = through(scene, solve)
    if proven := max(bounds) <= REFERENCE_SHARE * LIMIT_MM:
        stored = storage.load_or_make(key, lambda: ({"approaches": approaches}, {}))  # another's, if faster
        approaches = np.array(stored[0]["approaches"])
    return locked(last, approaches[:, 0]), proven


def measurable(
    source: str | Scene,
    reporter: Reporter = SILENT,
    limit_s: float | None = None,
    form: Form = "dual",
) -> ReferenceProblem:
    """Open or build a scene, or that of a name or path, that a solver can be measured on. Raises InputError,
    also if K is not positive definite.
    """
    scene = read_scene(source) if isinstance(source, str) else source
    problem = open_problem(scene, form, reporter, limit_s)
    refuse_without_contacts(problem.prepared, problem.scene.source_of("A"))
    reporter.progress("factors of K")
    problem.prepared.assembly.K.ensure_factored()
    return problem


def refuse_without_contacts(prepared: Prepared, where: object) -> None:
    """Raise InputError if there is no contact, and nothing but linear equations to solve."""
    if prepared.assembly.m == 0:
        allowed = "at least one, else there is no quadratic program to measure: `solve` answers the scene"
        raise InputError.one(where, "contacts", 0, allowed)


def record(problem: ReferenceProblem, directory: Path, machine: str) -> None:
    """Put the scene into DIRECTORY/problems.jsonl and its contacts into DIRECTORY/scenes/NAME.npz.

    machine : whose seconds these are. The facts of a reference in the sparse form are under `sparse`.
    """
    scene, assembly, reference = problem.scene, problem.prepared.assembly, problem.reference
    facts = problem.prepared.facts
    of_family: dict[str, Any] = {
        "build_s": facts.get("seconds"),
        "stored_mib": problem.prepared.stored_mib,
        "reference_s": problem.reference_s,
        "reference_bound_mm": reference.bound_mm,
        "reference_route": reference.route,
    }
    row: dict[str, Any] = {
        "scene": scene.name,
        "title": scene.title,
        "scene_key": problem.scene_key,
        "machine": machine,
        "n": assembly.junction_size,
        "m": assembly.m,
        "active": int(reference.active.sum()),
        **{name: facts.get(name) for name in ("cond_K", "lambda_min", "lambda_max")},
        **of_family,
    }
    if printed := scene.printed:
        row |= {"printed_objective": printed.value, "printed_digits": printed.digits}
        row["printed_source"] = printed.source
    same = [each for each in records.read(directory / PROBLEMS) if each["scene"] == scene.name]
    recorded = {each.get("machine"): each for each in same if each.get("scene_key") == problem.scene_key}
    earlier = recorded.get(machine) or recorded.get(None)
    sparse = earlier.get("sparse", {}) if earlier else {}
    if problem.form == "sparse":
        sparse |= {"unknowns": assembly.n, **of_family}
        row = (earlier or row) | {"machine": machine, "sparse": sparse}
    elif sparse:
        row["sparse"] = sparse
    _put(row, directory)
    x, g = reference.x, problem.load.g
    arrays = {"x": assembly.at_junction(x), "lam": reference.lam}
    arrays |= {"gap_before": g, "gap_after": g - assembly.A.T @ x}
    if assembly.contact_nodes is not None:
        arrays["contact_nodes"] = assembly.contact_nodes
    if isinstance(scene, JointScene):
        arrays["fasteners"] = scene.marks()
    name = scene.name.replace("/", "_")
    records.replace_arrays(directory / "scenes" / f"{name}.npz", arrays)


def record_refusal(scene: Scene, directory: Path) -> None:
    """Put into DIRECTORY/problems.jsonl the message that refuses a rung; "" if the rung is accepted."""
    try:
        _ = prepared(scene).Q
        message = ""
    except InputError as error:
        message = str(error)
    n, m = scene.expected_size or (None, None)
    _put({"scene": scene.name, "title": scene.title, "n": n, "m": m, "refused": message}, directory)


def _put(row: dict[str, Any], directory: Path) -> None:
    """Let a row take the place of that of its scene and machine, of one that names no machine, as in older
    versions, and of those of another problem of that name.
    """

    def stands(other: dict[str, Any]) -> bool:
        if other["scene"] != row["scene"]:
            return True
        of_others = other.get("machine") not in (row.get("machine"), None)
        return of_others and other.get("scene_key") == row.get("scene_key")

    others = [other for other in records.read(directory / PROBLEMS) if stands(other)]
    records.rewrite(directory / PROBLEMS, [*others, row])
