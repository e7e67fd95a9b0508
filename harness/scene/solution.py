"""Solves a scene step by step: a judged answer with a proven bound, for the command and for Python."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from harness.planning.form_choice import Choice, chosen_form
from harness.solving.solver_session import answer_of, form_of
from harness.verification.assess import GapError, error_bound
from harness.verification.judge import LIMIT_MM, Judgement
from harness.verification.reference_problem import ReferenceProblem, open_problem
from problems.errors import Fault, InputError
from problems.forms import FORMS, Form
from problems.forms.assembly import Matrix, Vector
from problems.model.scene import JointScene, ManufacturedScene, Scene
from problems.model.stage_answers import Elongations, locked, through
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene, scene_of
from solvers.base import Answer, Solver

from .stages import StageAnswer

LINEAR = "linear solve with the Cholesky factors of K"
Source = Scene | str | Path | Mapping[str, Any]


@dataclass(frozen=True)
class Solution:
    """An answer to a scene, judged.

    Parameters
    ----------
    lam : array (m,), N
        Contact forces; NaN if the solver gives none.
    gap : array (m,), mm
        Remaining gaps, g − Aᵀx.
    status : str
        Reported by the solver.
    iterations : int, optional
        Reported by the solver; None for the reference.
    judgement : Judgement
        The judge's figures.
    error_bound_mm : float
        Proven bound on max|x − x*|, mm, for the exact answer x*; in stages, at the locked approaches.
    notes : tuple of str
        Sentences on numbers of the user that reading has rounded or symmetrised.
    method : str
        The name of the solver, or how the reference was proven.
    from_reference : bool
        Whether the answer is the reference.
    unknowns : array (N,), mm
        All unknowns of the form.
    closest_mm : float, optional
        The smallest gap if contact is ignored, mm; None without contacts.
    seconds : dict of str to float
        Seconds of each step.
    choice : Choice
        The form, and why it was chosen.
    problem : ReferenceProblem
        The matrices, loads and reference.
    scene : Scene
        The scene. That of `problem` is the last stage if it has some.
    stages : tuple of StageAnswer
        What each stage of the scene has reached; the other entries are those of the last one. Empty without
        stages.
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
    scene: Scene
    stages: tuple[StageAnswer, ...] = ()

    @property
    def x(self) -> Vector:
        """Displacements (n,), mm; a copy."""
        return np.array(self.problem.prepared.assembly.at_junction(self.unknowns))

    @property
    def gap_error_mm(self) -> Vector:
        """(m,) how far each gap is from the exact one at most, in its unit; with stages, in the last one."""
        if self.stages:
            return self.stages[-1].gap_error_mm
        problem = self.problem
        bound = self.error_bound_mm / float(np.min(problem.reference.unit_mm))
        return GapError.of(problem.prepared.assembly)(problem.load.g, self.unknowns, bound)

    @property
    def has_contact(self) -> bool:
        """Whether the answer without contact violates a gap, so that there is a quadratic program."""
        return self.closest_mm is not None and self.closest_mm < 0


def load_scene(source: Source) -> Scene:
    """Read and check a scene; nothing is computed.

    Parameters
    ----------
    source : str, Path, dict or Scene
        The name of a scene, the path of its file, or the content of its file. In a dict, `joint` and the
        entries of `effect` may be tables or objects (problems.model.joint.Joint, problems.effects); paths are
        relative to the working directory. Lengths are in mm, forces in N.

    Returns
    -------
    Scene
        For all functions that take a scene.

    Raises
    ------
    InputError
        With all faults of the scene.

    Examples
    --------
    >>> from rivetbench import load_scene
    >>> load_scene("gallery/three-part-stack").expected_size
    (1107, 738)
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

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or the content of its file.
    solver : str or Solver, optional
        A solver by name or an object of your own; by default the proven reference. No solver is called if
        the answer without contact violates no gap.
    options : dict, optional
        Options of a solver by name.
    form : str, optional
        "primal", "dual" or "sparse"; by default the cheaper one that the solver takes.
    tolerance : float, optional
        Passed to the solver.
    limit_s : float, optional
        After this time, s, no further candidate for the reference is tried.
    reporter : Reporter, optional
        Is told the steps, and what to know before the answer is there; silent by default.

    Returns
    -------
    Solution
        Displacements x in mm, contact forces lam in N, gaps in mm, and a proven bound on the error.

    Raises
    ------
    InputError
        If the scene or the tolerance is wrong, or the solver gives no valid answer.

    Notes
    -----
    The problem is min ½xᵀKx − fᵀx subject to Aᵀx ≤ g. Its answer is x* = K⁻¹(f − Aλ*), λ* ≥ 0.

    Examples
    --------
    >>> from rivetbench import solve
    >>> answer = solve("gallery/three-part-stack")
    >>> print(f"{answer.gap.max():.3f} mm, {answer.judgement.verdict}")
    0.668 mm, within
    """
    refuse_not_positive("solve", tolerance=tolerance)
    scene, clock = load_scene(scene), _Clock(reporter)
    named = None if solver is None else solver_named(solver, options)
    with clock.step("choosing the form"):
        forms = FORMS if named is None else named[1].forms
        asked = form_of(named[0], forms, form) if form and named else form
        choice = chosen_form(scene, forms, asked)
    if choice.why:
        reporter.say(f"In the sparse form, without condensation: {choice.why}")
    how = named, choice, tolerance, limit_s, clock
    if not (isinstance(scene, JointScene) and scene.stages):
        return _solved(scene, *how)

    like: ReferenceProblem | None = None
    locks_mm = 0.0  # the largest bound on an answer in which fasteners lock

    def of_stage(part: JointScene, approaches: Matrix) -> tuple[Elongations, tuple[Solution, float]]:
        nonlocal like
        clock.where = f"{part.title}: "
        answer, before_mm = _solved(locked(part, approaches[:, 0]), *how, like), locks_mm
        like = answer.problem
        reference, at_junction = like.reference, like.prepared.assembly.at_junction

        def elongations(T: sp.csc_array) -> Matrix:
            nonlocal locks_mm
            locks_mm = max(locks_mm, reference.bound_mm)
            return T.T @ at_junction(reference.x)

        return elongations, (answer, before_mm)

    history = []
    for name, part, approaches, (answer, before_mm) in through(scene, of_stage):
        proven, judgement = before_mm <= LIMIT_MM, answer.judgement
        history.append(
            StageAnswer(
                name=name,
                scene=locked(part, approaches[:, 0]),
                x=answer.x,
                lam=answer.lam,
                gap=answer.gap,
                judgement=judgement if proven else replace(judgement, verdict="cannot_be_judged"),
                error_bound_mm=answer.error_bound_mm,
                gap_error_mm=answer.gap_error_mm + (0.0 if proven else inf),
            )
        )
    return replace(answer, scene=scene, judgement=history[-1].judgement, stages=tuple(history))


