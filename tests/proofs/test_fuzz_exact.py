"""Exact problems without end: no bound is below the true error, and nothing wrong is called solved.

Some forty load cases; RIVETBENCH_LONG=1 takes 50 000 load cases, RIVETBENCH_LONG=N takes N.
"""

import signal
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from exact_draws import LOADS, ExactLoad, ExactProblem, exact_problem
from sample_size import Log, draws
from small_problems import problem_in
from solver_forms import TOLERANCES, promised, promises

from harness import InputError, own_matrices, solve_dual
from harness.solving.solver_session import SolverSession
from harness.verification.assess import assess
from harness.verification.judge import Reference, judge
from harness.verification.proof import Proof
from harness.verification.reference import best_of_candidates, proof_of
from problems.build import prepared
from problems.forms import Form
from problems.forms.assembly import Vector
from problems.forms.prepared import Prepared
from solvers.registry import make_solver, modules, owner_of

SEED = 16
LIMIT = (20, signal.ITIMER_PROF)  # seconds of the processor per problem
LARGEST_CONDITION = 1e13  # the commands refuse 1e14

Variant = tuple[str, Form, dict[str, Any]]
USUAL: list[Variant] = [
    (name, form, {}) for name in modules() if owner_of(name) == "ours" for form in make_solver(name, {}).forms
]
OTHERS: list[Variant] = [
    *(("ipm", "dual", {"start": name}) for name in ("algorithm_4", "stp1", "stp2", "mehrotra")),
    *(("ipm", "dual", {"preconditioner": name}) for name in ("U", "none", "splitting", "direct")),
    ("ipm", "dual", {"scheme": "mehrotra"}),
    ("ipm", "dual", {"ordering": "open_last"}),
]


