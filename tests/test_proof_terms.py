"""Each term of each bound where it dominates: the bound is nearly the error, so that nothing can be left out.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification import certificate, definite
from harness.verification.batched.assess import assess
from harness.verification.batched.bound import Bound, independence
from harness.verification.batched.bound import gaps as batched_gaps
from harness.verification.batched.compliance import largest_compliance
from harness.verification.batched.residual import Split, refined, residual, split
from harness.verification.certificate import certify
from harness.verification.definite import smallest_eigenvalue
from harness.verification.exact_residual import (
    ETA,
    DoubleDouble,
    Enclosure,
    ErrorFreeSum,
    U,
    forces,
    gamma,
    gaps,
)
from harness.verification.judge import REFERENCE_SHARE, judge
from harness.verification.length import length
from harness.verification.reference import Reference, refined_active_set
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from solvers.kkt import EPS, kkt_status


def array(*values: float) -> np.ndarray:
    return np.array(values, dtype=float)


def doubled(hi: np.ndarray, lo: np.ndarray | None = None) -> DoubleDouble:
    return DoubleDouble(hi, np.zeros_like(hi) if lo is None else lo)


def diagonal(*stiffness: float, A: list[list[float]] | None = None) -> Assembly:
    """Independent springs, N/mm; each against a rigid tool unless A says otherwise."""
    K = np.asfortranarray(np.diag(array(*stiffness)))
    return Assembly((K,), sp.csc_array(np.eye(len(K)) if A is None else array(*A).reshape(len(K), -1)))


def bound_of(
    assembly: Assembly, f: float, g: float, x: DoubleDouble, lam: DoubleDouble, kappa: float
) -> float:
    load = LoadCase(array(*[f] * assembly.n), array(*[g] * assembly.m))
    return certify(assembly, load, x, lam, np.zeros(assembly.m, dtype=bool), kappa).bound_mm


# The certificate


@pytest.mark.parametrize("kappa", [1 / 16, 1.0, 16.0])
def test_certificate_a_residual_is_an_error_of_its_size_over_the_stiffness(kappa: float) -> None:
    """Without contact, e = −r/κ."""
    for n in (1, 4):  # four equal errors: the bound is on ‖e‖₂ = 2e
        made, e = diagonal(*[kappa] * n), 2.0**-20
        bound = bound_of(made, kappa, 10.0, doubled(np.ones(n) + e), doubled(np.zeros(n)), kappa)
        assert e * np.sqrt(n) <= bound <= 1.001 * e * np.sqrt(n)


@pytest.mark.parametrize("kappa", [1 / 16, 1.0, 16.0])
def test_certificate_slack_times_force_is_the_squared_error(kappa: float) -> None:
    """x* = g and λ* = 0; at x = g − e, λ = κe, nothing is out of balance and sᵀλ = κe²."""
    e = 2.0**-20
    bound = bound_of(diagonal(kappa), kappa, 1.0, doubled(array(1 - e)), doubled(array(kappa * e)), kappa)
    assert e <= bound <= 1.001 * e


def test_certificate_both_parts_of_a_force_count() -> None:
    """The same with λ = hi + lo in equal parts."""
    e, half = 2.0**-20, array(2.0**-21)
    bound = bound_of(diagonal(1.0), 1.0, 1.0, doubled(array(1 - e)), doubled(half, half), 1.0)
    assert e <= bound <= 1.001 * e


def test_certificate_the_rounding_of_the_answer_counts() -> None:
    """x* = 1/3: nothing but the rounding of x.hi is wrong."""
    hi = 1.0 / 3.0
    lo = float(Fraction(1, 3) - Fraction(hi))
    bound = bound_of(diagonal(3.0), 1.0, 10.0, doubled(array(hi), array(lo)), doubled(array(0.0)), 3.0)
    error = abs(Fraction(1, 3) - Fraction(hi))
    assert error <= Fraction(bound) <= error * Fraction(1001, 1000)


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_certificate_the_uncertainty_of_a_residual_counts(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A residual of which only a share is known by value."""
    e = 2.0**-20
    monkeypatch.setattr(
        certificate, "forces", lambda *_: Enclosure(array(-share * e), array((1 - share) * e))
    )
    bound = bound_of(diagonal(1.0), 1.0, 10.0, doubled(array(1 + e)), doubled(array(0.0)), 1.0)
    assert e <= bound <= 1.001 * e


