"""From a scene to a judged answer with a proven bound, step by step: what `solve` does, as a command and from
Python.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.planning.form_choice import Choice, chosen_form
from harness.solving.session import answer_of, form_of
from harness.verification.judge import LIMIT_MM, Judgement
from harness.verification.reference_problem import ReferenceProblem, opened
from problems.errors import InputError
from problems.forms import FORMS, Form
from problems.forms.assembly import Vector
from problems.model.scene import Scene
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene, scene_of
from solvers.base import Answer, Solver

LINEAR = "linear solve with the Cholesky factors of K"
Source = Scene | str | Path | Mapping[str, Any]


@dataclass(frozen=True)
class Solution:
    """An answer to a scene.

    lam : (m,) contact forces, N; NaN if the solver gives none. gap : (m,) the remaining gaps, g − Aᵀx, mm.
    status, iterations : reported by the solver; the reference has no iterations.
    judgement : the judge's figures. error_bound_mm : proven, max|x − x*| for the exact answer x*.
    notes : sentences on numbers of the user that reading has rounded or symmetrised.
    method : the name of the solver, or how the reference was proven. from_reference : whether the answer is
    the reference. unknowns : (N,) mm, all of the form. closest_mm : the smallest gap if contact is ignored;
    None without contacts. seconds : of each step. choice : of the form.
    """

    lam: Vector
    gap: Vector
    status: str
    iterations: int | None
    judgement: Judgement
    error_bound_mm: float
    notes: tuple[str, ...]
    method: str
    from_reference: bool
    unknowns: Vector
    closest_mm: float | None
    seconds: dict[str, float]
    choice: Choice
    problem: ReferenceProblem

    @property
    def x(self) -> Vector:
        """(n,) displacements, mm."""
        return self.problem.prepared.assembly.at_junction(self.unknowns)

    @property
    def has_contact(self) -> bool:
        """Whether the answer without contact violates a gap, so that there is a quadratic program."""
        return self.closest_mm is not None and self.closest_mm < 0


def load_scene(source: Source) -> Scene:
    """A checked scene by name, path or content; nothing is computed.

    In a dict, `joint` and the entries of `effect` may be tables or objects (problems.model.joint.Joint,
    problems.effects); paths are relative to the working directory.
    """
    if isinstance(source, Scene):
        return source
    return scene_of(source) if isinstance(source, Mapping) else read_scene(str(source))


def solve(
    scene: Source,
    solver: str | Solver | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    form: Form | None = None,
    tolerance: float = 1e-9,
    limit_s: float | None = None,
    reporter: Reporter = SILENT,
) -> Solution:
    """Solve a scene, and judge the answer.

    solver : a name (`python -m harness list solvers`) or an object of your own; by default the proven
        reference, as also where the answer without contact violates no gap and so no solver is called for.
    form : "primal", "dual" or "sparse"; by default the cheaper one that the solver takes.
    tolerance : passed to the solver, with its options. limit_s : after it no further candidate for the
        reference is tried. reporter : is told the steps, and what to know before the answer is there.

    Raises InputError.
    """
    scene, seconds = load_scene(scene), {}

    @contextmanager
    def step(name: str) -> Iterator[None]:
        start = time.perf_counter()
        with reporter.step(name):
            yield
        seconds[name] = time.perf_counter() - start

    named = None if solver is None else solver_named(solver, options)
    with step("choosing the form"):
        forms = FORMS if named is None else named[1].forms
        asked = form_of(named[0], forms, form) if form and named else form
        choice = chosen_form(scene, forms, asked)
    if choice.why:
        reporter.say(f"In the sparse form, without condensation: {choice.why}")
    with step("matrices, loads and gaps"):
        problem = opened(scene, choice.form, reporter, limit_s)
        problem.prepared.assembly.K.ensure_factored()
        p = problem.prepared.overlap(problem.load)
    if np.isnan(p).any():
        largest = float(abs(problem.load.f).max(initial=0.0))
        raise InputError.one(scene.source_of("f"), "largest |f|", largest, "loads with finite displacements")
    for note in problem.prepared.assembly.notes:
        reporter.say(note)
    with step("answer with a proven bound"):
        reference = problem.reference
    closest = float(-p.max()) if p.size else None
    has_contact = closest is not None and closest < 0
    if named is None or not has_contact:
        named, method = None, reference.route if has_contact else LINEAR
        answer = Answer("solved", reference.lam, reference.x)
    else:
        name, chosen = named
        method = f"{name}, {choice.form} form, tolerance {tolerance:g}"
        with step(f"solving with {name}"):
            answer = answer_of(name, chosen, problem.prepared, choice.form, problem.load, tolerance)
    assembly, x = problem.prepared.assembly, np.asarray(answer.x, dtype=float)
    lam = np.full(assembly.m, np.nan) if answer.lam is None else np.asarray(answer.lam, dtype=float)
    judgement = problem.judged(x, lam, LIMIT_MM)
    error = judgement.displacement_error_mm
    if named is None:  # the error of the reference is its bound
        proven, error = reference.bound_mm <= LIMIT_MM, 0.0
        judgement = replace(judgement, verdict="within" if proven else "cannot_be_judged")
    return Solution(
        lam=lam,
        gap=problem.load.g - assembly.A.T @ x,
        status=answer.status,
        iterations=answer.iterations,
        judgement=judgement,
        error_bound_mm=np.inf if error is None else error + reference.bound_mm,
        notes=assembly.notes,
        method=method,
        from_reference=named is None,
        unknowns=x,
        closest_mm=closest,
        seconds=seconds,
        choice=choice,
        problem=problem,
    )


def solver_named(solver: str | Solver, options: Mapping[str, Any] | None) -> tuple[str, Solver]:
    """The solver and its name."""
    if isinstance(solver, str):
        from solvers.registry import make_solver  # slow to import: not without a solver

        return solver, make_solver(solver, dict(options or {}))
    if options:
        raise InputError.one("solver", "options", dict(options), "an object has its options already")
    return type(solver).__name__, solver
