"""rivetbench from Python.

    from harness import load_scene, solve, judge

    scene = load_scene("gallery/three-part-stack")
    answer = solve(scene)                            # the certified reference: x, λ, gaps, error bound
    answer = solve(scene, "piqp", tolerance=1e-9)    # a solver by name, judged
    judge(scene, x, lam)                             # an x that came from elsewhere

A problem is min ½xᵀKx − fᵀx subject to Aᵀx ≤ g: x (n,) displacements in mm, λ (m,) contact forces in N,
g (m,) initial gaps in mm, f (n,) loads in N. A `scene` argument is a Scene, the name of a packaged one, the
path of a .toml or .npz file, or a dict with the content of a scene's file. All faults of an input are in one
InputError. Matrices are cached as by the command line. Arrays are copied, and threads take turns
(solving/turns.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import ArrayLike

from harness.conformance import check
from harness.planning.form_choice import chosen_form
from harness.scene import solution
from harness.scene.solution import Solution, Source, solver_named
from harness.series.session import Job, Result, SeriesSession
from harness.solving.call_lock import in_turn
from harness.solving.session import forces_of, form_of
from harness.verification.judge import LIMIT_MM, Judgement
from harness.verification.reference_problem import opened
from problems.errors import InputError
from problems.forms import FORMS, Form
from problems.forms.assembly import Assembly, DualLoadCase, LoadCase, Vector
from problems.forms.prepared import dual_alone
from problems.forms.problem import in_form
from problems.input.matrix_entries import SYMMETRY, contradictions
from problems.input.user_matrices import SMALL, checked
from problems.load_cases import Listed, LoadCases
from problems.load_cases import random_gaps as random_fields
from problems.model.scene import ManufacturedProblem, ManufacturedScene, Scene
from solvers.base import Answer, Solver

__all__ = [
    "Answer",
    "DualLoadCase",
    "InputError",
    "Judgement",
    "LoadCase",
    "Scene",
    "Solution",
    "Solver",
    "check_solver",
    "judge",
    "load_scene",
    "own_matrices",
    "random_gaps",
    "solve",
    "solve_dual",
    "solve_series",
]

NOT_FINITE = "NaN or infinity"

check_solver = in_turn(check.run)
load_scene = in_turn(solution.load_scene)
random_gaps = in_turn(random_fields.random_gaps)
solve = in_turn(solution.solve)


@in_turn
def own_matrices(
    K: Any, A: Any, f: ArrayLike, g: ArrayLike, nodes: ArrayLike | None = None, title: str = "own matrices"
) -> Scene:
    """A scene of your own matrices, dense or sparse.

    K : (n, n) symmetric positive definite, N/mm. A : (n, m), column j the normal of contact j.
    f : (n,) N. g : (m,) mm. nodes : (n, 2) mm, which `newton` uses to number the contacts.
    """
    given = {"f": f, "g": g} | ({} if nodes is None else {"nodes": nodes})
    arrays = {name: M if sp.issparse(M) else np.asarray(M) for name, M in (("K", K), ("A", A))}
    arrays |= {name: np.array(value) for name, value in given.items()}
    sparse = sp.issparse(K) and K.shape[0] > SMALL
    assembly, load = checked(arrays, dict.fromkeys(arrays, title), sparse)
    return ManufacturedScene.of(title, ManufacturedProblem(assembly, load), title)


@in_turn
def judge(
    scene: Source,
    x: ArrayLike,
    lam: ArrayLike | None = None,
    limit_mm: float = LIMIT_MM,
    form: Form = "primal",
) -> Judgement:
    """Judge x (n,) in mm, and λ (m,) in N if there is one, against the certified reference of the scene.

    In the sparse form x are all unknowns of the model, and nothing dense is made.
    """
    scene = load_scene(scene)
    problem = opened(scene, chosen_form(scene, FORMS, form).form)
    n, m = problem.prepared.assembly.n, problem.prepared.assembly.m
    x = _vector("judge", "x", x, n)
    forces = np.full(m, np.nan) if lam is None else _vector("judge", "lam", lam, m)
    return problem.judged(x, forces, limit_mm)


@in_turn
def solve_dual(
    Q: ArrayLike,
    p: ArrayLike,
    solver: str | Solver = "newton",
    *,
    options: Mapping[str, Any] | None = None,
    tolerance: float = 1e-9,
) -> Answer:
    """One solver on plain arrays: min ½λᵀQλ − pᵀλ, λ ≥ 0. The answer is the solver's own, not judged.

    Q : (m, m) symmetric positive definite. p : (m,). Units: mm/N and mm, or any others that fit.
    """
    Q = np.array(Q, dtype=float, order="F")
    if Q.ndim != 2 or Q.shape[0] != Q.shape[1]:
        raise InputError.one("solve_dual", "Q.shape", Q.shape, "must be a square matrix")
    if not np.isfinite(Q).all():
        raise InputError.one("solve_dual", "Q", NOT_FINITE, "every entry must be finite")
    p = _vector("solve_dual", "p", p, len(Q))
    for i, j in contradictions(sp.csr_array(Q))[:1]:
        key, allowed = f"Q[{i}, {j}] and Q[{j}, {i}]", f"must be symmetric, within {SYMMETRY:g} √(Q_ii Q_jj)"
        raise InputError.one("solve_dual", key, [Q[i, j].item(), Q[j, i].item()], allowed)
    try:
        sla.cholesky(Q)
    except np.linalg.LinAlgError as error:
        raise InputError.one("solve_dual", "Q", str(error), "must be positive definite") from error
    name, chosen = solver_named(solver, options)
    form = form_of(name, chosen.forms, "dual")
    return forces_of(name, chosen, in_form(dual_alone(Q), form), LoadCase(0 * p, -p), tolerance)


@in_turn
def solve_series(
    scene: Source,
    cases: LoadCases | Iterable[LoadCase],
    solver: str | Solver = "newton",
    *,
    options: Mapping[str, Any] | None = None,
    form: Form | None = None,
    tolerance: float = 1e-11,
    limit_mm: float = LIMIT_MM,
    check: int = 0,
) -> Iterator[Result]:
    """Solve load cases on one assembly: in blocks if the solver can, else each from the nearest answer.

    cases : made by `random_gaps` or another file of problems/load_cases; or each a LoadCase(f, g), taken and
        copied some at a time, so that a generator may have no end and reuse its arrays.
    form : in "sparse", f and the generated cases have all unknowns of the model, and nothing dense is made.
    check : every so many cases are compared with the certified reference; 0: none.
    Yields for each case, in order, its `row` (status, iterations, seconds, residuals, the proven bound_mm,
    verdict) and the remaining `gap`, (m,) mm in float32; None without an answer.
    """
    scene = load_scene(scene)
    name, chosen = solver_named(solver, options)
    taken = form_of(name, chosen.forms, form)
    first = cases if isinstance(cases, LoadCases) else Listed(())
    job = Job(
        scene, first, name, taken, tolerance, limit_mm, check, threads=None, options=dict(options or {})
    )
    session = SeriesSession(job, chosen)
    if isinstance(cases, LoadCases):
        return _results(session, [cases])
    copies = _copies(cases, session.data.assembly)
    return _results(session, _blocks(list(copies) if isinstance(cases, Sequence) else copies, session.block))


def _copies(cases: Iterable[LoadCase], assembly: Assembly) -> Iterator[LoadCase]:
    """With the same array f as the case before if its entries are the same: K⁻¹f is then computed once."""
    before = np.zeros(0)
    for k, case in enumerate(cases):
        f = _vector(f"case {k}", "f", case.f, assembly.n)
        before = before if np.array_equal(f, before) else f
        yield LoadCase(before, _vector(f"case {k}", "g", case.g, assembly.m))


def _blocks(cases: Iterable[LoadCase], size: int) -> Iterator[LoadCases]:
    """Cases that are solved together, with their numbers."""
    cases, first = iter(cases), 0
    while some := tuple(islice(cases, size)):
        yield Listed(some, first)
        first += len(some)


def _results(session: SeriesSession, blocks: Iterable[LoadCases]) -> Iterator[Result]:
    step = in_turn(next)
    for cases in blocks:
        session.job = replace(session.job, cases=cases)
        results = session.solve(range(cases.first, cases.first + cases.count))
        while some := step(results, None):
            yield from some


def _vector(where: str, name: str, value: ArrayLike, size: int) -> Vector:
    try:
        vector = np.array(value, dtype=float)  # a copy, which a form may make read-only
    except (TypeError, ValueError) as error:
        raise InputError.one(where, name, value, "must be numbers") from error
    if vector.shape != (size,):
        raise InputError.one(where, f"{name}.shape", vector.shape, f"must be ({size},)")
    for k in np.flatnonzero(~np.isfinite(vector))[:1]:
        raise InputError.one(where, f"{name}[{k}]", NOT_FINITE, "every entry must be finite")
    return vector
