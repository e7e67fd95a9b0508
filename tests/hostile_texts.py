"""Results and answers in which every title, name and message was written by a hostile user."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from synthetic_results import no_answer, row, write_rows
from synthetic_series import made as series_of

from report.writers.answer_report import write as write_solution
from report.writers.series_report import write as write_series
from report.writers.suite_report import write

HOSTILE = "<b>x</b>|![i](http://e)`c`$a_b$ *e*\n# h\x1b[31m\u202e\ud800"


def results(folder: Path, name: str) -> Path:
    """A results directory in which every text is the same."""
    scenes = [f"4386/{active:04d}" for active in (100, 1000)]
    texts = {"variant": name, "solver_version": name, "machine": name, "message": name, "commit": name}
    rows = [row(scene, solver, **texts) for scene in scenes for solver in (name, "ipm")]
    rows += [row(scene, "gi", **texts | no_answer("crashed")) for scene in scenes]
    odd = row(scenes[0]) | {"scene": name, "solver": name}
    write_rows(folder, [*rows, odd])
    problems = [
        {"scene": scene, "title": name, "n": 4386, "m": 2193, "active": 9} for scene in (*scenes, name)
    ]
    (folder / "problems.jsonl").write_text("".join(json.dumps(p) + "\n" for p in problems))
    suite = {"name": name, "title": name, "description": name}
    lines = [f"{key} = {json.dumps(value, ensure_ascii=True)}\n" for key, value in suite.items()]
    (folder / "suite.toml").write_text("".join(lines).replace(r"\ud800", "x"))
    (folder / "machine.json").write_text(json.dumps({"machine": name, "blas": [name]}))
    return folder


def solution(folder: Path, name: str) -> Path:
    """The files of `solve`, with one text for everything that has a name."""
    bare = {"name": name, "outline": [0, 20, 0, 10], "clamped": [], "supports": []}
    parts = [bare | {"start": start, "stop": start + 6} for start in (0, 6)]
    record = {
        "title": name, "method": name, "status": name, "verdict": "within", "n": 12, "m": 6, "qp": True,
        "closest_mm": 0.1, "judged_error_mm": 1e-9, "error_bound_mm": 1e-9, "parts": parts,
        "pairs": [{"pair": [name, name], "start": 0, "stop": 6}], "marks": {name: [[1.0, 2.0]]},
        "digits": None, "skipped": [name], "steps": {name: 1.0}, "peak_rss_mib": 100.0,
        "grid": {"said": name}, "scene": name, "scene_key": name,
    }  # fmt: skip
    (folder / "solution.json").write_text(json.dumps(record))
    nodes = np.array([(x, y) for y in (0.0, 10.0) for x in (0.0, 10.0, 20.0)])
    np.savez(
        folder / "solution.npz", x=np.arange(12.0), lam=np.eye(6)[0], gap_before=np.ones(6),
        gap_after=np.zeros(6), A_data=np.ones(6), A_indices=np.arange(6), A_indptr=np.arange(7),
        nodes=np.vstack([nodes, nodes]), contact_nodes=nodes,
    )  # fmt: skip
    return folder


def series(folder: Path, name: str) -> Path:
    """A series with one text for every name."""
    series_of(folder, name=name)
    return folder


MADE: list[Any] = [(results, write), (solution, write_solution), (series, write_series)]
