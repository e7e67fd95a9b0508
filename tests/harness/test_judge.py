"""The judge's figures on a problem solved by hand.

Two springs of 2 N/mm, pushed together by f = (3, −1) N with a gap of 0.5 mm between them: free they
would move 1.5 and −0.5 mm and overlap by 1.5; λ = 1.5 N holds them at x = (0.75, 0.25).
"""

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification.judge import Judgement, Reference, conditioned_limit, judge
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness

X, LAM = np.array([0.75, 0.25]), np.array([1.5])


def judged(x: np.ndarray, lam: np.ndarray, bound_mm: float = 1e-15) -> Judgement:
    springs = (np.array([[2.0]]), np.array([[2.0]]))
    assembly = Assembly(Stiffness.of(*springs), sp.csc_array([[1.0], [-1.0]]))
    prepared = Prepared(assembly)
    load = LoadCase(np.array([3.0, -1.0]), np.array([0.5]))
    reference = Reference(X, LAM, np.array([True]), bound_mm, "by hand")
    return judge(prepared, load, reference, np.asarray(x), np.asarray(lam), 1e-7)


def test_the_exact_answer() -> None:
    # The objective: ½ 2 (0.75² + 0.25²) − (3 · 0.75 − 0.25).
    assert judged(X, LAM) == Judgement("within", 1e-15, 0.0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.375)


def test_an_answer_without_contact() -> None:
    judgement = judged(np.array([1.5, -0.5]), np.array([0.0]))
    assert judgement.verdict == "outside"
    assert judgement.displacement_error_mm == 0.75
    assert judgement.min_gap_mm == -1.5
    assert judgement.primal_residual == 1.5
    assert judgement.dual_residual == 0.0
    assert judgement.duality_gap == 0.0  # xᵀKx − fᵀx = 5 − 5
    assert judgement.contact_mismatch == 0  # overlapping is closed
    # F = 2·1.5 + 3 + 1·0 = 6 N and G = 2·1.5 + 0.5 = 3.5 mm: the overlap of 1.5 mm is what is left.
    assert judgement.backward_error == pytest.approx(1.5 / 3.5)


def test_an_answer_that_stays_open_with_a_pulling_force() -> None:
    judgement = judged(np.array([0.7, 0.3]), np.array([-0.25]))
    assert judgement.contact_mismatch == 1
    assert judgement.min_gap_mm == pytest.approx(0.1)
    assert judgement.primal_residual == 0.0
    assert judgement.dual_residual == pytest.approx(1.85)  # |1.4 − 3 − 0.25|, above max(0, −λ) = 0.25
    assert judgement.duality_gap == pytest.approx(abs(2 * 0.58 - 1.8 - 0.125))
    # F = 2·0.7 + 3 + 1·0.25 = 4.65 N: 1.85 N are out of balance.
    assert judgement.backward_error == pytest.approx(1.85 / 4.65)


def test_a_pulling_force_in_balance_is_a_residual() -> None:
    """λ = −0.25 N, x = K⁻¹(f − Aλ)."""
    found = judged(np.array([1.625, -0.625]), np.array([-0.25]))
    assert found.dual_residual == 0.25


@pytest.mark.parametrize(("gap", "moved", "mismatch"), [(1.5e-7, 0.9e-7, 0), (2.5e-7, 1.6e-7, 1)])
def test_a_gap_below_twice_the_limit_may_be_closed(gap: float, moved: float, mismatch: int) -> None:
    """A spring of 1 N/mm before a tool, at rest in the reference; the answer moves it to below the limit."""
    prepared = Prepared(Assembly(Stiffness.of(np.eye(1)), sp.csc_array([[1.0]])))
    load = LoadCase(np.zeros(1), np.array([gap]))
    reference = Reference(np.zeros(1), np.zeros(1), np.array([False]), 1e-15, "by hand")
    found = judge(prepared, load, reference, np.array([moved]), np.zeros(1), 1e-7)
    assert found.contact_mismatch == mismatch


@pytest.mark.parametrize(("shift", "verdict"), [(0.9e-7, "within"), (2e-7, "outside")])
def test_the_limit(shift: float, verdict: str) -> None:
    found = judged(X - np.array([0.0, shift]), LAM)
    assert (found.verdict, found.displacement_error_mm) == (verdict, pytest.approx(shift))


@pytest.mark.parametrize("bound", [1.1e-8, np.inf, np.nan])
def test_a_reference_that_is_not_known_well_enough(bound: float) -> None:
    assert judged(X, LAM, bound).verdict == "cannot_be_judged"


@pytest.mark.parametrize("x", [[0.75], [0.75, np.nan], [0.75, np.inf], [[0.75, 0.25]]])
def test_no_answer(x: list[float]) -> None:
    assert judged(np.array(x), LAM).verdict == "no_answer"


def test_displacements_without_forces() -> None:
    found = judged(X, np.array([np.nan]))
    assert (found.verdict, found.dual_residual, found.duality_gap) == ("within", None, None)
    assert found.backward_error is None


@pytest.mark.filterwarnings("ignore:overflow|invalid value:RuntimeWarning")
@pytest.mark.parametrize("x", [[1.7e308, 0.0], [1.7e308, 1.7e308]])
def test_what_overflows_is_infinite_and_outside(x: list[float]) -> None:
    found = judged(np.array(x), LAM)
    assert found.verdict == "outside"
    shown = (found.dual_residual, found.duality_gap, found.backward_error, found.objective)
    assert not any(np.isnan(np.array(shown, dtype=float)))


def test_lengths_in_other_units_are_judged_in_millimetres() -> None:
    """The first unknown in units of 2 mm, the gap in units of 1/4 mm."""
    springs = (np.array([[8.0]]), np.array([[2.0]]))
    assembly = Assembly(Stiffness.of(*springs), sp.csc_array([[8.0], [-4.0]]))
    prepared = Prepared(assembly)
    load = LoadCase(np.array([6.0, -1.0]), np.array([2.0]))
    units = {"unit_mm": np.array([2.0, 1.0]), "gap_unit_mm": np.array([0.25])}
    x, lam = X / units["unit_mm"], LAM / 4
    reference = Reference(x, lam, np.array([True]), 1e-15, "by hand", **units)
    assert judge(prepared, load, reference, x, lam, 1e-7).backward_error == 0.0
    found = judge(prepared, load, reference, x - [1e-3, 0.0], lam, 1e-7)
    assert (found.verdict, found.contact_mismatch) == ("outside", 1)
    assert found.displacement_error_mm == pytest.approx(2e-3)
    small = judge(prepared, load, reference, x - [0.4e-7, 0.0], lam, 1e-7)
    assert (small.verdict, small.contact_mismatch) == ("within", 0)


@pytest.mark.parametrize(("condition", "limit"), [(1e4, 1e-7), (1e12, 100 * 1e12 / 2**53 * 3)])
def test_the_limit_that_conditioning_allows(condition: float, limit: float) -> None:
    assert conditioned_limit(1e-7, condition, 3.0) == pytest.approx(limit)
