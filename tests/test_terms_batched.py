"""Terms of the bound for many load cases at a time, each where it dominates.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp
from springs import array, diagonal

from harness.verification.batched.assess import assess
from harness.verification.batched.bound import Bound, independence
from harness.verification.batched.bound import gaps as batched_gaps
from harness.verification.batched.compliance import largest_compliance
from harness.verification.batched.residual import Split, refined, residual, split
from harness.verification.exact_residual import (
    gamma,
)
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness


def batched(made: Assembly, kappa: float, compliance: float, sigma2: float = 1.0) -> Bound:
    """A bound with the exact constants, so that nothing but its formula is tested."""
    prepared = Prepared(made)
    stiffest = float(abs(made.K.matrices[0]).sum(axis=0).max())
    return Bound(prepared, kappa, stiffest, sigma2, compliance, np.linalg.cholesky(prepared.Q).T)


ZERO = np.zeros((1, 1))


@pytest.mark.parametrize("K", [1 / 16, 1.0, 16.0])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_block_a_residual_moves_the_answer(K: float, share: float) -> None:
    """Without contact e = r/K, be r known by value or only bounded."""
    bound, e = batched(diagonal(K), K, 1 / K), 2.0**-20
    r, error = np.full((1, 1), share * K * e), np.full((1, 1), (1 - share) * K * e)
    assert e <= bound.bound(r, error, ZERO + 1, ZERO, ZERO)[0] <= 1.02 * e


@pytest.mark.parametrize("K", [1 / 16, 1.0, 16.0])
@pytest.mark.parametrize(("s", "lam"), [(2.0**-20, 1.0), (-(2.0**-20), 1.0), (-(2.0**-20), 0.0)])
def test_block_a_gap_that_should_be_closed_moves_the_answer(K: float, s: float, lam: float) -> None:
    """A closed contact with a gap s, or an overlap −s: the answer is off by |s| if λ* > 0."""
    bound = batched(diagonal(K), K, 1 / K)
    found = bound.bound(ZERO, ZERO, np.full((1, 1), s), ZERO, np.full((1, 1), lam))[0]
    assert abs(s) <= found <= 1.02 * abs(s)
    assert bound.bound(ZERO, ZERO, ZERO + 1, ZERO, ZERO)[0] < 1e-300


@pytest.mark.parametrize("lam", [1.0, 0.0])
def test_block_the_uncertainty_of_a_gap_counts(lam: float) -> None:
    bound, e = batched(diagonal(1.0), 1.0, 1.0), 2.0**-20
    found = bound.bound(ZERO, ZERO, ZERO, np.full((1, 1), e), np.full((1, 1), lam))[0]
    assert e <= found <= 1.02 * e


def test_block_nothing_is_divided_by_a_stiffness_of_zero() -> None:
    with np.errstate(divide="raise", invalid="raise"):
        for bound in (batched(diagonal(1.0), 0.0, 1.0), batched(diagonal(1.0), 1.0, 1.0, 0.0)):
            assert bound.bound(ZERO, ZERO, ZERO + 1, ZERO, ZERO)[0] == np.inf


def test_block_the_compliance_turns_energy_into_displacement() -> None:
    """Two springs, 1 and 100 N/mm, and the force is on the soft one."""
    made = diagonal(1.0, 100.0)
    found = batched(made, 1.0, 1.0).bound(
        array(1e-6, 0.0)[:, None], *np.zeros((1, 2, 1)), *np.ones((1, 2, 1)), *np.zeros((2, 2, 1))
    )
    assert 1e-6 <= found[0] <= 1.02e-6


def test_block_the_translation_is_measured_in_the_norm_of_K() -> None:
    """Both ends of a gap δ move, by δ/2 each: ‖z‖²_K = δ²/2, and √D ‖z‖_K = δ/√2."""
    made = diagonal(1.0, 1.0, A=[[1.0], [-1.0]])
    bound, delta = batched(made, 1.0, 1.0, 2.0), np.full((1, 1), 2.0**-20)
    found = bound._translation(delta, np.zeros(1))[0]
    assert found == pytest.approx(2.0**-20 / np.sqrt(2), rel=1e-6)


@pytest.mark.parametrize("sigma2", [1.0, 4.0])
def test_block_what_the_translation_misses_counts(sigma2: float) -> None:
    """With a factor of Q that is far too stiff z is almost zero, and all of δ is left to A(AᵀA)⁻¹."""
    a = np.sqrt(sigma2)
    made = diagonal(9.0, A=[[a]])
    bound = batched(made, 9.0, 1 / 9, sigma2)
    blunt = replace(bound, factor=bound.factor * 2.0**30)
    delta = np.full((1, 1), 2.0**-20)
    found = np.sqrt(1 / 9) * blunt._translation(delta, np.zeros(1))[0]
    assert found == pytest.approx(2.0**-20 / a, rel=1e-6)
    doubted = np.sqrt(1 / 9) * bound._translation(ZERO, delta[0])[0]
    assert doubted == pytest.approx(2.0**-20 / a, rel=1e-6)


def test_block_the_roundings_of_the_translation_count() -> None:
    """zᵀKz in float64 is off by γ_2n ‖K‖ ‖z‖², and δ − Aᵀz by γ(|δ| + |A|ᵀ|z|)."""
    K, n = 2.0**20, 3
    made = Assembly(Stiffness.of(np.asfortranarray(np.eye(n) * K)), sp.csc_array(np.eye(n)))
    bound, delta = batched(made, K, 1 / K), np.ones((n, 1))
    z = 1.0  # of each
    stiffer = replace(bound, stiffest=2.0**60 * K)  # so that the rounding dominates
    energy = gamma(2 * n) * 2.0**60 * K * n * z
    lost = gamma(3) * 2 * np.sqrt(n) * np.sqrt(2.0**60 * K)
    assert stiffer._translation(delta, np.zeros(1))[0] >= 0.99 * (np.sqrt(energy + K * n) + lost)
    assert stiffer._translation(delta, np.zeros(1))[0] <= 1.01 * (np.sqrt(energy + K * n) + lost)


def test_block_energies_that_underflow_count() -> None:
    """K = 1e-290: ‖z‖²_K of 1e-17 mm is below every number."""
    K, delta = 1e-290, np.full((1, 1), 1e-17)
    found = batched(diagonal(K), K, 1 / K).bound(ZERO, ZERO, delta, ZERO, ZERO + K)[0]
    assert 1e-17 <= found <= 1.02e-17
    force = batched(diagonal(K), K, 1 / K).bound(delta * K, ZERO, ZERO + 1, ZERO, ZERO)[0]
    assert 1e-17 <= force <= 1.02e-17


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_block_what_overflows_is_not_proven() -> None:
    bound = batched(diagonal(1.0), 1.0, 1.0)
    for bad in (np.nan, np.inf, 1e308):
        off = np.full((1, 1), bad)
        assert bound.bound(off, ZERO, ZERO + 1, ZERO, ZERO)[0] >= bad or np.isnan(bad)
        assert not np.isnan(bound.bound(off, ZERO, ZERO + 1, ZERO, ZERO)[0])
        assert not np.isnan(bound.bound(ZERO, ZERO, -off, ZERO, ZERO)[0])
    load = LoadCase(array(1.7e308), array(1.0))
    for lam in (1.0, 1.7e308):
        made = Prepared(diagonal(0.25))
        found = assess(Bound.of(made), [replace(load, p=made.dual_load(load))], [array(lam)], [None])[0]
        assert found.bound_mm == np.inf


def shed(stiffness: float, force: float, x: float | None = None) -> tuple[float, Fraction]:
    """Bound and exact error of an answer that presses an open contact with a force; no load, x* = 0."""
    prepared = Prepared(diagonal(stiffness))
    load = LoadCase(array(0.0), array(10.0))
    load = replace(load, p=prepared.dual_load(load))
    own = None if x is None else array(x)
    found = assess(Bound.of(prepared), [load], [array(force)], [own])[0]
    return found.bound_mm, abs(Fraction(float(found.x[0])))


@pytest.mark.parametrize("stiffness", [1.0, 3.0, 7e-290])
def test_block_what_is_shed_moves_the_answer(stiffness: float) -> None:
    for k in range(50):
        bound, error = shed(stiffness, (1 + k / 7) * stiffness)
        assert error <= Fraction(bound) <= error * Fraction(102, 100)


def test_block_the_rounding_of_what_was_moved_counts() -> None:
    """A solver's own x, far from k/3: the distance between them is itself rounded."""
    prepared = Prepared(diagonal(3.0))
    bound = Bound.of(prepared)
    for k in range(1, 60):
        load = LoadCase(array(float(k)), array(1e12))
        load = replace(load, p=prepared.dual_load(load))
        x = 1e9 * k / 7
        found = assess(bound, [load], [array(0.0)], [array(x)])[0]
        error = abs(Fraction(x) - Fraction(k, 3))
        assert error <= Fraction(found.bound_mm) <= error * Fraction(102, 100)


