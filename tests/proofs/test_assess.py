"""Answers of a series: their residuals, and their bounds in a block."""

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from small_problems import make_load, make_prepared, solve_by_nnls

from harness.verification.assess import assess
from harness.verification.reference import best_of_candidates, proof_of
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness


def test_the_residuals_are_those_of_the_judge() -> None:
    prepared = make_prepared(1, 12, 3)
    rng = np.random.default_rng(0)
    _, case = make_load(2, prepared)
    lam, x = rng.uniform(0, 50, 15), rng.normal(0, 0.1, 27)
    K, A = sla.block_diag(*prepared.assembly.K.matrices), prepared.assembly.A.toarray()
    for own in (None, x):
        (answer,) = assess(proof_of(prepared), [case], [lam], [own])
        at = np.linalg.solve(K, case.f - A @ lam) if own is None else own
        gap = case.g - A.T @ at
        np.testing.assert_allclose(answer.x, at, atol=1e-12)
        np.testing.assert_allclose(answer.gap, gap, atol=1e-12)
        assert answer.primal_residual == pytest.approx(max(-gap.min(), 0))
        out_of_balance = abs(K @ at - case.f + A @ lam).max()
        assert answer.dual_residual == pytest.approx(out_of_balance, rel=1e-6, abs=1e-8)
        assert answer.duality_gap == pytest.approx(abs(at @ K @ at - case.f @ at + case.g @ lam), rel=1e-6)


def test_a_block_is_its_cases_one_by_one() -> None:
    prepared = make_prepared(3, 20, 4)
    cases = [make_load(seed, prepared) for seed in range(5)]
    lams = [solve_by_nnls(prepared, case)[1] for case, _ in cases]
    proof = proof_of(prepared)
    together = assess(proof, [load for _, load in cases], lams, [None] * 5)
    for (case, load), lam, answer in zip(cases, lams, together, strict=True):
        alone = assess(proof, [load], [lam], [None])[0]
        np.testing.assert_allclose(answer.x, alone.x, rtol=0, atol=1e-13)
        assert answer.bound_mm < 1e-9 > alone.bound_mm
        known = best_of_candidates(prepared, case)
        assert abs(answer.x - known.x).max() <= answer.bound_mm + known.bound_mm
        assert answer.bound_mm < 1e-9


def test_closed_contacts_whose_compliance_rounding_makes_singular_are_no_fault() -> None:
    """K = diag(1, 10¹⁶), A = [[1, 1], [0, −1]]: Q is [[1, 1], [1, 1 + 10⁻¹⁶]], and λ = (¼, ¼), x₁ = ½."""
    A = sp.csc_array(np.array([[1.0, 1.0], [0.0, -1.0]]))
    prepared = Prepared(Assembly(Stiffness.of(np.diag([1.0, 1e16])), A))
    load = LoadCase(np.array([1.0, 0.0]), np.array([0.5, 0.5]))
    (answer,) = assess(proof_of(prepared), [load], [np.array([0.25, 0.25])], [None], 1e-8)
    np.testing.assert_allclose(answer.x, [0.5, 0.0], atol=1e-15)
    assert answer.bound_mm >= 0
