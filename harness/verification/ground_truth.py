"""What an answer is judged on: a scene's data and its reference; and what the report needs of them."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.results import records
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.stages import Progress
from problems.load_cases.random_gaps import random_gaps
from problems.model.scene import JointScene, Scene
from problems.scene import read_scene

from .judge import Judgement, conditioned_limit, judge
from .reference import Reference, reference, reference_of


@dataclass(frozen=True)
class Ground:
    """A scene that is ready to be measured and judged on. reference_s : what its reference took."""

    scene: Scene
    prepared: Prepared
    load: LoadCase
    reference: Reference
    reference_s: float

    def limit_mm(self, asked: float) -> float:
        """The limit on an answer: as asked for; on a rung of a ladder, no less than conditioning allows."""
        if not self.scene.on_ladder:
            return asked
        cond_K: Any = self.prepared.facts["cond_K"]
        largest = float(np.max(np.abs(self.reference.x) * self.reference.unit_mm))
        return conditioned_limit(asked, cond_K, largest)

    def of_case(self, series: dict[str, Any] | None, case: int | None) -> Ground:
        """That of a load case of a series on the scene, with a reference of its own."""
        if series is None or case is None:
            return self
        load = random_gaps(self.scene, **series).load(case)
        return replace(self, load=load, reference=reference(self.prepared, load))

    def judge_file(self, path: Path, limit_mm: float) -> Judgement:
        """Judge a saved answer; one that cannot be read is none."""
        try:
            with np.load(path) as saved:
                x, lam = saved["x"], saved["lam"]
        except Exception:  # numpy, zipfile and zlib raise kinds of their own
            return Judgement("no_answer", self.reference.bound_mm)
        return judge(self.prepared, self.load, self.reference, x, lam, limit_mm)


def ground(source: str, progress: Progress = lambda text, fraction: None) -> Ground:
    """Open or build a scene, by name or path, and its reference. Raises InputError."""
    scene = read_scene(source)
    data = prepared(scene, progress)
    if data.assembly.m == 0:
        allowed = "at least one, else there is no quadratic program to measure: `solve` answers the scene"
        raise InputError.one(source, "contacts", 0, allowed)
    load = load_case(scene)
    progress("reference", 0.0)
    start = time.perf_counter()
    known = reference_of(scene, data, load)
    return Ground(scene, data, load, known, time.perf_counter() - start)


def record(ground: Ground, directory: Path) -> None:
    """Put the scene into DIRECTORY/problems.jsonl and its contacts into DIRECTORY/scenes/NAME.npz."""
    scene, facts, known = ground.scene, ground.prepared.facts, ground.reference
    row = {
        "scene": scene.name,
        "title": scene.title,
        "scene_key": scene.key,
        "n": ground.prepared.assembly.n,
        "m": ground.prepared.assembly.m,
        "active": int(known.active.sum()),
        **{name: facts.get(name) for name in ("cond_K", "lambda_min", "lambda_max")},
        "build_s": facts.get("seconds"),
        "reference_s": ground.reference_s,
        "reference_bound_mm": known.bound_mm,
        "reference_route": known.route,
    }
    _put(row, directory)
    arrays = {
        "gap_before": ground.load.g,
        "gap_after": ground.load.g - ground.prepared.assembly.A.T @ known.x,
        "lam": known.lam,
    }
    nodes = ground.prepared.assembly.contact_nodes
    if nodes is not None:
        arrays["contact_nodes"] = nodes
    if isinstance(scene, JointScene):
        arrays["fasteners"] = scene.marks()
    np.savez(directory / "scenes" / (scene.name.replace("/", "_") + ".npz"), **arrays)


def record_refusal(scene: Scene, directory: Path) -> None:
    """Put into DIRECTORY/problems.jsonl by which words the model refuses a rung, "" where it does not."""
    try:
        _ = prepared(scene).Q
        words = ""
    except InputError as error:
        words = str(error)
    n, m = scene.expected_size or (None, None)
    _put({"scene": scene.name, "title": scene.title, "n": n, "m": m, "refused": words}, directory)


def _put(row: dict[str, Any], directory: Path) -> None:
    path = directory / "problems.jsonl"
    others = [other for other in records.read_whole(path) if other["scene"] != row["scene"]]
    records.rewrite(path, [*others, row])