def test_certificate_the_uncertainty_of_a_gap_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    e = 2.0**-20
    monkeypatch.setattr(certificate, "gaps", lambda *_: Enclosure(array(e / 2), array(e / 2)))
    bound = bound_of(diagonal(1.0), 1.0, 1.0, doubled(array(1 - e)), doubled(array(e)), 1.0)
    assert e <= bound <= 1.001 * e


def test_certificate_a_gap_that_may_be_negative_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certificate, "gaps", lambda *_: Enclosure(array(1e-3), array(2e-3)))
    assert bound_of(diagonal(1.0), 1.0, 10.0, doubled(array(1.0)), doubled(array(0.0)), 1.0) == np.inf


def test_certificate_nothing_is_divided_by_a_stiffness_of_zero() -> None:
    with np.errstate(divide="raise"):
        assert bound_of(diagonal(1.0), 1.0, 10.0, doubled(array(1.0)), doubled(array(0.0)), 0.0) == np.inf


def test_certificate_a_gap_that_is_not_a_number_is_not_feasible(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certificate, "gaps", lambda *_: Enclosure(array(np.nan), array(0.0)))
    closed = np.zeros(1, dtype=bool)
    *_, feasible = certificate._repaired(diagonal(1.0), array(1.0), doubled(array(0.0)), closed)
    assert not feasible


def test_certificate_a_force_is_proven_by_what_both_uncertainties_leave() -> None:
    """λ* = 0.5 − 2⁻¹⁰; the certificate grants it ±(‖K_i‖ ‖e‖ + |r_i|), and each is |r| here: 1.01 · 2|r|."""
    for r, proven in ((0.24, True), (0.26, False)):
        made, x = diagonal(1.0), doubled(array(1.0))
        load = LoadCase(array(1.5 + r), array(1.0))
        found = certify(made, load, x, doubled(array(0.5)), np.ones(1, dtype=bool), 1.0)
        assert found.closed[0] == proven


def test_certificate_a_gap_is_proven_open_beyond_the_error_at_its_normal() -> None:
    """A = (1, −1): |s − s*| ≤ √2 ‖e‖."""
    made = diagonal(1.0, 1.0, A=[[1.0], [-1.0]])
    for gap, proven in ((1.45, True), (1.40, False)):
        load = LoadCase(array(1.0, 0.0), array(gap))
        found = certify(made, load, doubled(np.zeros(2)), doubled(array(0.0)), np.zeros(1, dtype=bool), 1.0)
        assert found.bound_mm == pytest.approx(1.0)
        assert found.open[0] == proven


def test_certificate_what_overflows_is_not_proven() -> None:
    found = refined_active_set(Prepared(diagonal(1.0, 4.0)), LoadCase(array(1.7e308, -1.7e308), np.ones(2)))
    assert found.bound_mm == np.inf or np.isfinite(found.x).all()
    for x in (1.6e308, np.inf, np.nan):
        for bad in (doubled(array(x)), doubled(array(0.0), array(x))):
            assert bound_of(diagonal(4.0), 1.7e308, 1.0, bad, doubled(array(0.0)), 1.0) == np.inf


# Nearly exact residuals


def test_residual_the_rounding_of_the_sum_counts() -> None:
    """1 + 2⁻⁵³(1 − 2⁻⁵⁰) is 1, with nearly u lost."""
    total = ErrorFreeSum(1)
    total.add(array(1.0))
    total.add(array(2.0**-53 * (1 - 2.0**-50)))
    found = total.enclosed()
    lost = abs(Fraction(1) + Fraction(2.0**-53 * (1 - 2.0**-50)) - Fraction(float(found.value[0])))
    assert lost > 0
    assert lost <= Fraction(float(found.error[0])) <= lost * 2


def test_residual_the_rounding_of_the_roundings_counts() -> None:
    """The terms cancel but for 2⁻¹⁰⁸, which is lost beside 2⁻⁵⁴."""
    total, terms = ErrorFreeSum(1), [1.0, 2.0**-54, 2.0**-108, -1.0, -(2.0**-54)]
    for term in terms:
        total.add(array(term))
    found, exact = total.enclosed(), sum(map(Fraction, terms))
    assert found.value[0] == 0.0
    assert exact == Fraction(2.0**-108)
    size = sum(abs(Fraction(term)) for term in terms)
    # Ogita, Rump and Oishi, proposition 4.5
    assert Fraction(float(found.error[0])) >= Fraction(gamma(len(terms))) ** 2 * size > exact


