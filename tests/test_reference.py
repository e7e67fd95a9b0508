"""The reference and its active-set method against exact arithmetic, enumeration and chosen answers."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
import scipy.linalg as sla
from hypothesis import given, settings
from hypothesis import strategies as st
from joints import make_joint, make_scene
from numpy.typing import NDArray
from small import make_load, make_prepared, solve_by_nnls

from harness.conformance.known_problems import contact_rows
from harness.verification import reference as module
from harness.verification.principal_pivoting import contact_set
from harness.verification.reference import reference, best_of_candidates
from problems.build import prepared
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness

Exact = list[Fraction]


def solve_exactly(M: list[Exact], b: Exact) -> Exact:
    """M x = b in rational numbers, M regular."""
    rows = [[*row, value] for row, value in zip(M, b, strict=True)]
    for j in range(len(rows)):
        pivot = next(i for i in range(j, len(rows)) if rows[i][j])
        rows[j], rows[pivot] = rows[pivot], rows[j]
        for i in range(len(rows)):
            if i != j and rows[i][j]:
                factor = rows[i][j] / rows[j][j]
                rows[i] = [a - factor * c for a, c in zip(rows[i], rows[j], strict=True)]
    return [row[-1] / row[j] for j, row in enumerate(rows)]


def conditioned(condition: float, seed: int, pairs: int = 5) -> tuple[Prepared, LoadCase]:
    """Two parts of the given condition number with random loads."""
    random = np.random.default_rng(seed)
    blocks = []
    for _ in range(2):
        basis = np.linalg.qr(random.standard_normal((pairs, pairs)))[0]
        K = (basis * np.geomspace(1, condition, pairs)) @ basis.T
        blocks.append((K + K.T) / 2)
    load = LoadCase(random.normal(0, 100, 2 * pairs), random.uniform(0.01, 0.5, pairs))
    return Prepared(Assembly(Stiffness.of(*blocks), contact_rows(pairs, 0))), load


def exact_solution(made: Prepared, load: LoadCase, active: NDArray[np.bool_]) -> tuple[Exact, Exact, Exact]:
    """x, λ_C and the open gaps of the contact set, all exact for the given floating-point data."""
    n, rows = made.assembly.n, np.flatnonzero(active)
    K, A = sla.block_diag(*made.assembly.K.matrices), made.assembly.A.toarray()
    A_C = A[:, rows]
    zero = np.zeros((len(rows), len(rows)))
    M = [[Fraction(float(v)) for v in row] for row in np.block([[K, A_C], [A_C.T, zero]])]
    solution = solve_exactly(M, [Fraction(float(v)) for v in [*load.f, *load.g[rows]]])
    x = solution[:n]
    gaps = [
        Fraction(float(load.g[j])) - sum(Fraction(float(A[i, j])) * x[i] for i in range(n))
        for j in np.flatnonzero(~active)
    ]
    return x, solution[n:], gaps


@pytest.mark.parametrize("condition", [1e2, 1e5, 1e7, 1e9, 1e12])
@pytest.mark.parametrize("seed", range(4))
def test_bound_covers_the_true_error(condition: float, seed: int) -> None:
    made, load = conditioned(condition, seed)
    found = best_of_candidates(made, load)
    x, lam, gaps = exact_solution(made, load, found.active)
    assert min([*lam, *gaps]) >= 0  # the exact optimum, so x is the answer
    error = max(abs(Fraction(float(a)) - b) for a, b in zip(found.x, x, strict=True))
    assert error <= found.bound_mm
    assert found.bound_mm < 1e-17 * condition * 2e3 * max(1.0, abs(found.x).max())


def test_refinement_reaches_further_than_the_plain_solution() -> None:
    made, load = conditioned(1e9, 1)
    found = best_of_candidates(made, load)
    x, _, _ = exact_solution(made, load, found.active)
    expected = np.array([float(v) for v in x])
    rows = np.flatnonzero(found.active)
    lam = np.zeros(made.assembly.m)
    lam[rows] = np.linalg.solve(made.Q[np.ix_(rows, rows)], made.dual_load(load)[rows])
    plain = abs(made.assembly.K.solve(load.f - made.assembly.A @ lam) - expected).max()
    assert abs(found.x - expected).max() < 1e-3 * plain


@pytest.mark.parametrize("weak", [0.0, 0.4])
def test_set_is_found_on_a_plate_with_weakly_active_contacts(weak: float) -> None:
    """Here cond(K) ≈ 1e6, so that rounding blurs which of the weakly active contacts are closed."""
    part = {"north": {"length": 261.0, "elements": 10}, "clamped": ["north"]}
    joint = make_joint(part, part | {"name": "b"}, length=1000.0, width=400.0, nodes=(33, 9))
    made = prepared(make_scene(joint))
    load, x, lam = chosen(made, 3, 0.3, weak)
    found = best_of_candidates(made, load)
    assert found.bound_mm < 1e-10
    assert found.active[lam > 0].all()
    assert abs(found.x - x).max() < 1e-8


@pytest.mark.parametrize("seed", range(3))
def test_a_wrong_set_is_corrected(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """One closed contact taken for open and one open contact taken for closed."""
    made = make_prepared(seed, 25, 10)
    load, x, lam = chosen(made, seed, 0.4, 0.0)
    wrong = lam > 0
    wrong[[np.flatnonzero(lam > 0)[0], np.flatnonzero(lam == 0)[0]]] ^= True
    monkeypatch.setattr(module, "contact_set", lambda *_, **__: wrong)
    found = best_of_candidates(made, load)
    np.testing.assert_array_equal(found.active, lam > 0)
    np.testing.assert_allclose(found.x, x, atol=1e-10)
    assert found.bound_mm < 1e-12


def test_the_bound_of_a_wrong_set_is_wide_and_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    made = make_prepared(1, 25)
    load, x, lam = chosen(made, 1, 0.4, 0.0)
    monkeypatch.setattr(module, "contact_set", lambda *_, **__: lam == 0)
    monkeypatch.setattr(module, "MAX_SET_CORRECTIONS", 1)
    found = best_of_candidates(made, load)
    assert 1e-2 < abs(found.x - x).max() <= found.bound_mm


def test_recovered_displacements_are_refined_once() -> None:
    """Factors that are wrong by 1e-4 leave an error of its square."""
    made = make_prepared(1, 25)
    load, x, lam = chosen(made, 1, 0.4, 0.0)
    blunt = Prepared(replace(made.assembly, K=Stiffness.of(*made.assembly.K.matrices)))
    for block, U in zip(blunt.assembly.K.blocks, made.assembly.K.factors, strict=True):
        block.U = U * (1 + 1e-4)  # type: ignore[attr-defined]
    error = abs(blunt.recover(lam, load) - x).max() / abs(x).max()
    assert 1e-9 < error < 1e-7


def test_no_load_is_no_displacement() -> None:
    made, load = conditioned(1e3, 0)
    found = best_of_candidates(made, replace(load, f=np.zeros(10)))
    assert found.bound_mm == 0
    assert not found.x.any()
    assert not found.active.any()


def chosen(made: Prepared, seed: int, closed: float, weak: float) -> tuple[LoadCase, Vector, Vector]:
    """A load case made from its answer x*, λ*; of the contacts the part `weak` has λ* = y* = 0."""
    random = np.random.default_rng(seed)
    m = made.assembly.m
    kind = random.random(m)
    lam = np.where(kind < closed, random.uniform(1, 100, m), 0.0)
    opening = np.where(kind > closed + weak, random.uniform(0.01, 1, m), 0.0)
    x = random.normal(0, 0.3, made.assembly.n)
    A = made.assembly.A
    return LoadCase(made.assembly.K.multiply(x) + A @ lam, A.T @ x + opening), x, lam


@pytest.mark.parametrize("weak", [0.0, 0.3])
@pytest.mark.parametrize("closed", [0.0, 0.4, 0.7])
@pytest.mark.parametrize(("pairs", "tools"), [(1, 0), (30, 0), (40, 25)])
def test_chosen_answer_is_recovered(closed: float, weak: float, pairs: int, tools: int) -> None:
    made = make_prepared(5, pairs, tools)
    load, x, lam = chosen(made, 6, closed, weak)
    found = best_of_candidates(made, load)
    # The data of the chosen answer are rounded: K⁻¹ times that is what may be missing.
    data = np.finfo(float).eps * made.assembly.m * abs(made.assembly.K.solve(abs(load.f))).max()
    assert abs(found.x - x).max() <= found.bound_mm + data + 1e-12
    np.testing.assert_allclose(found.lam, lam, atol=1e-6)
    assert found.bound_mm < 1e-12
    assert found.active[lam > 0].all()
    if weak == 0:
        np.testing.assert_array_equal(found.active, lam > 0)


@pytest.mark.parametrize("seed", range(6))
def test_reference_equals_non_negative_least_squares(seed: int) -> None:
    made = make_prepared(seed, 25, 10)
    case, _ = make_load(seed, made)
    x, lam = solve_by_nnls(made, case)
    found = best_of_candidates(made, case)
    np.testing.assert_allclose(found.x, x, atol=1e-9)
    np.testing.assert_array_equal(found.active, lam > 0)
    assert 0 < found.active.sum() < 35


@st.composite
def small_problems(draw: st.DrawFn) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Q = BᵀB + I and p in small whole numbers: many have λ_i = y_i = 0, as the arithmetic is exact."""
    m = draw(st.integers(1, 7))
    entries = st.lists(st.integers(-3, 3), min_size=m * m, max_size=m * m)
    B = np.array(draw(entries), dtype=float).reshape(m, m)
    Q = B.T @ B + np.eye(m)
    if draw(st.booleans()):  # p from an answer with weakly active contacts
        lam = np.array(draw(st.lists(st.integers(0, 2), min_size=m, max_size=m)))
        y = np.array(draw(st.lists(st.integers(0, 2), min_size=m, max_size=m)))
        return Q, Q @ lam - np.where(lam > 0, 0, y)
    return Q, np.array(draw(st.lists(st.integers(-6, 6), min_size=m, max_size=m)), dtype=float)


