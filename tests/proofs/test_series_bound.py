"""The bound on an answer's error: never below the error, and not far above it where the answer is good."""

import numpy as np
import pytest
import scipy.linalg as sla
from hypothesis import given, settings
from hypothesis import strategies as st
from small import make_load, make_prepared, solve_by_nnls

from harness.conformance.known_problems import known_case
from harness.verification.assess import Assessment, assess
from harness.verification.reference import best_of_candidates, proof_of
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared

DATA_MM = 1e-12  # what the rounding of f and g moves the chosen answers by, at most


def answer(prepared: Prepared, case: LoadCase, lam: np.ndarray, x: np.ndarray | None = None) -> Assessment:
    load = LoadCase(case.f, case.g, prepared.dual_load(case))
    return assess(proof_of(prepared), [load], [lam], [x])[0]


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
    assert abs(found.x - case.x).max() <= found.bound_mm + DATA_MM
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
        assert 1e-6 < error <= found.bound_mm + DATA_MM < 1e3 * error
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
    proof = proof_of(prepared)
    together = assess(proof, [load for _, load in cases], lams, [None] * 5)
    for (case, load), lam, found in zip(cases, lams, together, strict=True):
        alone = assess(proof, [load], [lam], [None])[0]
        np.testing.assert_allclose(found.x, alone.x, rtol=0, atol=1e-13)
        assert found.bound_mm < 1e-9 > alone.bound_mm
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
    found = answer(prepared, case, noisy)
    assert abs(found.x - x).max() <= found.bound_mm + DATA_MM < 1e-9