def test_residual_the_uncertainty_of_its_terms_counts() -> None:
    total = ErrorFreeSum(1)
    total.error[:] = 3.0
    assert total.enclosed().error[0] >= 3.0


def exactly(made: Assembly, f: np.ndarray, x: DoubleDouble, lam: np.ndarray) -> list[Fraction]:
    K, A = made.blocks[0], made.A.toarray()
    whole = [Fraction(float(a)) + Fraction(float(b)) for a, b in zip(x.hi, x.lo, strict=True)]
    return [
        Fraction(float(f[i]))
        - sum(Fraction(float(k)) * v for k, v in zip(K[i], whole, strict=True))
        - sum(Fraction(float(a)) * Fraction(float(v)) for a, v in zip(A[i], lam, strict=True))
        for i in range(made.n)
    ]


def violations(found: Enclosure, exact: list[Fraction]) -> int:
    pairs = zip(found.value, found.error, exact, strict=True)
    return sum(abs(Fraction(float(v)) - e) > Fraction(float(err)) for v, err, e in pairs)


@pytest.mark.parametrize("seed", range(3))
def test_residual_a_plain_product_is_in_doubt_by_the_size_of_its_terms(seed: int) -> None:
    """All of x in its lower half, where K times it cancels: no float64 product of K and x.lo is exact."""
    rng, n = np.random.default_rng(seed), 24
    B = rng.standard_normal((n, n))
    x = rng.standard_normal(n)
    S = B + B.T
    S -= (
        np.outer(S @ x, x) / (x @ x)
        + np.outer(x, S @ x) / (x @ x)
        - (x @ S @ x) / (x @ x) ** 2 * np.outer(x, x)
    )
    made = Assembly((np.asfortranarray((S + S.T) / 2),), sp.csc_array((n, 1)))
    at = DoubleDouble(np.zeros(n), x)
    found = forces(made, np.zeros(n), at, doubled(np.zeros(1)))
    assert violations(found, exactly(made, np.zeros(n), at, np.zeros(1))) == 0
    least = gamma(n) * abs(made.blocks[0]).max(axis=1) * abs(x).sum()
    assert (found.error >= least).all()
    assert abs(found.value).max() < 1e-14


@pytest.mark.parametrize("seed", range(3))
def test_residual_what_the_slices_of_K_leave_is_in_doubt(seed: int) -> None:
    """A row whose first entry is 1, at x = 0, and whose others are below the last bit of its slices."""
    rng, n = np.random.default_rng(seed), 16
    r = rng.standard_normal(n) * 2.0**-60
    K = np.zeros((n, n), order="F")
    K[0, :], K[:, 0], K[0, 0] = r, r, 1.0
    x = np.round(rng.standard_normal(n) * 2**20)
    x[0] = 0.0
    x[-1] = -(r[1:-1] @ x[1:-1]) / r[-1]
    made = Assembly((K,), sp.csc_array((n, 1)))
    found = forces(made, np.zeros(n), doubled(x), doubled(np.zeros(1)))
    exact = exactly(made, np.zeros(n), doubled(x), np.zeros(1))
    assert violations(found, exact) == 0
    assert abs(exact[0]) > Fraction(U * abs(float(found.value[0])))
    bits = (53 - int(np.ceil(np.log2(n)))) // 2 + 1
    assert found.error[0] >= gamma(n) * 2.0 ** (-2 * bits) * abs(x).sum()


def test_residual_products_that_underflow_count() -> None:
    """AᵀK⁻¹… of 1e-170: every product is zero in float64, and none of them is."""
    tiny = 1e-170
    sparse = diagonal(0.0, A=[[tiny]])
    found = forces(sparse, array(0.0), doubled(array(0.0)), doubled(array(1e-155)))
    exact = Fraction(tiny) * Fraction(1e-155)
    assert found.value[0] == 0.0
    assert 0 < exact <= Fraction(float(found.error[0])) <= 40 * Fraction(ETA)
    assert gaps(sparse, array(0.0), doubled(array(1e-155))).error[0] >= exact
    dense = forces(diagonal(tiny), array(0.0), doubled(array(1e-155)), doubled(array(0.0)))
    assert exact <= Fraction(float(dense.error[0]))
    nothing = forces(diagonal(tiny), array(0.0), doubled(array(0.0)), doubled(array(0.0)))
    assert nothing.error[0] == 0.0


