"""The bound on an answer's error: never below the error, and not far above it where the answer is good."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from small import make_load, make_prepared, make_strips, solve_by_nnls

from harness.conformance.known_problems import known_case, stiffness
from harness.verification.batched.assess import Assessment, assess
from harness.verification.batched.bound import Bound, gaps, independence
from harness.verification.batched.compliance import largest_compliance
from harness.verification.batched.residual import Split, bits, refined, residual, split
from harness.verification.exact_residual import gamma
from harness.verification.reference import best_of_candidates
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness


def exact(assembly: Assembly, f: np.ndarray, x: np.ndarray, lam: np.ndarray) -> list[Fraction]:
    """f − Kx − Aλ in rational numbers; x a list of parts."""
    K, A = sla.block_diag(*assembly.K.matrices), assembly.A.toarray()
    xs = [sum(map(Fraction, parts)) for parts in zip(*x, strict=True)]
    rows = zip(f, K, A, strict=True)
    return [
        Fraction(f_i)
        - sum(Fraction(k) * x_j for k, x_j in zip(K_i, xs, strict=True))
        - sum(Fraction(a) * Fraction(l_j) for a, l_j in zip(A_i, lam, strict=True))
        for f_i, K_i, A_i in rows
    ]


@pytest.mark.parametrize("seed", range(3))
def test_the_residual_against_rational_numbers(seed: int) -> None:
    """Near the answer, where f, Kx and Aλ nearly cancel."""
    prepared = make_strips(25) if seed else make_prepared(seed, 9, 4)
    rng = np.random.default_rng(seed)
    n, m = prepared.assembly.n, prepared.assembly.m
    lam = rng.uniform(0, 100, (m, 3))
    f = rng.normal(0, 500, (n, 3))
    x = split(prepared.assembly, prepared.assembly.K.solve(f - prepared.assembly.A @ lam))
    np.testing.assert_array_equal(x.head + x.tail, x.rounded)
    r, error = residual(prepared.assembly, f, x, lam)
    for k in range(3):
        wanted = exact(prepared.assembly, f[:, k], np.array([x.head[:, k], x.tail[:, k]]), lam[:, k])
        off = [abs(Fraction(a) - b) for a, b in zip(r[:, k], wanted, strict=True)]
        assert all(o <= Fraction(e) for o, e in zip(off, error[:, k], strict=True))
    assert error.max() < 1e-10
    stiffest = max(float(abs(K).sum(axis=0).max()) for K in prepared.assembly.K.matrices)
    d = prepared.assembly.K.solve(r) * (
        1 + 1e-3 * rng.standard_normal((n, 3))
    )  # a correction that leaves something
    there, r, error = refined(prepared.assembly, x, r, error, d, stiffest)
    for k in range(3):
        wanted = exact(prepared.assembly, f[:, k], np.array([there.head[:, k], there.tail[:, k]]), lam[:, k])
        off = [abs(Fraction(a) - b) for a, b in zip(r[:, k], wanted, strict=True)]
        assert all(o <= Fraction(e) for o, e in zip(off, error[:, k], strict=True))
    assert error.max() < 1e-10
    assert abs(r).max() > 0


@pytest.mark.parametrize("step", ["refined", "residual"])
def test_a_large_correction_is_in_doubt_by_its_product(step: str) -> None:
    """All of x as a correction, or as a tail, where the terms of Kx are a million times their sum."""
    n, rng = 40, np.random.default_rng(4)
    smooth = np.ones(n) + 1e-6 * rng.standard_normal(n)
    P = np.eye(n) - np.ones((n, n)) / n  # takes the mean away
    K = P @ np.diag(rng.uniform(1, 2, n) * 1e5) @ P + np.eye(n) * 1e-3
    assembly = Assembly(Stiffness.of(np.asfortranarray((K + K.T) / 2)), sp.csc_array(np.eye(n, 1)))
    zero, nothing = np.zeros((n, 1)), np.zeros((1, 1))
    at = split(assembly, zero)
    r, error = residual(assembly, zero, at, nothing)
    stiffest = float(abs(K).sum(axis=0).max())
    if step == "refined":
        there, r, error = refined(assembly, at, r, error, smooth[:, None], stiffest)
    else:
        there = Split(zero, smooth[:, None])
        r, error = residual(assembly, zero, there, nothing)
    wanted = exact(assembly, zero[:, 0], np.array([there.head[:, 0], there.tail[:, 0]]), np.zeros(1))
    off = np.array([float(abs(Fraction(a) - b)) for a, b in zip(r[:, 0], wanted, strict=True)])
    assert (off <= error[:, 0]).all()
    assert (off > gamma(4) * abs(r[:, 0])).any()


def test_products_that_cancel_are_still_in_doubt() -> None:
    """Kx = 0, its sums without rounding: what a sum of K₂x₁ may lose is there all the same, in each row."""
    n, rest = 64, 2.0**-40  # 1 is cut off, the rest is K₂
    K = np.asfortranarray((1 + rest) * (-1.0) ** np.add.outer(np.arange(n), np.arange(n)))
    assembly = Assembly(Stiffness.of(K), sp.csc_array(np.eye(n, 1)))
    zero = np.zeros((n, 1))
    r, error = residual(assembly, zero, split(assembly, np.ones((n, 1))), np.zeros((1, 1)))
    assert not r.any()
    assert (error >= gamma(n) * n * rest).all()


@pytest.mark.parametrize("n", [1, 2, 100, 2193, 5654, 10**6])
def test_the_products_of_heads_fit_into_a_double(n: int) -> None:
    assert 2 * (bits(n) - 1) + np.log2(n) <= 53 < 2 * (bits(n) + 1) + np.log2(max(n, 2))


def test_the_gaps_and_their_error() -> None:
    prepared = make_prepared(3, 12, 5)
    rng = np.random.default_rng(0)
    g, x = rng.uniform(0, 1, (17, 1)), split(prepared.assembly, rng.normal(0, 1, (29, 1)))
    s, error = gaps(prepared.assembly, g, x)
    A = prepared.assembly.A.toarray()
    for j in range(17):
        wanted = Fraction(g[j, 0]) - sum(
            Fraction(a) * (Fraction(h) + Fraction(t))
            for a, h, t in zip(A[:, j], x.head[:, 0], x.tail[:, 0], strict=True)
        )
        assert abs(Fraction(s[j, 0]) - wanted) <= Fraction(error[j, 0]) <= Fraction(1, 10**14)


def test_independence_of_contacts() -> None:
    """Two parts: 2. A chain of three parts: AᵀA = [[2, −1], [−1, 2]] at each node, 1. A tool: 1."""
    eye = sp.eye_array(4)
    pair = sp.csc_array(sp.vstack([eye, -eye]))
    chain = sp.csc_array(sp.block_array([[eye, None], [-eye, eye], [None, -eye]]))
    for A, wanted in ((pair, 2.0), (chain, 1.0), (sp.csc_array(eye), 1.0)):
        found = independence(Assembly(Stiffness.of(np.eye(A.shape[0])), A))
        # what is proven of a small matrix is a share of what is true
        assert 0.8 * wanted <= found <= wanted
    twice = sp.csc_array(sp.hstack([eye, eye]))
    assert independence(Assembly(Stiffness.of(np.eye(4)), twice)) == 0.0


@pytest.mark.parametrize("make", [lambda: make_prepared(2, 40, 7), lambda: make_strips(80)])
def test_the_largest_compliance_is_above_and_close(make: Callable[[], Prepared]) -> None:
    prepared = make()
    kappa = min(np.linalg.eigvalsh(K)[0] for K in prepared.assembly.K.matrices)
    wanted = max(np.diag(np.linalg.inv(K)).max() for K in prepared.assembly.K.matrices)
    assert wanted <= largest_compliance(prepared, kappa) <= 1.05 * wanted < 1 / kappa
    assert np.isinf(largest_compliance(prepared, 0.0))


def answer(prepared: Prepared, case: LoadCase, lam: np.ndarray, x: np.ndarray | None = None) -> Assessment:
    load = LoadCase(case.f, case.g, prepared.dual_load(case))
    return assess(Bound.of(prepared), [load], [lam], [x])[0]


@given(
    seed=st.integers(0, 10**6),
    closed=st.floats(0, 1),
    force=st.sampled_from([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1e-1]),
    moved=st.sampled_from([0.0, 1e-12, 1e-9, 1e-6, 1e-2]),
    primal=st.booleans(),
)
@settings(deadline=None, max_examples=60)
def test_the_error_never_exceeds_the_bound(
    seed: int, closed: float, force: float, moved: float, primal: bool
) -> None:
    """Manufactured answers, spoilt in λ (relatively) and in x."""
    rng = np.random.default_rng(seed)
    prepared = make_prepared(seed % 7, 8, 3)
    case = known_case(rng, prepared, closed, "")
    lam = np.maximum(case.lam * (1 + force * rng.standard_normal(11)) + force * rng.standard_normal(11), 0)
    x = case.x + moved * rng.standard_normal(len(case.x)) if primal else None
    found = answer(prepared, LoadCase(case.load.f, case.load.g), lam, x)
    assert abs(found.x - case.x).max() <= found.bound_mm
    if primal:
        np.testing.assert_array_equal(found.x, x)
    if force == 0 and (moved == 0 or not primal):
        assert found.bound_mm < 1e-9


def test_a_bound_for_negative_forces_and_for_a_contact_that_should_be_closed() -> None:
    prepared = make_prepared(1, 12)
    case, _ = make_load(2, prepared)
    x, lam = solve_by_nnls(prepared, case)
    bad = lam.copy()
    bad[np.argmax(bad)] = 0.0
    for spoilt in (lam - 1.0, bad, np.zeros_like(lam)):
        found = answer(prepared, case, spoilt)
        error = abs(found.x - x).max()
        assert 1e-6 < error <= found.bound_mm < 1e3 * error
    assert answer(prepared, case, lam - 1.0).dual_residual == pytest.approx(1.0)


def test_the_residuals_are_those_of_the_judge() -> None:
    prepared = make_prepared(1, 12, 3)
    rng = np.random.default_rng(0)
    case, _ = make_load(2, prepared)
    lam, x = rng.uniform(0, 50, 15), rng.normal(0, 0.1, 27)
    K, A = sla.block_diag(*prepared.assembly.K.matrices), prepared.assembly.A.toarray()
    for own in (None, x):
        found = answer(prepared, case, lam, own)
        at = np.linalg.solve(K, case.f - A @ lam) if own is None else own
        gap = case.g - A.T @ at
        np.testing.assert_allclose(found.x, at, atol=1e-12)
        np.testing.assert_allclose(found.gap, gap, atol=1e-12)
        assert found.primal_residual == pytest.approx(max(-gap.min(), 0))
        out_of_balance = abs(K @ at - case.f + A @ lam).max()
        assert found.dual_residual == pytest.approx(out_of_balance, rel=1e-6, abs=1e-8)
        assert found.duality_gap == pytest.approx(abs(at @ K @ at - case.f @ at + case.g @ lam), rel=1e-6)


def test_a_block_is_its_cases_one_by_one() -> None:
    prepared = make_prepared(3, 20, 4)
    cases = [make_load(seed, prepared) for seed in range(5)]
    lams = [solve_by_nnls(prepared, case)[1] for case, _ in cases]
    bound = Bound.of(prepared)
    together = assess(bound, [load for _, load in cases], lams, [None] * 5)
    for (case, load), lam, found in zip(cases, lams, together, strict=True):
        alone = assess(bound, [load], [lam], [None])[0]
        np.testing.assert_allclose(found.x, alone.x, rtol=0, atol=1e-13)
        np.testing.assert_allclose(found.bound_mm, alone.bound_mm, rtol=0.5)
        known = best_of_candidates(prepared, case)
        assert abs(found.x - known.x).max() <= found.bound_mm + known.bound_mm
        assert found.bound_mm < 1e-9


def test_weakly_active_contacts_do_not_widen_the_bound() -> None:
    """Forces and gaps both zero, where the root of the complementarity would lose half of the digits."""
    prepared = make_prepared(6, 15)
    rng = np.random.default_rng(1)
    m, n = prepared.assembly.m, prepared.assembly.n
    lam = np.where(np.arange(m) % 3 == 0, rng.uniform(1, 100, m), 0.0)
    y = np.where(np.arange(m) % 3 == 2, rng.uniform(0.05, 1, m), 0.0)
    x = rng.normal(0, 0.3, n)
    A = prepared.assembly.A
    case = LoadCase(prepared.assembly.K.multiply(x) + A @ lam, A.T @ x + y)
    noisy = lam + np.where(lam == 0, 1e-13, 0.0)
    assert abs(answer(prepared, case, noisy).x - x).max() <= answer(prepared, case, noisy).bound_mm < 1e-9


def test_nothing_is_vouched_for_where_K_is_not_proven_definite() -> None:
    blocks = (stiffness(np.random.default_rng(0), 3),)
    prepared = Prepared(Assembly(Stiffness.of(*blocks), sp.csc_array(np.eye(3))))
    found = Bound.of(prepared)
    none = replace(found, kappa=0.0).bound(*(np.zeros((3, 2)) for _ in range(5)))
    assert np.isinf(none).all()
    assert found.kappa > 0