def test_block_the_rounding_of_the_answer_counts() -> None:
    """x = 1/3 in two parts is known to 1e-30; the sum of them is what is given out, half a unit off."""
    prepared = Prepared(diagonal(3.0))
    load = LoadCase(array(1.0), array(10.0))
    load = replace(load, p=prepared.dual_load(load))
    found = assess(Bound.of(prepared), [load], [array(0.0)], [None])[0]
    eps = np.finfo(float).eps
    assert abs(Fraction(float(found.x[0])) - Fraction(1, 3)) > 0
    assert eps / 3 <= found.bound_mm <= 10 * eps


def test_block_the_products_of_a_residual_count() -> None:
    """f − Aλ, Kd and the tail: each is bounded by the theorem's figure at least."""
    n, rng = 20, np.random.default_rng(0)
    B = rng.standard_normal((n, n))
    K = np.asfortranarray(B @ B.T + np.eye(n))
    made = Assembly(Stiffness.of(K), sp.csc_array(np.eye(n)))
    f, lam = 1e6 * rng.standard_normal((n, 1)), 1e6 * rng.random((n, 1))
    zero = split(made, np.zeros((n, 1)))
    _, error = residual(made, f, zero, lam)
    assert (error >= gamma(6) * (abs(f) + lam)).all()
    x, d = split(made, rng.standard_normal((n, 1))), rng.standard_normal((n, 1))
    stiffest = float(abs(K).sum(axis=0).max())
    r, error = np.zeros((2, n, 1))
    there, _, after = refined(made, x, r, error, d, stiffest)
    Kd = abs(K @ d)
    doubt = stiffest * (gamma(n) * abs(d).max() + gamma(1) * abs(there.tail).max()) + gamma(1) * Kd
    assert (after >= doubt).all()
    assert (refined(made, x, r, error + 1.0, d, stiffest)[2] >= 1 + doubt).all()
    tail = Split(np.zeros((n, 1)), d)
    _, error = residual(made, np.zeros((n, 1)), tail, np.zeros((n, 1)))
    assert (error >= gamma(n) * abs(K).sum(axis=1, keepdims=True) * abs(d).max()).all()


