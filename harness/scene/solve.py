"""One scene from its file to an answer on disk; the report draws it from there.

DIR/solution.npz holds the arrays, DIR/solution.json what was done: the steps and their time, the ledger of
the effects, what was skipped, and the error bound of the answer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from harness.planning.estimate import refuse_what_cannot_fit
from harness.results.machine import resident_mib
from harness.results.records import replace_text, to_line
from harness.terminal.exit_codes import DONE, FAILED
from harness.verification.judge import LIMIT_MM, judge
from harness.verification.reference import UNPROVEN, Reference, reference_of
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.alteration import ALTERED
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.model.effect import TieEffect
from problems.model.part_load import PartLoadEffect
from problems.model.scene import JointScene, MatricesScene, Scene
from problems.scene import read_scene
from solvers.base import Solver

from .answer import answer_of, form_of
from .few_digits import digits_sentence
from .layout import layout
from .ledger import Entry, ledger, not_called_for

ACTIVE_SET = "active set (block principal pivoting), refined"
LINEAR = "linear solve with the Cholesky factors of K"


class Steps:
    """The seconds of each step, and the matrices that were built because the cache did not hold them."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.seconds: dict[str, float] = {}
        self.built: list[str] = []

    @property
    def condensed(self) -> bool:
        """Whether a part's stiffness was computed, not loaded."""
        return any(text.startswith("condensing") for text in self.built)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        with self.console.status(Text(name)):
            yield
        self.seconds[name] = time.perf_counter() - start

    def building(self, text: str, fraction: float) -> None:
        if text not in self.built:
            self.built.append(text)


def solve(
    source: str,
    solver: str | None,
    tolerance: float,
    out: Path,
    console: Console,
    reference_limit_s: float | None = None,
) -> int:
    """Solve a scene, write DIR, show the outcome. Returns 0 if the answer is within 1e-7 mm, else 1.

    Raises InputError.
    """
    started = time.perf_counter()
    steps = Steps(console)
    with steps.step("reading the scene"):
        if not 0 < tolerance < inf:
            raise InputError.one("--tolerance", "tolerance", tolerance, "must be positive and finite")
        scene = read_scene(source)
        refuse_what_cannot_fit(scene, source)
    chosen = _solver(solver) if solver else None
    with steps.step("matrices"):
        data = prepared(scene, steps.building)
        _ = data.factors
    if data.assembly.altered:
        console.print(f"{ALTERED}.", style="yellow")
    with steps.step("the effects, each alone"):
        entries = ledger(scene, steps.condensed)
    with steps.step("loads and gaps"):
        load = load_case(scene)
        p = data.dual_load(load)
    has_contact = bool((p > 0).any())
    with steps.step("answer with a proven bound"):
        known = reference_of(scene, data, load, reference_limit_s)
    if solver and chosen and has_contact:
        with steps.step(f"solving with {solver}"):
            x, lam, outcome = _answer(solver, chosen, data, load, tolerance)
        verdict = judge(data, load, known, x, lam, LIMIT_MM)
        outcome |= {"verdict": verdict.verdict, "judged_error_mm": verdict.displacement_error_mm}
    else:
        x, lam = known.x, known.lam
        outcome = {
            "method": ACTIVE_SET if has_contact else LINEAR,
            "status": "solved",
            "verdict": "within" if known.bound_mm <= LIMIT_MM else "cannot_be_judged",
            "judged_error_mm": None,
        }
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError.one("--out", "directory", str(out), f"cannot be written: {error}") from error
    record = outcome | {
        "scene": scene.name,
        "title": scene.title,
        "scene_key": scene.key,
        "n": data.assembly.n,
        "m": data.assembly.m,
        "cond_K": data.facts.get("cond_K"),
        "qp": has_contact,
        "closest_mm": float(-p.max()) if p.size else None,
        "error_bound_mm": known.bound_mm,
        "route": known.route,
        **layout(scene, data.assembly),
        "ledger": [vars(entry) for entry in entries],
        "digits": digits_sentence(data, known.x, known.lam)[0] if isinstance(scene, MatricesScene) else None,
        "skipped": list(_skipped(scene, steps, has_contact, solver, p)),
        "steps": steps.seconds,
        "peak_rss_mib": resident_mib("VmHWM"),
    }
    _save(out, record, data, load, x, lam)
    with steps.step("pictures and files"):
        from report.writers.solution import write  # slow to import: not before the answer is saved

        written = write(out)
    _show(record, entries, known, console)
    console.print(f"{time.perf_counter() - started:.1f} s in all. Answer: {written}")
    return DONE if record["verdict"] == "within" else FAILED