def test_nothing_wrong_is_called_solved_and_no_bound_is_too_small() -> None:
    log, count = Log(), draws(40, 50_000)
    for index in range(count // LOADS):
        made = exact_problem(SEED, index)
        with log.contained(f"exact_problem({SEED}, {index}), {made.kind}", *LIMIT):
            _check(log, made, np.random.default_rng([SEED, index, 1]))
    log.nothing_found()
    # Else the assertion above says little.
    assert log.seen["proven"] > 0.95 * log.seen["ordinary"] > 0.7 * count
    for name, form, _ in USUAL:
        assert log.seen[f"{name} {form}"] > 0.95 * log.seen["ordinary"], (name, form)


@pytest.mark.parametrize("index", [5283, 7801, 15489])
def test_what_was_wrong_once(index: int) -> None:
    """Found by the test above: no load after one of 1e30 N; nearly equal contacts whose sets alternate. Wrong
    by 1e-7 mm and more with a KKT residual of 1e-11.
    """
    log, made = Log(), exact_problem(SEED, index)
    _check(log, made, np.random.default_rng([SEED, index, 1]))
    assert not log.faults, log.words


def _bound(log: Log, what: str, x: Vector, bound_mm: float, exact: Vector) -> None:
    """A fault unless max|x − x*| ≤ bound, in rational numbers."""
    if bound_mm < np.inf and _max_error(x, exact) > Fraction(bound_mm):
        log.fault("bound", f"{what}: {float(_max_error(x, exact)):.3e} mm, bound {bound_mm:.3e} mm")


def _max_error(x: Vector, exact: Vector) -> Fraction:
    """max|x − x*|, exactly."""
    return max(abs(Fraction(a) - Fraction(b)) for a, b in zip(x.tolist(), exact.tolist(), strict=True))


def _check(log: Log, made: ExactProblem, random: np.random.Generator) -> None:
    data = Prepared(made.assembly)
    spectra = [np.linalg.eigvalsh(K) for K in made.assembly.K.matrices]
    condition = max(values[-1] for values in spectra) / min(values[0] for values in spectra)
    if not 0 < condition < LARGEST_CONDITION:
        return
    proof = proof_of(data)
    references = [_check_reference(log, data, draw) for draw in made.loads]
    for K in (made.assembly.K, made.assembly.K.as_sparse()):
        _check_any_point(log, proof_of(Prepared(replace(made.assembly, K=K))), made.loads, random)
    lams: list[list[Vector]] = [[draw.lam, *_hostile_forces(draw, random)] for draw in made.loads]
    if made.ordinary:
        log.seen["ordinary"] += len(made.loads)
        other = OTHERS[random.integers(len(OTHERS))]
        allowed = [promises(data, draw, condition) for draw in made.loads]
        for variant in (*USUAL, other):
            for k, lam in _check_solver(log, data, made.loads, references, allowed, variant):
                lams[k].append(lam)
        log.seen["proven"] += sum(known.bound_mm < np.inf for known in references)
    for draw, tried in zip(made.loads, lams, strict=True):
        enough = float(10.0 ** -random.integers(0, 30))
        vouched = assess(proof, [draw.load] * len(tried), tried, [None] * len(tried), enough)
        given = [draw.x * (1 + random.normal(0, 10.0 ** -random.integers(1, 16))) for _ in tried]
        vouched += assess(proof, [draw.load] * len(tried), tried, given, enough)
        for found in vouched:
            _bound(log, "series", found.x, found.bound_mm, draw.x)
    if random.random() < 0.05:
        _check_interface(log, made, random)


def _check_reference(log: Log, data: Prepared, each: ExactLoad) -> Reference:
    known = best_of_candidates(data, each.load)
    _bound(log, "reference", known.x, known.bound_mm, each.x)
    return known


def _check_any_point(
    log: Log, proof: Proof, loads: tuple[ExactLoad, ...], random: np.random.Generator
) -> None:
    """x and λ ≥ 0 that are wrong on purpose, all load cases at once, without and with a refinement."""
    size = 10.0 ** -random.integers(0, 20, len(loads))
    xs = [draw.x * (1 + s * random.normal(size=len(draw.x))) for draw, s in zip(loads, size, strict=True)]
    lams = [
        draw.lam * (1 + s * random.normal(size=len(draw.lam))) for draw, s in zip(loads, size, strict=True)
    ]
    for enough in (np.inf, 10.0 ** -random.integers(0, 30)):
        found = proof.proven([draw.load for draw in loads], lams, xs, enough)
        for draw, mine in zip(loads, found, strict=True):
            _bound(log, "any point", mine.x.hi, mine.bound_mm, draw.x)


def _hostile_forces(draw: ExactLoad, random: np.random.Generator) -> list[Vector]:
    """Forces near the exact ones, and far from them."""
    scale = abs(draw.lam).max(initial=0.0)
    noise = random.normal(size=(3, len(draw.lam))) * scale
    return [draw.lam + 1e-12 * noise[0], draw.lam + 1e-3 * noise[1], noise[2], np.zeros_like(draw.lam)]


def _check_solver(
    log: Log,
    data: Prepared,
    exact_loads: tuple[ExactLoad, ...],
    references: list[Reference],
    allowed: list[dict[str, tuple[float, float]]],
    variant: Variant,
) -> Iterator[tuple[int, Vector]]:
    """One load case after another, warm, and all at once where the solver can; yields the forces."""
    name, form, options = variant
    session = SolverSession(make_solver(name, options), problem_in(data, form), TOLERANCES[name])
    session.open(batched=True)
    loads = session.problem.loads([each.load for each in exact_loads])
    answers = [session.next(load, session.nearest(load), k) for k, load in enumerate(loads)]
    if session.batch is not None:
        answers += session.solve_batch(loads)
    for k, answer in zip([*range(LOADS)] * 2, answers, strict=False):
        if answer.status != "solved":
            if answer.status != "failed" and "cause" not in answer.details:
                log.fault("no cause", variant)
            continue
        log.seen[f"{name} {form} {options or ''}".strip()] += 1
        (x,) = session.problem.recover([answer.lam], [answer.x], [loads[k]])
        limit = min(allowed[k][name]) if variant in USUAL else allowed[k][name][0]
        error = _max_error(x, exact_loads[k].x)
        if not error <= Fraction(limit):
            log.fault("wrong but solved", f"{variant}: {float(error):.3e} mm off, allowed {limit:.3e} mm")
        judged = judge(data, exact_loads[k].load, references[k], x, answer.lam, limit)
        if judged.verdict == "within" and error > Fraction(limit) + Fraction(references[k].bound_mm):
            log.fault("judged wrongly", f"{variant}: {float(error):.3e} mm off, limit {limit:.3e} mm")
        if judged.verdict == "outside" and error <= Fraction(limit) - Fraction(references[k].bound_mm):
            log.fault("judged wrongly", f"{variant}: {float(error):.3e} mm off, limit {limit:.3e} mm")
        yield k, answer.lam


def _check_interface(log: Log, made: ExactProblem, random: np.random.Generator) -> None:
    """As a user's own matrices, once as they are and once with a contact twice."""
    assembly, draw = made.assembly, made.loads[0]
    K = sp.block_diag(assembly.K.matrices)
    try:
        data = prepared(own_matrices(K, assembly.A, draw.load.f, draw.load.g))
        reference = best_of_candidates(data, draw.load)
    except InputError:
        if made.ordinary:
            raise
        return
    _bound(log, "own matrices", reference.x, reference.bound_mm, draw.x)
    j = int(random.integers(assembly.m))
    twice = sp.hstack([assembly.A, assembly.A[:, [j]] * 2.0 ** random.integers(-3, 4)])
    g = np.append(draw.load.g, draw.load.g[j])
    with pytest.raises(InputError, match="depend"):
        _ = prepared(own_matrices(K, twice, draw.load.f, g)).Q


def test_a_dual_program_alone_is_solved_to_its_promise() -> None:
    """Q, λ and y in integers, so p = Qλ − y is exact."""
    log, count = Log(), draws(60, 5_000)
    solved = 0
    for index in range(count):
        random = np.random.default_rng([SEED, index, 2])
        m = int(random.integers(1, 13))
        L = np.tril(random.integers(-2, 3, (m, m)), -1) + np.diag(random.integers(1, 4, m))
        Q = L @ L.T
        lam = np.where(random.random(m) < random.choice([0.0, 0.5, 1.0]), random.integers(1, 50, m), 0)
        y = np.where(
            (lam > 0) | (random.random(m) < random.choice([0.0, 0.5, 1.0])), 0, random.integers(1, 50, m)
        )
        name, _, options = [*USUAL, *OTHERS][random.integers(len(USUAL) + len(OTHERS))]
        if options.get("start") == "algorithm_4":
            continue  # it needs K
        with log.contained(f"dual {index}, {name} {options}", *LIMIT):
            try:
                answer = solve_dual(Q, Q @ lam - y, name, options=options, tolerance=TOLERANCES[name])
            except InputError as refused:
                if "gave no answer" in str(refused):
                    continue
                raise
            if answer.status == "solved":
                low, high = np.linalg.eigvalsh(Q)[[0, -1]]
                error, rounding = answer.lam - lam, 1e-14 * high * max(1, lam.sum())
                if not np.sqrt(error @ Q @ error) <= promised(name, 1.0, m, low, lam.sum(), rounding):
                    log.fault("wrong but solved", f"{abs(error).max():.3e} N")
                solved += 1
    log.nothing_found()
    assert solved > 0.8 * count