def test_block_gaps_are_in_doubt_by_their_terms() -> None:
    made = diagonal(1.0, A=[[0.7]])
    x = Split(np.full((1, 1), 3.0), np.full((1, 1), 2.0))
    _, error = batched_gaps(made, np.full((1, 1), 3.5), x)
    assert error[0, 0] >= gamma(5) * (3.5 + 0.7 * 5)


def test_block_products_that_underflow_count() -> None:
    made = diagonal(1e-170, A=[[1e-170]])
    tiny = np.full((1, 1), 1e-155)
    exact = Fraction(1e-170) * Fraction(1e-155)
    at, nothing = Split(tiny, ZERO), Split(ZERO, ZERO)
    assert batched_gaps(made, ZERO, at)[1][0, 0] >= exact
    assert residual(made, ZERO, nothing, tiny)[1][0, 0] >= exact
    assert residual(made, ZERO, at, ZERO)[1][0, 0] >= exact
    assert refined(made, nothing, ZERO, ZERO, tiny, 1e-170)[2][0, 0] >= exact


def test_compliance_the_backward_error_of_the_factor_counts() -> None:
    """(K⁻¹)_ii ≤ (1 + c/κ) (UᵀU)⁻¹_ii, c/κ one hundredth here and then one."""
    K = np.diag(array(1.0, 2.0**40))
    prepared = Prepared(Assembly(Stiffness.of(np.asfortranarray(K)), sp.csc_array(np.eye(2))))
    trace, each = float(np.trace(K)), gamma(6)
    for share in (0.01, 1.0, 100.0):
        kappa = each * trace / share
        assert largest_compliance(prepared, kappa) >= 1 + share
        assert largest_compliance(prepared, kappa) <= 1.02 * (1 + 1.02 * share)


