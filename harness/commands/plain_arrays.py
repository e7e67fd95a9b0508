"""Problems and answers as arrays: your own matrices, an x judged, one dual problem, a series in memory."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, Literal

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import ArrayLike

from harness.planning.form_choice import chosen_form, form_of_answer
from harness.scene.solution import Source, load_scene, refuse_not_positive, solver_named
from harness.series.session import Job, Result, SeriesSession
from harness.solving.call_lock import in_turn
from harness.solving.solver_session import forces_of, form_of
from harness.verification.judge import LIMIT_MM, Judgement
from harness.verification.reference_problem import open_problem
from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import Assembly, DualLoadCase, LoadCase, Matrix, Vector
from problems.forms.prepared import dual_alone
from problems.forms.problem import in_form
from problems.input.matrix_entries import SYMMETRY, contradictions
from problems.input.user_matrices import checked, is_large_sparse
from problems.load_cases import Listed, LoadCases
from problems.model.scene import JointScene, ManufacturedProblem, ManufacturedScene, Scene
from solvers.base import Answer, Solver

NOT_FINITE = "NaN or infinity"


def own_matrices(
    K: Any, A: Any, f: ArrayLike, g: ArrayLike, nodes: ArrayLike | None = None, title: str = "own matrices"
) -> Scene:
    """Make a scene of matrices of your own, dense or sparse.

    Parameters
    ----------
    K : array or sparse array (n, n), N/mm
        Stiffness matrix, symmetric positive definite.
    A : array or sparse array (n, m)
        Column j is the normal of contact j.
    f : array (n,), N
        Nodal forces.
    g : array (m,), mm
        Initial gaps.
    nodes : array (n, 2), mm, optional
        Positions of the unknowns, by which `newton` numbers the contacts.
    title : str, optional
        Title of the scene.

    Returns
    -------
    Scene
        For `solve`, `judge` and `solve_series`.

    Raises
    ------
    InputError
        If shapes or values are wrong, or K is not symmetric and positive definite.

    Examples
    --------
    A spring of 100 N/mm, pressed by 50 N against a stop 0.2 mm away:

    >>> from rivetbench import own_matrices, solve
    >>> answer = solve(own_matrices([[100.0]], [[1.0]], [50.0], [0.2]))
    >>> print(f"{answer.x[0]:.3f} mm, {answer.lam[0]:.3f} N")
    0.200 mm, 30.000 N
    """
    given = {"K": K, "A": A, "f": f, "g": g} | ({} if nodes is None else {"nodes": nodes})
    arrays = {name: _array(title, name, value) for name, value in given.items()}
    assembly, load = checked(arrays, dict.fromkeys(arrays, title), is_large_sparse(K))
    return ManufacturedScene.of(title, ManufacturedProblem(assembly, load), title)


def judge(
    scene: Source,
    x: ArrayLike,
    lam: ArrayLike | None = None,
    limit_mm: float = LIMIT_MM,
    form: Form | None = None,
) -> Judgement:
    """Judge an answer that came from elsewhere, against the certified reference of the scene.

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or the content of its file.
    x : array (n,), mm
        Displacements; in the sparse form all unknowns of the model.
    lam : array (m,), N, optional
        Contact forces.
    limit_mm : float, optional
        Limit on max|x − x*|, mm.
    form : str, optional
        "primal", "dual" or "sparse"; in the sparse form nothing dense is made. By default primal; of own
        matrices, whose x is the same in each, the cheaper one.

    Returns
    -------
    Judgement
        The verdict and its figures.

    Raises
    ------
    InputError
        If the scene or the limit is wrong, or a vector has another length or is not finite.

    Examples
    --------
    >>> from rivetbench import judge, own_matrices
    >>> judge(own_matrices([[100.0]], [[1.0]], [50.0], [0.2]), [0.2001]).verdict
    'outside'
    """
    refuse_not_positive("judge", limit_mm=limit_mm)
    scene = load_scene(scene)
    problem = open_problem(scene, form_of_answer(scene, form))
    n, m = problem.prepared.assembly.n, problem.prepared.assembly.m
    x = _vector("judge", "x", x, n)
    forces = np.full(m, np.nan) if lam is None else _vector("judge", "lam", lam, m)
    return problem.judged(x, forces, limit_mm)


def solve_dual(
    Q: ArrayLike,
    p: ArrayLike,
    solver: str | Solver = "newton",
    *,
    options: Mapping[str, Any] | None = None,
    tolerance: float = 1e-9,
) -> Answer:
    """Solve min ½λᵀQλ − pᵀλ, λ ≥ 0, on plain arrays; the answer is the solver's own, not judged.

    Parameters
    ----------
    Q : array (m, m), mm/N
        Symmetric positive definite.
    p : array (m,), mm
        Overlap without contact forces; any units that fit to those of Q.
    solver : str or Solver, optional
        A solver by name, or an object of your own.
    options : dict, optional
        Options of a solver by name.
    tolerance : float, optional
        Passed to the solver.

    Returns
    -------
    Answer
        Its `lam` (m,) in N, `status` and `iterations`.

    Raises
    ------
    InputError
        If Q, p or the tolerance is wrong, or the solver gives no valid answer.

    Examples
    --------
    >>> from rivetbench import solve_dual
    >>> solve_dual([[2.0, 0.0], [0.0, 1.0]], [4.0, -1.0], "gi").lam.tolist()
    [2.0, 0.0]
    """
    refuse_not_positive("solve_dual", tolerance=tolerance)
    Q = _numbers("solve_dual", "Q", Q, order="F")
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
    return forces_of(name, chosen, in_form(dual_alone(Q), form), DualLoadCase(0 * p, -p, p), tolerance)


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

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or the content of its file.
    cases : LoadCases or iterable of LoadCase
        From `random_gaps`, or load cases of your own, taken and copied some at a time: a generator may have
        no end and reuse its arrays. In the sparse form f has all unknowns of the model.
    solver : str or Solver, optional
        A solver by name, or an object of your own.
    options : dict, optional
        Options of a solver by name.
    form : str, optional
        "primal", "dual" or "sparse"; by default the usual one of the solver, of own matrices the cheaper one.
    tolerance : float, optional
        Passed to the solver.
    limit_mm : float, optional
        Limit on the displacement error, mm.
    check : int, optional
        Every `check`-th case is compared with the certified reference; 0: none.

    Returns
    -------
    iterator of Result
        For each case, in order: its `row` (status, iterations, seconds, residuals, the proven bound_mm,
        verdict) and the remaining `gap`, (m,) mm in float32; None without an answer.

    Raises
    ------
    InputError
        If the scene, a load case or an option is wrong.

    Examples
    --------
    >>> from rivetbench import LoadCase, own_matrices, solve_series
    >>> scene = own_matrices([[100.0]], [[1.0]], [50.0], [0.2])
    >>> cases = (LoadCase([50.0], [gap]) for gap in (0.2, 0.6))
    >>> [f"{result.gap[0]:.3f}" for result in solve_series(scene, cases)]
    ['0.000', '0.100']
    """
    refuse_not_positive("solve_series", tolerance=tolerance, limit_mm=limit_mm)
    scene = load_scene(scene)
    name, chosen = solver_named(solver, options)
    of_own = form is None and not isinstance(scene, JointScene)
    taken = chosen_form(scene, chosen.forms, None).form if of_own else form_of(name, chosen.forms, form)
    first = cases if isinstance(cases, LoadCases) else Listed(())
    job = Job(
        solver=name,
        tolerance=tolerance,
        limit_mm=limit_mm,
        check=check,
        scene=scene,
        cases=first,
        form=taken,
        solver_options=dict(options or {}),
    )
    session = SeriesSession(job, chosen)
    if isinstance(cases, LoadCases):
        one = (cases.load(k) for k in range(cases.first, cases.first + min(cases.count, 1)))
        next(_copies(one, session.data.assembly), None)  # refused if made for another form
        return _results(session, [cases])
    copies = _copies(cases, session.data.assembly)
    return _results(session, _blocks(list(copies) if isinstance(cases, Sequence) else copies, session.block))