def _solver(name: str) -> Solver:
    from solvers.registry import make_solver  # slow to import: not without a solver

    return make_solver(name, {})


def _answer(
    name: str, solver: Solver, data: Prepared, load: LoadCase, tolerance: float
) -> tuple[Vector, Vector, dict[str, Any]]:
    """x (n,), λ (m,) or NaN if there is none, and the solver's report. Raises InputError without an x."""
    form = form_of(name, solver.forms)
    answer = answer_of(name, solver, data, form, load, tolerance)
    lam = np.full(data.assembly.m, np.nan) if answer.lam is None else np.asarray(answer.lam, dtype=float)
    outcome = {
        "method": f"{name}, {form} form, tolerance {tolerance:g}",
        "status": answer.status,
    }
    return np.asarray(answer.x, dtype=float), lam, outcome | {"iterations": answer.iterations}


def _skipped(scene: Scene, steps: Steps, has_contact: bool, solver: str | None, p: Vector) -> Iterator[str]:
    if not has_contact:
        instead = f"; {solver} was not run" if solver else ""
        why = "The scene has no contact"
        if p.size:
            closest = f"the closest contact stays {-p.max():.3g} mm open"
            why = f"The answer without contact violates no gap, {closest}"
        yield f"the quadratic program: it was not called for. {why}{instead}"
    if not steps.built:
        yield "condensation, Cholesky factors and Q: the assembly came from the cache"
    elif isinstance(scene, JointScene) and not steps.condensed:
        yield "condensation: the parts came from the cache"
    if isinstance(scene, JointScene):
        if not any(scene.effects_of(TieEffect)):
            yield "springs between parts: K stays block diagonal"
        if not any(scene.effects_of(PartLoadEffect)):
            yield "condensing loads: none acts beyond the junction"
        if others := not_called_for(scene):
            yield f"effects that the scene does not name, not imported: {', '.join(others)}"


def _save(out: Path, record: dict[str, Any], data: Prepared, load: LoadCase, x: Vector, lam: Vector) -> None:
    A = data.assembly.A
    arrays = {
        "x": x,
        "lam": lam,
        "gap_before": load.g,
        "gap_after": load.g - A.T @ x,
        "A_data": A.data,
        "A_indices": A.indices,
        "A_indptr": A.indptr,
    }
    if data.assembly.nodes is not None:
        arrays |= {"nodes": data.assembly.nodes, "contact_nodes": data.assembly.contact_nodes}
    np.savez(out / "solution.npz", **arrays)
    replace_text(out / "solution.json", to_line(record) + "\n")


def _show(record: dict[str, Any], entries: list[Entry], known: Reference, console: Console) -> None:
    table = Table("effect", "adds", "what", "s", "MiB", title="What each effect added")
    for entry in entries:
        cost = ("–", "–") if entry.seconds is None else (f"{entry.seconds:.3f}", f"{entry.mib:.1f}")
        table.add_row(entry.effect, entry.adds, entry.amount, *cost)
    if entries:
        console.print(table)
    if record["digits"]:
        console.print(f"{record['digits']}.")
    for line in record["skipped"]:
        console.print(f"Skipped: {line}.", style="dim")
    error = record["judged_error_mm"]
    style = "green" if record["verdict"] == "within" else "red"
    proven = np.isfinite(known.bound_mm)
    if error is None:
        bound = (
            f"every displacement within {known.bound_mm:.1e} mm, proven" if proven else f"a bound {UNPROVEN}"
        )
        console.print(f"{record['method']}: {bound}.", style=style)
    else:
        bound = f"with a proven bound ({known.bound_mm:.1e} mm)" if proven else f"whose bound {UNPROVEN}"
        text = f"{record['method']}: {record['status']}, {error:.1e} mm from the answer {bound}"
        console.print(f"{text}: {record['verdict']} {LIMIT_MM:g} mm.", style=style)