class _Clock:
    """Takes the time of steps, `seconds`, and tells a reporter of them; `where` begins its sentences."""

    def __init__(self, reporter: Reporter) -> None:
        self.reporter, self.where = reporter, ""
        self.seconds: dict[str, float] = {}

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        with self.reporter.step(f"{self.where}{name}"):
            yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


def _solved(
    scene: Scene,
    named: tuple[str, Solver] | None,
    choice: Choice,
    tolerance: float,
    limit_s: float | None,
    clock: _Clock,
    like: ReferenceProblem | None = None,
) -> Solution:
    """The judged answer to a scene without stages. like : see `open_problem`."""
    reporter, step = clock.reporter, clock.step
    with step("matrices, loads and gaps"):
        problem = open_problem(scene, choice.form, reporter, limit_s, like)
        problem.prepared.assembly.K.ensure_factored()
        free = problem.prepared.assembly.K.solve(problem.load.f)
        p = problem.prepared.assembly.A.T @ free - problem.load.g  # as `Prepared.overlap`
    if not (np.isfinite(free).all() and np.isfinite(p).all()):
        largest = float(abs(problem.load.f).max(initial=0.0))
        raise InputError.one(scene.source_of("f"), "largest |f|", largest, "loads with finite displacements")
    for note in problem.prepared.assembly.notes if like is None else ():
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
    assembly, x = problem.prepared.assembly, np.array(answer.x, dtype=float)  # not those of the reference
    lam = np.full(assembly.m, np.nan) if answer.lam is None else np.array(answer.lam, dtype=float)
    judgement = problem.judged(x, lam, LIMIT_MM)
    error = judgement.displacement_error_mm
    if named is None:  # the error of the reference is its bound
        proven, error = reference.bound_mm <= LIMIT_MM, 0.0
        judgement = replace(judgement, verdict="within" if proven else "cannot_be_judged")
    bound = inf if error is None else reference.bound_mm
    bound = error_bound(error, bound) if error else bound
    return Solution(
        lam=lam,
        gap=problem.load.g - assembly.A.T @ x,
        status=answer.status,
        iterations=answer.iterations,
        judgement=judgement,
        error_bound_mm=bound,
        notes=assembly.notes,
        method=method,
        from_reference=named is None,
        unknowns=x,
        closest_mm=closest,
        seconds=clock.seconds,
        choice=choice,
        problem=problem,
        scene=scene,
    )


def refuse_other_units(where: str, scene: Scene) -> None:
    """Raise InputError if a scene is in other units than mm, as some rungs of ladders are."""
    made = scene.made if isinstance(scene, ManufacturedScene) else None
    if made is not None and not (np.equal(made.unit_mm, 1).all() and np.equal(made.gap_unit_mm, 1).all()):
        raise InputError.one(where, "scene", scene.name, f"one in mm, not: {scene.title}")


def refuse_not_positive(where: str, **numbers: float) -> None:
    """Raise InputError for each number that is not above 0, or not finite."""
    wrong = {name: value for name, value in numbers.items() if not 0 < value < inf}
    if wrong:
        allowed = "must be positive and finite"
        raise InputError([Fault(where, name, value, allowed) for name, value in wrong.items()])


def solver_named(solver: str | Solver, options: Mapping[str, Any] | None) -> tuple[str, Solver]:
    """The solver and its name."""
    if isinstance(solver, str):
        from solvers.registry import make_solver  # slow to import: not without a solver

        return solver, make_solver(solver, dict(options or {}))
    if isinstance(solver, type):
        raise InputError.one("solver", "class", solver.__name__, f"an object of it: {solver.__name__}()")
    if options:
        raise InputError.one("solver", "options", dict(options), "an object has its options already")
    return type(solver).__name__, solver