def _copies(cases: Iterable[LoadCase], assembly: Assembly) -> Iterator[LoadCase]:
    """Copies of the cases; one whose f is that of the case before shares its array: K⁻¹f is computed once."""
    last = np.zeros(0)
    for k, case in enumerate(cases):
        f = _vector(f"case {k}", "f", case.f, assembly.n)
        last = last if np.array_equal(f, last) else f
        yield LoadCase(last, _vector(f"case {k}", "g", case.g, assembly.m))


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


def _array(where: str, name: str, value: Any) -> Any:
    """An array, or a sparse matrix as it is. Raises InputError for rows of several lengths."""
    try:
        return value if sp.issparse(value) else np.asanyarray(value)
    except ValueError as error:
        raise InputError.one(where, name, value, "rows of one length") from error


def _numbers(where: str, name: str, value: ArrayLike, order: Literal["K", "F"] = "K") -> Matrix:
    """A copy, which a form may make read-only. Raises InputError unless it has real numbers alone."""
    try:
        if np.iscomplexobj(value):  # NumPy would leave the imaginary parts out
            raise TypeError("complex")
        numbers = np.array(value, dtype=float, order=order)
    except (TypeError, ValueError) as error:
        raise InputError.one(where, name, value, "must be real numbers") from error
    if np.ma.is_masked(value):
        raise InputError.one(where, name, "a masked array", "a number in each place; some are masked")
    return numbers


def _vector(where: str, name: str, value: ArrayLike, size: int) -> Vector:
    vector = _numbers(where, name, value)
    if vector.shape != (size,):
        raise InputError.one(where, f"{name}.shape", vector.shape, f"must be ({size},)")
    for k in np.flatnonzero(~np.isfinite(vector))[:1]:
        raise InputError.one(where, f"{name}[{k}]", NOT_FINITE, "every entry must be finite")
    return vector
