"""One scene from its file to an answer on disk; the report draws it from there.

DIR/solution.npz holds the arrays, DIR/solution.json what was done: the steps and their time, the ledger of
the effects, what was skipped, and the error bound of the answer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import threadpoolctl
from rich.console import Console
from rich.text import Text

from harness.planning.road import Choice, chosen_form
from harness.results.machine import machine, resident_mib
from harness.results.provenance import provenance
from harness.solving.answer import answer_of
from harness.terminal.exit_codes import DONE, FAILED
from harness.verification.gap_error import GapError
from harness.verification.judge import LIMIT_MM, judge
from harness.verification.reference import reference_of
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import LoadCase, Vector
from problems.forms.names import FORMS, Form
from problems.forms.prepared import Prepared
from problems.model.effect import TieEffect
from problems.model.part_load import PartLoadEffect
from problems.model.scene import JointScene, MatricesScene, Scene
from problems.scene import read_scene
from solvers.base import Solver

from . import allowed_gap
from .fastener_forces import fastener_forces
from .few_digits import digits_sentence
from .layout import layout
from .ledger import ledger, not_called_for
from .outcome import save, show

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
    form: Form | None = None,
    allow_gap_mm: float | None = None,
) -> int:
    """Solve a scene, write DIR, show the outcome. Returns 0 if the answer is within 1e-7 mm, else 1.

    form : by default the cheaper one, see `harness.planning.road`. allow_gap_mm : returns 4 if a remaining
    gap is larger, 3 if that cannot be told. Raises InputError.
    """
    started = time.perf_counter()
    steps = Steps(console)
    with steps.step("reading the scene"):
        if not 0 < tolerance < inf:
            raise InputError.one("--tolerance", "tolerance", tolerance, "must be positive and finite")
        allowed_gap.refuse_unusable(allow_gap_mm)
        scene = read_scene(source)
    chosen = _solver(solver) if solver else None
    with steps.step("choosing the form"):
        taken = chosen.forms if chosen else FORMS
        road = chosen_form(scene, taken, form, in_house=solver is None or _in_house(solver))
    if road.why:
        console.print(f"In the sparse form, without condensation: {road.why}.", style="dim")
    if road.form == "sparse":
        threadpoolctl.threadpool_limits(1)  # a second thread gains nothing on narrow bands, and spins
    with steps.step("matrices"):
        data = prepared(scene, steps.building, road.form)
        _ = data.assembly.K.factors
    for note in data.assembly.notes:
        console.print(f"{note}.", style="yellow")
    with steps.step("the effects, each alone"):
        built = steps.condensed or road.form == "sparse"
        entries = ledger(scene, built, data.assembly.junction)
    with steps.step("loads and gaps"):
        load = load_case(scene, road.form)
        p = data.dual_load(load)
        if np.isnan(p).any():
            largest, allowed = float(abs(load.f).max(initial=0.0)), "loads with finite displacements"
            raise InputError.one(scene.source_of("f"), "largest |f|", largest, allowed)
    has_contact = bool((p > 0).any())
    with steps.step("answer with a proven bound"):
        known = reference_of(scene, data, load, reference_limit_s)
    if solver and chosen and has_contact:
        with steps.step(f"solving with {solver}"):
            x, lam, outcome = _answer(solver, chosen, data, road.form, load, tolerance)
        verdict = judge(data, load, known, x, lam, LIMIT_MM)
        outcome |= {"verdict": verdict.verdict, "judged_error_mm": verdict.displacement_error_mm}
    else:
        x, lam = known.x, known.lam
        outcome = {
            "method": known.route if has_contact else LINEAR,
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
        "form": road.form,
        "n": data.assembly.asked,
        "unknowns": data.assembly.n,
        "m": data.assembly.m,
        "cond_K": data.facts.get("cond_K"),
        "qp": has_contact,
        "closest_mm": float(-p.max()) if p.size else None,
        "error_bound_mm": known.bound_mm,
        "route": known.route,
        **layout(scene, data.assembly),
        "fasteners": fastener_forces(scene, data.assembly.at_junction(x)),
        "ledger": [vars(entry) for entry in entries],
        "digits": digits_sentence(data, known.x, known.lam)[0] if isinstance(scene, MatricesScene) else None,
        "skipped": list(_skipped(scene, steps, road, has_contact, solver, p)),
        "steps": steps.seconds,
        "peak_rss_mib": resident_mib("VmHWM"),
        "machine": machine()["machine"],
        **provenance(),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    gap = load.g - data.assembly.A.T @ x
    if allow_gap_mm is not None:
        error_mm = known.bound_mm + (record["judged_error_mm"] or 0.0)
        uncertainty = GapError.of(data.assembly)(load.g, x, error_mm)
        record["allowed_gap"] = allowed_gap.checked(allow_gap_mm, gap, uncertainty, record["pairs"])
    save(out, record, data.assembly, load, x, lam)
    with steps.step("pictures and files"):
        from report.writers.solution import write  # slow to import: not before the answer is saved

        written = write(out)
    show(record, entries, known, console)
    console.print(f"{time.perf_counter() - started:.1f} s in all. Answer: {written}")
    code = DONE if record["verdict"] == "within" else FAILED
    if allow_gap_mm is not None:
        code = code or allowed_gap.show(record["allowed_gap"], gap, data.assembly.contact_nodes, console)
    return code


def _solver(name: str) -> Solver:
    from solvers.registry import make_solver  # slow to import: not without a solver

    return make_solver(name, {})


def _in_house(name: str) -> bool:
    from solvers.registry import in_house

    return in_house(name)


def _answer(
    name: str, solver: Solver, data: Prepared, form: Form, load: LoadCase, tolerance: float
) -> tuple[Vector, Vector, dict[str, Any]]:
    """x (n,), λ (m,) or NaN if there is none, and the solver's report. Raises InputError without an x."""
    answer = answer_of(name, solver, data, form, load, tolerance)
    lam = np.full(data.assembly.m, np.nan) if answer.lam is None else np.asarray(answer.lam, dtype=float)
    outcome = {
        "method": f"{name}, {form} form, tolerance {tolerance:g}",
        "status": answer.status,
    }
    return np.asarray(answer.x, dtype=float), lam, outcome | {"iterations": answer.iterations}


def _skipped(
    scene: Scene, steps: Steps, road: Choice, has_contact: bool, solver: str | None, p: Vector
) -> Iterator[str]:
    if not has_contact:
        instead = f"; {solver} was not run" if solver else ""
        why = "The scene has no contact"
        if p.size:
            closest = f"the closest contact stays {-p.max():.3g} mm open"
            why = f"The answer without contact violates no gap, {closest}"
        yield f"the quadratic program: it was not called for. {why}{instead}"
    if road.form == "sparse":
        yield "condensation, dense factors and Q: the sparse model was solved as it is"
    elif not steps.built:
        yield "condensation, Cholesky factors and Q: the assembly came from the cache"
    elif isinstance(scene, JointScene) and not steps.condensed:
        yield "condensation: the parts came from the cache"
    if isinstance(scene, JointScene):
        if not any(scene.effects_of(TieEffect)):
            yield "springs between parts: K stays block diagonal"
        if not any(scene.effects_of(PartLoadEffect)) and road.form != "sparse":
            yield "condensing loads: none acts beyond the junction"
        if others := not_called_for(scene):
            yield f"effects that the scene does not name, not imported: {', '.join(others)}"