@pytest.mark.parametrize("scale", [1e-300, 1e-308, 1e-311, 1e-320])
def test_residual_of_the_smallest_numbers_is_enclosed(scale: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        B = rng.standard_normal((5, 5))
        made = Assembly((np.asfortranarray((B + B.T) * scale),), sp.csc_array(np.eye(5) * 0.7))
        x = DoubleDouble(rng.standard_normal(5), 1e-17 * rng.standard_normal(5))
        lam, f = scale * rng.random(5), scale * rng.standard_normal(5)
        found = forces(made, f, x, doubled(lam))
        assert violations(found, exactly(made, f, x, lam)) == 0


@pytest.mark.parametrize("scale", [1e-200, 1e-300, 1e-311])
def test_a_stiffness_near_the_end_of_the_numbers_is_bounded_or_refused(scale: float) -> None:
    """A residual of 1e-200 N over a stiffness of 1e-200 N/mm: its square underflows, the error is 1 mm."""
    e, K = 0.25, 1.5 * scale
    made = diagonal(K)
    bound = bound_of(made, K, 10.0, doubled(array(1 + e)), doubled(array(0.0)), 1.5 * scale)
    assert bound >= e
    kappa = smallest_eigenvalue(made.blocks[0], K)
    assert kappa == 0.0 if scale < 1e-305 else 0.8 * K <= kappa <= K
    found = bound_of(made, K, 10.0, doubled(array(1.0)), doubled(array(0.0)), kappa)
    assert found == np.inf if kappa == 0 else found < 1e-10


def test_slack_that_underflows_counts() -> None:
    """The error is e, and sᵀλ = κe² is below every number."""
    e, g, K = 2.0**-60, 2.0**-50, 2.0**-1000
    bound = bound_of(diagonal(K), K * g, g, doubled(array(g - e)), doubled(array(K * e)), K)
    assert bound >= e


def test_length_neither_under_nor_overflows() -> None:
    for scale in (2.0**-1070, 2.0**-600, 1.0, 2.0**600):
        v = array(3.0, 4.0) * scale
        assert 5 * scale <= length(v) <= 5 * scale * (1 + 1e-15) + ETA
        np.testing.assert_array_equal(length(np.column_stack([v, 0 * v])), [length(v), 0.0])
    assert not np.isfinite(length(array(np.nan))).any()
    assert not np.isfinite(length(array(np.inf))).any()


# The smallest eigenvalue


@pytest.mark.parametrize("n", [1, 2, 5, 40])
@pytest.mark.parametrize("c", [1e-10, 1e-6])
def test_definite_the_margin_is_that_of_the_theorem(n: int, c: float) -> None:
    """K = 11ᵀ + cI: |R|ᵀ|R| = B, and ‖B‖₂ = n."""
    K = np.ones((n, n)) + c * np.eye(n)
    s = Fraction(definite.SHARES[0] * c)
    margin = s - Fraction(smallest_eigenvalue(K, c))
    theorem = Fraction(gamma(2 * (n + 1))) * n + Fraction(U)
    assert Fraction(1009, 1000) <= margin / theorem <= Fraction(1013, 1000)


def test_definite_a_matrix_that_completes_by_rounding_is_not_taken_for_definite() -> None:
    """λmin = c exactly, s just above it, and the factorisation of the indefinite K − sI completes."""
    completed = 0
    for seed in range(60):
        v = np.random.default_rng(seed).integers(2**19, 2**20, 2).astype(float)
        c = 2.0**-13  # below a rounding of the entries of vvᵀ, up to 2⁴⁰
        K = np.outer(v, v) + c * np.eye(2)
        s = 1.01 * c
        try:
            np.linalg.cholesky(K - s * np.eye(2))
        except np.linalg.LinAlgError:
            continue
        completed += 1
        assert smallest_eigenvalue(K, s / definite.SHARES[0]) <= c
    assert completed > 5


def test_definite_the_rounding_of_the_difference_counts() -> None:
    """n = 1, K = 1: s − margin is rounded by up to us."""
    s = definite.SHARES[0]
    margin = Fraction(s) - Fraction(smallest_eigenvalue(np.ones((1, 1)), 1.0))
    largest = Fraction(1.0 - s)
    assert margin >= Fraction(gamma(4)) * largest + Fraction(U) * largest + Fraction(U) * Fraction(s) / 2


@pytest.mark.parametrize("exponent", [-990, -500, 500, 1000])
def test_definite_in_any_unit(exponent: int) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    usual, scaled = smallest_eigenvalue(K, 1.0), smallest_eigenvalue(np.ldexp(K, exponent), 2.0**exponent)
    assert scaled == np.ldexp(usual, exponent)
    assert smallest_eigenvalue(np.ldexp(K, -1040), 2.0**-1040) == 0.0


# Many load cases at a time


def batched(made: Assembly, kappa: float, compliance: float, sigma2: float = 1.0) -> Bound:
    """A bound with the exact constants, so that nothing but its formula is tested."""
    prepared = Prepared(made)
    stiffest = float(abs(made.blocks[0]).sum(axis=0).max())
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
    made = Assembly((np.asfortranarray(np.eye(n) * K),), sp.csc_array(np.eye(n)))
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
    made = Assembly((K,), sp.csc_array(np.eye(n)))
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
    prepared = Prepared(Assembly((np.asfortranarray(K),), sp.csc_array(np.eye(2))))
    trace, each = float(np.trace(K)), gamma(6)
    for share in (0.01, 1.0, 100.0):
        kappa = each * trace / share
        assert largest_compliance(prepared, kappa) >= 1 + share
        assert largest_compliance(prepared, kappa) <= 1.02 * (1 + 1.02 * share)


def test_compliance_the_error_of_the_inverse_counts() -> None:
    """ε ‖X‖_F is what any row of X may be off by."""
    K = np.diag(array(1.0, 2.0**66))
    prepared = Prepared(Assembly((np.asfortranarray(K),), sp.csc_array(np.eye(2))))
    epsilon = gamma(6) * 2.0**33
    assert largest_compliance(prepared, 1e30) >= (1 + epsilon) ** 2 > 1 + 1e-6
    hopeless = Prepared(Assembly((np.diag(array(1.0, 2.0**110)),), sp.csc_array(np.eye(2))))
    assert largest_compliance(hopeless, 1e30) == np.inf


def test_independence_counts_the_rounding_of_its_products() -> None:
    a = np.array([[0.1, 0.3], [0.7, 0.9], [0.2, 0.4]])
    G = [[sum(Fraction(p) * Fraction(q) for p, q in zip(u, v, strict=True)) for v in a.T] for u in a.T]
    found = independence(Assembly((np.eye(3),), sp.csc_array(a)))
    sigma2 = Fraction(found)
    assert (G[0][0] - sigma2) * (G[1][1] - sigma2) >= G[0][1] ** 2
    for k in range(1, 100):
        single = independence(Assembly((np.eye(1),), sp.csc_array([[k / 7]])))
        assert Fraction(single) <= Fraction(k / 7) ** 2 <= Fraction(single) * (1 + Fraction(1, 10**15))


# The judge and the KKT check


@pytest.mark.parametrize(("bound", "verdict"), [(0.999e-8, "within"), (1.001e-8, "cannot_be_judged")])
def test_judge_a_reference_may_be_off_by_a_tenth_of_the_limit(bound: float, verdict: str) -> None:
    prepared, load = Prepared(diagonal(1.0)), LoadCase(array(1.0), array(10.0))
    known = Reference(array(1.0), array(0.0), np.zeros(1, dtype=bool), bound, "by hand")
    assert judge(prepared, load, known, array(1.0), array(0.0), 1e-7).verdict == verdict
    assert REFERENCE_SHARE == 0.1


@pytest.mark.parametrize(
    ("lam", "y", "residual_mm"),
    [
        ([0.0, 0.0], [-1e-3, 5.0], 1e-3),  # an overlap of an open contact
        ([2.0, 0.0], [1e-3, 5.0], 1e-3),  # a gap of a closed one
        ([2.0, 0.0], [-2e-3, -1e-3], 2e-3),
        ([0.0, 3.0], [7.0, -1e-12], 1e-12),
    ],
)
def test_kkt_residual_is_overlap_or_gap_of_a_closed_contact(
    lam: list[float], y: list[float], residual_mm: float
) -> None:
    Q, p = np.eye(2), array(1.0, 1.0)
    for tolerance, status in ((1.01 * residual_mm, "solved"), (0.99 * residual_mm, "inaccurate")):
        found = kkt_status(Q, p, array(*lam), array(*y), tolerance)
        assert found == (status, residual_mm)


def test_kkt_residual_within_rounding_is_solved() -> None:
    """4ε max(|p| + |Q|λ), where |p| = |Q|λ = 1e6: half of it is due to each."""
    Q, p, lam = np.eye(1) * 1e3, array(1e6), array(1e3)
    for share, status in ((0.99, "solved"), (1.01, "inaccurate")):
        y = array(share * 4 * EPS * 2e6)
        assert kkt_status(Q, p, lam, y, 0.0)[0] == status
