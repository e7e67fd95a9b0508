"""Each term of the sparse form's bound where it dominates and is attained: halved, it is no bound."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification.exact_residual import DoubleDouble, Enclosure, forces, gaps
from harness.verification.sparse_bound import SparseBound, _State
from problems.forms.assembly import Assembly, LoadCase, stacked
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness


def prepared(*diagonal: float) -> Prepared:
    """Unknowns without any coupling; the only contact is on the first."""
    n = len(diagonal)
    return Prepared(Assembly(Stiffness.of(sp.csc_array(np.diag(diagonal))), sp.csc_array(np.eye(n, 1))))


def bound_of(data: Prepared) -> SparseBound:
    bound = SparseBound.of(data, 1.0)  # DKD is the identity: λmin is 1
    assert bound is not None
    return bound


def state(
    data: Prepared, load: LoadCase, x: list[float], lam: float, lo: list[float] | None = None
) -> _State:
    """x and λ as they are, without a refinement."""
    made = _State(bound_of(data), stacked([load]), np.array([[lam]]))
    made.x = DoubleDouble(column(x), column([0.0] * len(x) if lo is None else lo))
    made.lam = DoubleDouble(column([lam]), column([0.0]))
    made.renew(np.array([True]))
    made.s = gaps(data.assembly, made.g, made.x)
    return made


def column(values: list[float]) -> np.ndarray:
    return np.array(values)[:, None]


#: x* = (1, 2), λ* = 6 N.
DATA, LOAD = prepared(4.0, 16.0), LoadCase(np.array([10.0, 32.0]), np.array([1.0]))


def test_a_gap_that_is_not_closed_moves_the_answer_by_as_much() -> None:
    for x in (1.001, 0.999):
        found = bound_of(DATA)._bound(state(DATA, LOAD, [x, 2.0], 10 - 4 * x))
        assert 1e-3 * (1 - 1e-12) <= found <= 1.03e-3


def test_an_overlap_of_an_open_contact_counts_and_a_gap_does_not() -> None:
    load = LoadCase(np.array([4.004, 32.0]), np.array([1.0]))  # x* = 1, λ* = 0.004
    assert 1e-3 <= bound_of(DATA)._bound(state(DATA, load, [1.001, 2.0], 0.0)) <= 1.03e-3
    apart = LoadCase(np.array([2.0, 32.0]), np.array([1.0]))
    assert bound_of(DATA)._bound(state(DATA, apart, [0.5, 2.0], 0.0)) <= 1e-14


def test_a_force_out_of_balance_moves_the_answer_in_units_of_its_own_unknown() -> None:
    found = bound_of(DATA)._bound(state(DATA, LOAD, [1.0, 2.001], 6.0))
    assert 1e-3 <= found <= 2.05e-3  # the first unknown is twice as soft, so that it might be that one
    only_second = Prepared(Assembly(DATA.assembly.K, DATA.assembly.A, junction=np.array([1])))
    found = bound_of(only_second)._bound(state(only_second, LOAD, [1.0, 2.001], 6.0))
    assert 1e-3 <= found <= 1.03e-3


def test_what_is_cut_off_from_x_counts() -> None:
    found = bound_of(DATA)._bound(state(DATA, LOAD, [1.0, 1.75], 6.0, [0.0, 0.25]))
    assert 0.25 <= found <= 0.26


def test_the_uncertainty_of_the_residuals_counts() -> None:
    exact = state(DATA, LOAD, [1.0, 2.0], 6.0)
    assert bound_of(DATA)._bound(exact) < 1e-14
    exact.s = Enclosure(exact.s.value, column([1e-3]))
    assert 1e-3 <= bound_of(DATA)._bound(exact) <= 1.03e-3
    exact = state(DATA, LOAD, [1.0, 2.0], 6.0)
    exact.r = Enclosure(exact.r.value, column([4e-3, 0.0]))
    assert 1e-3 <= bound_of(DATA)._bound(exact) <= 1.03e-3


def test_a_force_that_pulls_proves_nothing() -> None:
    assert bound_of(DATA)._bound(state(DATA, LOAD, [1.0, 2.0], -1e-30)) == np.inf


def test_refinement_ends_at_the_answer_from_any_forces() -> None:
    for lam in (0.0, 3.0, 6.0, 60.0):
        found = bound_of(DATA).proven([LOAD], [np.array([lam])])[0]
        assert found.bound_mm <= 1e-10
        np.testing.assert_allclose(found.x.hi, [1.0, 2.0], atol=1e-13)
        assert found.lam.hi == pytest.approx(6.0)
        assert found.active.all()


def test_steps_carry_the_rounding_of_what_they_move() -> None:
    """r after a step encloses the exact residual of what is stored."""
    random = np.random.default_rng(0)
    data = prepared(4.0, 0.7, 3e5)
    load = LoadCase(random.normal(size=3), np.array([-0.3]))
    made = _State(bound_of(data), stacked([load]), np.array([[1.0 / 3]]))
    for _ in range(5):
        made._move(random.normal(size=(3, 1)), random.random((1, 1)))
        assert (missed(made) <= made.r.error[:, 0]).all()


def missed(made: _State) -> np.ndarray:
    """How far r is from that of the stored x and λ, but for the uncertainty of the latter."""
    x, lam = (DoubleDouble(v.hi[:, 0], v.lo[:, 0]) for v in (made.x, made.lam))
    exact = forces(made.assembly, made.f[:, 0], x, lam)
    return abs(made.r.value[:, 0] - exact.value) - exact.error


def test_a_step_counts_what_cancels_in_K_dx_and_in_A_dlam() -> None:
    """r stays small, and the rounding is that of large terms: once of K dx alone, once of A dλ."""
    K = np.array([[0.9, 0.9 - 1e-9], [0.9 - 1e-9, 0.9]])
    stiff = Prepared(Assembly(Stiffness.of(sp.csc_array(K)), sp.csc_array(np.eye(2, 1))))
    A = sp.csc_array(np.array([[0.3, 0.7], [0.0, 1e-9]]))
    held = Prepared(Assembly(Stiffness.of(sp.csc_array(np.eye(2))), A))
    random = np.random.default_rng(0)
    for data, of_x in ((stiff, True), (held, False)):
        m = data.assembly.m
        large = 0.0
        for _ in range(20):
            made = state_at_rest(data)
            t = random.normal()
            dx, dlam = ((t, -t), (0.0,) * m) if of_x else ((0.0, 0.0), (0.7 * t, -0.3 * t))
            made._move(column(list(dx)), column(list(dlam)))
            assert (missed(made) <= made.r.error[:, 0]).all()
            with np.errstate(divide="ignore"):  # all of it may cancel
                large = max(large, float((missed(made) / abs(made.r.value[:, 0])).max()))
        assert large > 1e-10  # so that no multiple of |r| would have been enough


def state_at_rest(data: Prepared) -> _State:
    """x, λ and r are zero; the units are 1, and of the bound only what rounding needs is right."""
    n, m = data.assembly.A.shape
    (K,) = data.assembly.sparse_blocks
    sizes, one = abs(K) @ np.ones((n, 1)), np.ones((n, 1))
    bound = SparseBound(data, bound_of(DATA).M, sp.csc_array(abs(data.assembly.A)), sizes, one, 1.0, 1.0, 1.0)
    return _State(bound, stacked([LoadCase(np.zeros(n), np.ones(m))]), np.zeros((m, 1)))
