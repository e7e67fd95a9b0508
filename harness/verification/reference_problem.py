"""A scene with its matrices and its reference: what answers are judged on, and what is recorded of it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.results import records
from harness.results.checksums import arrays_in
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.stages import Progress
from problems.input.bounded import regular_file
from problems.load_cases.random_gaps import random_gaps
from problems.model.scene import JointScene, Scene
from problems.scene import read_scene

from .judge import Judgement, conditioned_limit, judge
from .reference import Reference, default_limit_s, reference, reference_of

ANSWER_MIB = 1024  # the largest file of an answer that is read


@dataclass(frozen=True)
class ReferenceProblem:
    """A scene whose answers can be measured and judged. reference_s, limit_s : seconds that its
    reference took, and may take.
    """

    scene: Scene
    prepared: Prepared
    load: LoadCase
    reference: Reference
    reference_s: float
    limit_s: float | None = None

    def limit_mm(self, asked: float) -> float:
        """The limit on an answer: as asked for; on a rung of a ladder, no less than conditioning allows."""
        if not self.scene.on_ladder:
            return asked
        cond_K: Any = self.prepared.facts["cond_K"]
        largest = float(np.max(np.abs(self.reference.x) * self.reference.unit_mm))
        return conditioned_limit(asked, cond_K, largest)

    def of_case(self, series: dict[str, Any] | None, case: int | None) -> ReferenceProblem:
        """The same for a load case of a series, with its own reference."""
        if series is None or case is None:
            return self
        load = random_gaps(self.scene, **series).load(case)
        return replace(self, load=load, reference=reference(self.prepared, load, self.limit_s))

    def judge_file(self, path: Path, limit_mm: float) -> Judgement:
        """Judge a saved answer; one that cannot be read is none."""
        try:
            saved = arrays_in(regular_file(path, "answer", ANSWER_MIB).read_bytes())
            x, lam = saved["x"], saved["lam"]
        except (OSError, ValueError, KeyError):
            return Judgement("no_answer", self.reference.bound_mm)
        if not x.dtype.kind == lam.dtype.kind == "f":
            return Judgement("no_answer", self.reference.bound_mm)
        return judge(self.prepared, self.load, self.reference, x, lam, limit_mm)


def reference_problem(
    source: str, progress: Progress = lambda text, fraction: None, limit_s: float | None = None
) -> ReferenceProblem:
    """Open or build a scene, by name or path, and its reference, within limit_s. Raises InputError."""
    scene = read_scene(source)
    data = prepared(scene, progress)
    if data.assembly.m == 0:
        allowed = "at least one, else there is no quadratic program to measure: `solve` answers the scene"
        raise InputError.one(source, "contacts", 0, allowed)
    load = load_case(scene)
    limit_s = default_limit_s(data.assembly.m) if limit_s is None else limit_s
    progress(f"reference, at most {limit_s:g} s", 0.0)
    start = time.perf_counter()
    known = reference_of(scene, data, load, limit_s)
    return ReferenceProblem(scene, data, load, known, time.perf_counter() - start, limit_s)


def record(problem: ReferenceProblem, directory: Path) -> None:
    """Put the scene into DIRECTORY/problems.jsonl and its contacts into DIRECTORY/scenes/NAME.npz."""
    scene, facts, known = problem.scene, problem.prepared.facts, problem.reference
    assembly = problem.prepared.assembly
    row = {
        "scene": scene.name,
        "title": scene.title,
        "scene_key": scene.key,
        "n": assembly.n,
        "m": assembly.m,
        "active": int(known.active.sum()),
        **{name: facts.get(name) for name in ("cond_K", "lambda_min", "lambda_max")},
        "build_s": facts.get("seconds"),
        "reference_s": problem.reference_s,
        "reference_bound_mm": known.bound_mm,
        "reference_route": known.route,
    }
    _put(row, directory)
    arrays = {
        "gap_before": problem.load.g,
        "gap_after": problem.load.g - assembly.A.T @ known.x,
        "lam": known.lam,
    }
    if assembly.contact_nodes is not None:
        arrays["contact_nodes"] = assembly.contact_nodes
    if isinstance(scene, JointScene):
        arrays["fasteners"] = scene.marks()
    records.replace_arrays(directory / "scenes" / (scene.name.replace("/", "_") + ".npz"), arrays)


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
    path = directory / "problems.jsonl"
    others = [other for other in records.read_complete_rows(path) if other["scene"] != row["scene"]]
    records.rewrite(path, [*others, row])