def test_compliance_the_error_of_the_inverse_counts() -> None:
    """ε ‖X‖_F is what any row of X may be off by: 9 % of 1 here."""
    K = np.diag(array(1.0, 2.0**94))
    prepared = Prepared(Assembly(Stiffness.of(np.asfortranarray(K)), sp.csc_array(np.eye(2))))
    epsilon = gamma(6) * 2.0**47
    assert 1.0099 * (1 + epsilon) ** 2 <= largest_compliance(prepared, 1e30) <= 1.05 * (1 + epsilon) ** 2
    hopeless = Prepared(Assembly(Stiffness.of(np.diag(array(1.0, 2.0**110))), sp.csc_array(np.eye(2))))
    assert largest_compliance(hopeless, 1e30) == np.inf


def test_compliance_is_the_square_of_a_row() -> None:
    assert 4.0 <= largest_compliance(Prepared(diagonal(0.25)), 0.25) <= 4.2


def test_block_many_products_that_underflow_count() -> None:
    """Twenty forces in a row, each product just below η/2."""
    made = diagonal(1.0, A=[[2.0**-537] * 20])
    lam = np.full((20, 1), 0.98 * 2.0**-538)
    exact = 20 * Fraction(2.0**-537) * Fraction(0.98 * 2.0**-538)
    assert Fraction(float(residual(made, ZERO, Split(ZERO, ZERO), lam)[1][0, 0])) >= exact


def test_independence_counts_the_rounding_of_its_products() -> None:
    a = np.array([[0.1, 0.3], [0.7, 0.9], [0.2, 0.4]])
    G = [[sum(Fraction(p) * Fraction(q) for p, q in zip(u, v, strict=True)) for v in a.T] for u in a.T]
    found = independence(Assembly(Stiffness.of(np.eye(3)), sp.csc_array(a)))
    sigma2 = Fraction(found)
    assert (G[0][0] - sigma2) * (G[1][1] - sigma2) >= G[0][1] ** 2
    for k in range(1, 100):
        single = independence(Assembly(Stiffness.of(np.eye(1)), sp.csc_array([[k / 7]])))
        assert Fraction(single) <= Fraction(k / 7) ** 2 <= Fraction(single) * (1 + Fraction(1, 10**15))


def test_block_many_products_with_K_that_underflow_count() -> None:
    n = 12
    made = Assembly(Stiffness.of(np.full((n, n), 2.0**-537)), sp.csc_array((n, 0)))
    x = Split(np.full((n, 1), 0.98 * 2.0**-538), np.zeros((n, 1)))
    exact = n * Fraction(2.0**-537) * Fraction(0.98 * 2.0**-538)
    _, error = residual(made, np.zeros((n, 1)), x, np.zeros((0, 1)))
    assert Fraction(float(error[0, 0])) >= exact


@pytest.mark.parametrize("near", [0.0, 1.0])
def test_block_the_bound_near_by_and_the_rounding_of_the_sum_count(
    near: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """x = 1/3 as the sum of two parts is rounded, however near to x* the parts are."""
    monkeypatch.setattr(Bound, "bound", lambda *_: array(near))
    prepared = Prepared(diagonal(3.0))
    load = LoadCase(array(1.0), array(10.0))
    load = replace(load, p=prepared.dual_load(load))
    found = assess(Bound.of(prepared), [load], [array(0.0)], [None])[0]
    rounding = abs(Fraction(float(found.x[0])) - Fraction(1, 3))
    assert 0 < rounding <= Fraction(found.bound_mm)
    assert found.bound_mm >= near