def by_enumeration(Q: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    for closed in product([False, True], repeat=len(p)):
        C = np.flatnonzero(closed)
        lam = np.zeros(len(p))
        lam[C] = np.linalg.solve(Q[np.ix_(C, C)], p[C])
        if (lam > -1e-10).all() and (Q @ lam - p > -1e-10).all():
            return lam
    raise AssertionError("a positive definite problem has an answer")


@given(small_problems(), st.integers(0, 127))
@settings(max_examples=150, deadline=None)
def test_active_set_equals_enumeration(
    problem: tuple[NDArray[np.float64], NDArray[np.float64]], start: int
) -> None:
    Q, p = problem
    first = np.array([start >> i & 1 == 1 for i in range(len(p))])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.verification.principal_pivoting.SMALL_PROBLEM", 1)
        from_halves = contact_set(Q, p)
    for active in (contact_set(Q, p), contact_set(Q, p, first), from_halves):
        C = np.flatnonzero(active)
        lam = np.zeros(len(p))
        lam[C] = np.linalg.solve(Q[np.ix_(C, C)], p[C])
        np.testing.assert_allclose(lam, by_enumeration(Q, p), atol=1e-9)


def beam(m: int) -> NDArray[np.float64]:
    """Fourth differences: the stiffness of a bending strip, on which plain active-set Newton may cycle."""
    K = np.diag(np.full(m, 6.0))
    for k, value in ((1, -4.0), (2, 1.0)):
        K += np.diag(np.full(m - k, value), k) + np.diag(np.full(m - k, value), -k)
    return K


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("stiff", [True, False])
def test_active_set_on_strips_with_weakly_active_contacts(seed: int, stiff: bool) -> None:
    """Half the contacts have λ = y = 0 up to rounding; it ends, and with the right forces."""
    random = np.random.default_rng(seed)
    m = 120
    Q = beam(m) if stiff else np.linalg.inv(beam(m))
    Q = (Q + Q.T) / 2
    kind = random.random(m)
    lam = np.where(kind < 0.3, random.uniform(0.5, 2, m), 0.0)
    y = np.where(kind > 0.8, random.uniform(0.5, 2, m), 0.0)
    p = Q @ lam - y
    active = contact_set(Q, p)
    found = np.zeros(m)
    found[active] = np.linalg.solve(Q[np.ix_(active, active)], p[active])
    condition = np.linalg.cond(Q)
    np.testing.assert_allclose(found, lam, atol=1e-15 * condition * m)
    assert active[lam > 0].all()
    assert not active[y > 0].any()


@pytest.mark.parametrize("seed", range(30))
def test_no_infeasibility_is_left_where_full_exchanges_alone_cycle(seed: int) -> None:
    random = np.random.default_rng(seed)
    Q, p = beam(40), random.standard_normal(40)
    active = contact_set(Q, p)
    C = np.flatnonzero(active)
    lam = np.zeros(40)
    lam[C] = np.linalg.solve(Q[np.ix_(C, C)], p[C])
    scale = abs(lam).max()
    assert lam.min() >= -1e-9 * scale
    assert (Q @ lam - p).min() >= -1e-9 * scale


def test_reference_is_computed_once(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path))
    made = make_prepared(1, 12)
    made.stages.key = "these matrices"
    case, _ = make_load(2, made)
    first = reference(made, case)
    monkeypatch.setattr(module, "best_of_candidates", lambda *_: pytest.fail("computed a second time"))
    second = reference(made, case)
    for name in ("x", "lam", "active"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert second.active.dtype == bool
    assert (first.bound_mm, first.route) == (second.bound_mm, second.route)


def test_another_load_has_another_reference(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same matrices, as after a change in the code of an effect."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path))
    made = make_prepared(1, 12)
    made.stages.key = "these matrices"
    case, _ = make_load(2, made)
    first = reference(made, case)
    more = reference(made, replace(case, f=2 * case.f))
    wider = reference(made, replace(case, g=case.g + 0.1))
    assert abs(first.x - more.x).max() > 1e-3
    assert abs(first.x - wider.x).max() > 1e-3
