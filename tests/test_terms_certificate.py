"""Terms of the certificate, each where it dominates.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from springs import array, bound_of, diagonal, doubled

from harness.verification import certificate
from harness.verification.certificate import certify
from harness.verification.exact_residual import (
    Enclosure,
)
from harness.verification.reference import refined_active_set
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared


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


def test_certificate_a_pulling_force_makes_up_for_nothing() -> None:
    """sᵀλ = 2·2 at the first contact, where the error is 2; −4·0.999 at the second must not be taken off."""
    load = LoadCase(array(10.0, 5.001), array(10.0, 10.0))
    x, lam, closed = doubled(array(8.0, 6.0)), doubled(array(2.0, -0.999)), np.zeros(2, dtype=bool)
    assert certify(diagonal(1.0, 1.0), load, x, lam, closed, 1.0).bound_mm >= np.hypot(2.0, 0.999)


def test_certificate_a_residual_that_overflows_proves_nothing() -> None:
    """The contact is at the other spring: its gap is known."""
    made = diagonal(4.0, 1.0, A=[[0.0], [1.0]])
    assert bound_of(made, 1.0, 1.0, doubled(array(1.6e308, 0.0)), doubled(array(0.0)), 1.0) == np.inf


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
