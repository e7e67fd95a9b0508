"""Terms of the sparse form's proof, each where it dominates: units in the certificate, λmin in units.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from lambda_min import proven_in_units
from springs import array, diagonal, doubled

from harness.verification import augmented
from harness.verification.certificate import Certificate, certify
from harness.verification.reference import refined_active_set
from problems.forms.alteration import Alteration
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness

E = 2.0**-20
#: Two springs, 1/D_i² each: DKD = I, κ = 1.
UNITS = array(0.25, 8.0)


def springs(junction: list[int], A: list[list[float]] | None = None) -> Assembly:
    return replace(diagonal(*(1 / UNITS**2), A=A), junction=np.array(junction))


def certified(assembly: Assembly, f: Vector, g: float, x: Vector, lam: Vector) -> Certificate:
    load = LoadCase(f, array(*[g] * assembly.m))
    closed = np.zeros(assembly.m, dtype=bool)
    return certify(assembly, load, doubled(x), doubled(lam), closed, 1.0, UNITS)


@pytest.mark.parametrize("asked", [0, 1])
@pytest.mark.parametrize("wrong", [0, 1])
def test_an_error_counts_in_the_unit_of_its_unknown(asked: int, wrong: int) -> None:
    """x_wrong is off by E: |ẽ| = E/D_wrong, and as far as is known x_asked is off by D_asked times that."""
    assembly = springs([asked])
    x = np.ones(2) + E * (np.arange(2) == wrong)
    found = certified(assembly, assembly.K.multiply(np.ones(2)), 10.0, x, np.zeros(2))
    assert found.bound_mm == pytest.approx(E * UNITS[asked] / UNITS[wrong], rel=1e-3)
    if asked == wrong:
        assert found.bound_mm >= E


@pytest.mark.parametrize("asked", [0, 1])
def test_slack_times_force_is_an_energy_in_any_unit(asked: int) -> None:
    """x* = g and λ* = 0; at x = g − E, λ = kE, nothing is out of balance and sᵀλ = kE²."""
    assembly, wrong = springs([asked]), np.arange(2) == asked
    k = assembly.K.diagonal
    found = certified(assembly, k, 1.0, np.ones(2) - E * wrong, k * E * wrong)
    assert E <= found.bound_mm <= 1.001 * E


@pytest.mark.parametrize("asked", [0, 1])
def test_the_low_part_of_an_answer_counts_in_mm(asked: int) -> None:
    """x* = hi + lo exactly: nothing but leaving out lo is wrong."""
    assembly = springs([asked])
    load = LoadCase(assembly.K.multiply(np.full(2, 1 + E)), np.full(2, 10.0))
    x, none = doubled(np.ones(2), np.full(2, E)), doubled(np.zeros(2))
    found = certify(assembly, load, x, none, np.zeros(2, dtype=bool), 1.0, UNITS)
    assert E <= found.bound_mm <= 1.001 * E


def test_what_reading_altered_counts_in_the_largest_unit() -> None:
    """‖DΔKD‖₂ ≤ max D² ‖ΔK‖₂: κ = 1 − 64 · 2⁻⁸ = 3/4 at most, none at 2⁻⁶; forces are off by ‖ΔK‖ |x|."""
    load = LoadCase(1 / UNITS**2, np.full(2, 10.0))
    for norm, left in ((2.0**-8, 0.75), (2.0**-7, 0.5), (1.01 * 2.0**-6, 0.0)):
        zero = np.zeros(2)
        altered = Alteration(np.full(2, norm), zero, zero, zero, zero)
        assert altered.norm_K == pytest.approx(norm)
        assembly = replace(springs([0]), altered=altered)
        found = certify(assembly, load, doubled(np.ones(2)), doubled(zero), zero > 0, 1.0, UNITS)
        if left:
            assert found.bound_mm >= UNITS[0] * np.linalg.norm(UNITS * norm) / left
        else:
            assert found.bound_mm == np.inf


@pytest.mark.parametrize("contact", [0, 1])
def test_a_gap_is_proven_open_by_the_error_in_the_unit_of_its_unknown(contact: int) -> None:
    """|s* − s| ≤ D_i ‖ẽ‖ = D_i E/D_0, where x_0 is off by E."""
    A = np.eye(2)[:, [contact]].tolist()
    assembly = springs([0, 1], A)
    x = array(1.0 + E, 1.0)
    least = E * UNITS[contact] / UNITS[0]
    for gap, proven in ((1.02 * least, True), (0.98 * least, False)):
        found = certified(assembly, assembly.K.multiply(np.ones(2)), x[contact] + gap, x, np.zeros(1))
        assert found.open[0] == proven


@pytest.mark.parametrize("contact", [0, 1])
def test_a_force_is_proven_by_the_stiffness_in_the_units_of_all(contact: int) -> None:
    """|λ* − λ| ≤ √(K_ii · trace DKD) ‖ẽ‖ + |r_i|: √2/D_i · ‖ẽ‖, with ‖ẽ‖ = |D_j r_j| at the other spring."""
    A = np.eye(2)[:, [contact]].tolist()
    assembly, other = springs([0, 1], A), 1 - contact
    k = assembly.K.diagonal
    r = E * (np.arange(2) == other)
    uncertainty = np.sqrt(2.0) / UNITS[contact] * UNITS[other] * E
    for lam, proven in ((1.03 * uncertainty, True), (0.99 * uncertainty, False)):
        f = k + r + lam * (np.arange(2) == contact)
        load = LoadCase(f, array(1.0))
        x = doubled(np.ones(2))
        found = certify(assembly, load, x, doubled(array(lam)), np.ones(1, dtype=bool), 1.0, UNITS)
        assert found.closed[0] == proven


def test_lambda_min_is_in_the_units_given() -> None:
    """diag(4, 2⁻¹⁰, 9) in units that are not balanced: the eigenvalues of DKD are known."""
    K = sp.csc_array(sp.diags_array([4.0, 2.0**-10, 9.0]))
    prepared = Prepared(Assembly(Stiffness.of(K), sp.csc_array((3, 0))))
    for D, least in ((np.ones(3), 2.0**-10), (array(1.0, 64.0, 0.25), 0.5625), (array(0.5, 32.0, 0.5), 1.0)):
        share = proven_in_units(prepared.assembly.K, D) / least
        assert 0.4 <= share <= 1.0
    np.testing.assert_array_equal(prepared.assembly.K.units, array(0.5, 32.0, 0.25))


def test_the_reference_bounds_in_balanced_units() -> None:
    """A soft slope beside a stiff deflection: in mm and N alone, κ would be 2⁻⁴⁰ and the bound 2²⁰ wider."""
    K = sp.csc_array(sp.diags_array([1.0, 2.0**-40]))
    assembly = Assembly(Stiffness.of(K), sp.csc_array(array(1.0, 0.0)[:, None]), junction=np.array([0]))
    load = LoadCase(array(1.0 / 3.0, 2.0**-30 / 3.0), array(10.0))
    found = refined_active_set(Prepared(assembly), load)
    assert abs(found.x[0] - 1.0 / 3.0) <= found.bound_mm <= 2.0**-50


def test_augmented_the_forces_converge_to_those_of_the_set() -> None:
    """Two springs pressed onto a tool: λ = f − kg, whatever ρ is."""
    assembly = springs([0, 1])
    k, g = assembly.K.diagonal, array(0.5, -0.25)
    load = LoadCase(array(100.0, 3.0), g)
    lam, y, _, _ = augmented.solution(Prepared(_sparse(assembly)), load, np.ones(2, dtype=bool))
    np.testing.assert_allclose(lam, load.f - k * g, rtol=1e-11)
    assert not y.any()


def _sparse(assembly: Assembly) -> Assembly:
    return replace(assembly, K=assembly.K.as_sparse())
