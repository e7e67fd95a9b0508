"""Terms of nearly exact residuals, and norms of them, each where it dominates.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp
from lambda_min import proven
from springs import array, bound_of, diagonal, doubled

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
from harness.verification.length import length
from problems.forms.assembly import Assembly
from problems.stiffness.operator import Stiffness


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


def test_residual_the_terms_of_a_sparse_product_are_counted() -> None:
    """Rows of n ones of alternating signs in each of two blocks, behind one of A: all sums are zero."""
    n = 64
    sign = (-1.0) ** np.arange(n)
    K = sp.csc_array(np.outer(sign, sign))
    A = sp.csc_array(np.ones((2 * n, 2)) * [1.0, -1.0])
    made = Assembly(Stiffness.of(K, K), A)
    for low, parts in ((0.0, 1), (2.0**-60, 2)):
        at = DoubleDouble(np.ones(2 * n), np.full(2 * n, low))
        found = forces(made, np.zeros(2 * n), at, doubled(np.ones(2)))
        assert not found.value.any()
        assert (found.error >= gamma(2 * (parts * n + 2)) ** 2 * (n + 2)).all()
        assert (found.error <= 4 * gamma(2 * (2 * parts * n + 2)) ** 2 * (n + 2)).all()


def exactly(made: Assembly, f: np.ndarray, x: DoubleDouble, lam: np.ndarray) -> list[Fraction]:
    K, A = made.K.matrices[0], made.A.toarray()
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
    made = Assembly(Stiffness.of(np.asfortranarray((S + S.T) / 2)), sp.csc_array((n, 1)))
    at = DoubleDouble(np.zeros(n), x)
    found = forces(made, np.zeros(n), at, doubled(np.zeros(1)))
    assert violations(found, exactly(made, np.zeros(n), at, np.zeros(1))) == 0
    least = gamma(n) * abs(made.K.matrices[0]).max(axis=1) * abs(x).sum()
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
    made = Assembly(Stiffness.of(K), sp.csc_array((n, 1)))
    found = forces(made, np.zeros(n), doubled(x), doubled(np.zeros(1)))
    exact = exactly(made, np.zeros(n), doubled(x), np.zeros(1))
    assert violations(found, exact) == 0
    assert abs(exact[0]) > Fraction(U * abs(float(found.value[0])))
    bits = (53 - int(np.ceil(np.log2(n)))) // 2 + 1
    assert found.error[0] >= gamma(n) * 2.0 ** (1 - 2 * bits) * abs(x).sum()  # 1 < 2¹


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


@pytest.mark.parametrize("seed", range(3))
def test_residual_a_bound_does_not_underflow_before_it_is_multiplied(seed: int) -> None:
    """K near 2⁻¹⁰⁶⁰: u times it is no number, but u times it times x of 2⁴⁵⁰ is."""
    rng, n = np.random.default_rng(seed), 24
    B = rng.standard_normal((n, n))
    made = Assembly(Stiffness.of(np.asfortranarray(np.ldexp(B + B.T, -1060))), sp.csc_array((n, 1)))
    at = DoubleDouble(np.zeros(n), np.ldexp(rng.standard_normal(n), 450))
    found = forces(made, np.zeros(n), at, doubled(np.zeros(1)))
    assert violations(found, exactly(made, np.zeros(n), at, np.zeros(1))) == 0


@pytest.mark.parametrize("scale", [1e-300, 1e-308, 1e-311, 1e-320])
def test_residual_of_the_smallest_numbers_is_enclosed(scale: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        B = rng.standard_normal((5, 5))
        made = Assembly(Stiffness.of(np.asfortranarray((B + B.T) * scale)), sp.csc_array(np.eye(5) * 0.7))
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
    kappa = proven(made.K.matrices[0], 0.9 * K)
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
    assert length(array(ETA, ETA)) >= 2 * ETA  # √2 η is no number
    assert not np.isfinite(length(array(np.nan))).any()
    assert not np.isfinite(length(array(np.inf))).any()
