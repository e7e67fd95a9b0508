"""The one bound: each of its terms where it dominates and is attained, and refinement from any forces.

The errors are known in closed form. `mutate_proofs.py` takes the terms out in turn.
"""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from small_problems import definite

from harness.verification.assess import assess
from harness.verification.closed_contacts import ClosedContacts, ScaledInverse
from harness.verification.enclosure import DoubleDouble, Enclosure
from harness.verification.proof import Proof, Sharpness
from harness.verification.reference import proof_of
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.compliance import ApproximateInverse
from problems.forms.prepared import Prepared
from problems.stiffness import gamma
from problems.stiffness.operator import Stiffness

KINDS = pytest.mark.parametrize("kind", [np.asfortranarray, sp.csc_array], ids=["dense", "sparse"])


def array(*values: float) -> np.ndarray:
    return np.array(values, dtype=float)


def springs(
    kind: Any, *stiffness: float, A: Any = None, junction: Any = None, exact: bool = True
) -> tuple[Proof, Assembly]:
    """Independent springs, the first against a rigid tool. exact : with the exact constants of the bound."""
    n = len(stiffness)
    contacts = sp.csc_array(np.eye(n, 1) if A is None else np.asarray(A, dtype=float).reshape(n, -1))
    made = Assembly(Stiffness.of(kind(np.diag(array(*stiffness)))), contacts, junction=junction)
    proof = proof_of(Prepared(made))
    if exact:
        proof.kappa, proof.balanced.__dict__["stiffest"] = 1.0, 1.0
        scaled = proof.balanced.A.toarray()
        proof.balanced.__dict__["sigma2"] = float(np.linalg.eigvalsh(scaled.T @ scaled)[0])
    return proof, made


def bound(
    proof: Proof,
    load: LoadCase,
    x: np.ndarray,
    lam: np.ndarray,
    lo: float = 0.0,
    s: float = 0.0,
    r: float = 0.0,
    sharpness: Sharpness = Sharpness.PLAIN,
) -> float:
    """Of x and λ as they are. lo : the second half of x; s, r : uncertainties of gap and force, mm and N."""
    units, one = proof.balanced, proof.balanced.load([load])
    at = DoubleDouble(x[:, None] / units.D, np.full((len(x), 1), lo) / units.D)
    forces = DoubleDouble(lam[:, None] / units.R, np.zeros((len(lam), 1)))
    force, gap = units.residuals(one, at, forces)
    force = Enclosure(force.value, force.error + r * units.D)
    gap = Enclosure(gap.value, gap.error + s * units.R)
    return float(proof.bounds(at, forces, force, gap, sharpness)[0][0])


#: Springs of 4 and 16 N/mm; x* = (1, 2), λ* = 6 N.
LOAD = LoadCase(array(10.0, 32.0), array(1.0))


@KINDS
@pytest.mark.parametrize("x", [1.001, 0.999])
def test_a_closed_contact_with_a_gap_or_an_overlap_moves_the_answer_by_as_much(kind: Any, x: float) -> None:
    proof, _ = springs(kind, 4.0, 16.0)
    assert 1e-3 * (1 - 1e-12) <= bound(proof, LOAD, array(x, 2.0), array(10 - 4 * x)) <= 1.03e-3


@KINDS
def test_an_overlap_of_an_open_contact_counts_and_a_gap_does_not(kind: Any) -> None:
    proof, _ = springs(kind, 4.0, 16.0)
    touching = LoadCase(array(4.004, 32.0), array(1.0))  # x* = 1, λ* = 0.004
    assert 1e-3 <= bound(proof, touching, array(1.001, 2.0), array(0.0)) <= 1.03e-3
    assert bound(proof, LoadCase(array(2.0, 32.0), array(1.0)), array(0.5, 2.0), array(0.0)) <= 1e-14


@KINDS
def test_both_sides_of_a_gap_move(kind: Any) -> None:
    """AᵀA = 2, and each side moves by half of the gap; σ counts as it stands in the bound."""
    proof, _ = springs(kind, 1.0, 1.0, A=[[1.0], [-1.0]])
    found = bound(proof, LoadCase(array(2.0, 0.0), array(0.0)), array(1.0 - 1e-3, 1.0), array(1.0))
    assert found >= 1e-3 / 2
    proof.balanced.__dict__["sigma2"] = proof.balanced.sigma2 / 4
    assert bound(
        proof, LoadCase(array(1.0, 1.0), array(1e-3)), array(1.0, 1.0), array(1e-30)
    ) >= 1e-3 * np.sqrt(2)
    proof.balanced.__dict__["stiffest"] = 4.0
    assert bound(
        proof, LoadCase(array(1.0, 1.0), array(1e-3)), array(1.0, 1.0), array(1e-30)
    ) >= 2e-3 * np.sqrt(2)


@KINDS
def test_a_force_out_of_balance_moves_the_answer_in_the_unit_of_its_unknown(kind: Any) -> None:
    """The first unknown is twice as soft, so that it might be that one, if it is asked for."""
    proof, _ = springs(kind, 4.0, 16.0)
    assert 1e-3 <= bound(proof, LOAD, array(1.0, 2.001), array(6.0)) <= 2.05e-3
    second, _ = springs(kind, 4.0, 16.0, junction=np.array([1]))
    assert 1e-3 <= bound(second, LOAD, array(1.0, 2.001), array(6.0)) <= 1.03e-3
    for n in (1, 4):  # equal errors: the bound is on their length
        many, _ = springs(kind, *[4.0] * n)
        free = LoadCase(np.full(n, 4.0), array(10.0))
        found = bound(many, free, np.full(n, 1 + 2.0**-20), array(0.0))
        assert 2.0**-20 * np.sqrt(n) <= found <= 1.03 * 2.0**-20 * np.sqrt(n)


@KINDS
@pytest.mark.parametrize("kappa", [1 / 16, 1 / 4])
def test_a_softer_K_has_a_wider_bound(kind: Any, kappa: float) -> None:
    """1/κ by forces, 1/√κ by gaps."""
    proof, _ = springs(kind, 4.0)
    by_force = LoadCase(array(4.0), array(10.0)), array(1.001), array(0.0)
    by_gap = LoadCase(array(10.0), array(1.0)), array(0.999), array(10 - 4 * 0.999)
    proof.kappa = kappa
    assert 1e-3 / kappa <= bound(proof, *by_force) <= 1.03e-3 / kappa
    assert 1e-3 * (1 - 1e-12) / np.sqrt(kappa) <= bound(proof, *by_gap) <= 1.03e-3 / np.sqrt(kappa)


@KINDS
def test_what_is_not_known_of_the_residuals_counts(kind: Any) -> None:
    proof, _ = springs(kind, 4.0, 16.0)
    at = array(1.0, 2.0), array(6.0)
    assert bound(proof, LOAD, *at) < 1e-14
    assert 1e-3 <= bound(proof, LOAD, *at, s=1e-3) <= 1.03e-3
    assert 1e-3 <= bound(proof, LOAD, *at, r=4e-3) <= 4e-3
    assert 2e-3 <= bound(proof, LOAD, array(1.001, 2.0), array(5.996), s=1e-3) <= 2.05e-3
    open_, touching = (LoadCase(array(4.0, 32.0), array(g)) for g in (2.0, 1.0))  # λ* = 0
    assert bound(proof, open_, array(1.0, 2.0), array(0.0), s=1e-3) < 1e-14
    assert 1e-3 <= bound(proof, touching, array(1.0, 2.0), array(0.0), s=1e-3) <= 1.03e-3


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9, 1.0])
def test_a_gap_is_closed_by_a_translation(share: float) -> None:
    """By that share of it, the rest through ‖K‖/σ²; both count, and of a softer K neither does."""
    proof, _ = springs(np.asfortranarray, 4.0, 16.0)
    exact = proof.inverse.forces
    object.__setattr__(proof.inverse, "forces", lambda v, C: share * exact(v, C))
    proof.kappa = 1 / 16
    at = array(1.001, 2.0), array(5.996)
    assert 1e-3 * (1 - 1e-12) <= bound(proof, LOAD, *at, sharpness=Sharpness.TRANSLATED) <= 1.05e-3
    assert 2e-3 * (1 - 1e-12) <= bound(proof, LOAD, *at, s=1e-3, sharpness=Sharpness.TRANSLATED) <= 2.1e-3
    proof.balanced.__dict__["stiffest"] = 4.0
    wider = 1e-3 * (share + 2 * (1 - share))
    assert wider * (1 - 1e-12) <= bound(proof, LOAD, *at, sharpness=Sharpness.TRANSLATED) <= 1.05 * wider
    proof.compliance = 1e9  # then it is D/√κ, four times as much, of all but half of the translation
    wider = 1e-3 * (share * (1 + 4) / 2 + 8 * (1 - share))
    assert wider * (1 - 1e-12) <= bound(proof, LOAD, *at, sharpness=Sharpness.TRANSLATED) <= 1.05 * wider


@pytest.mark.parametrize("seed", range(20))
def test_a_translation_bounds_the_error_where_contacts_open_and_close(seed: int) -> None:
    """A third of them carry no force in the answer and some here, or the other way round."""
    data, load, x, lam = beam(12 + seed, np.asfortranarray, 0)
    proof, random = proof_of(data), np.random.default_rng(seed)
    forces = np.maximum(lam + 50 * random.standard_normal(len(lam)) * (random.random(len(lam)) < 0.7), 0.0)
    at = data.assembly.K.solve(load.f - data.assembly.A @ forces)
    assert 0 < abs(at - x).max() <= bound(proof, load, at, forces, sharpness=Sharpness.TRANSLATED)


def test_a_corrected_answer_is_proven_by_the_compliance(monkeypatch: pytest.MonkeyPatch) -> None:
    """As √(K⁻¹)_ii is less than 1/√κ, without a residual in twice the working precision."""
    data, load, x, lam = beam(150, np.asfortranarray, 0)
    proof, made = proof_of(data), list[bool]()
    residuals = proof.balanced.residuals

    def counted(*at: Any, sharp: bool = True) -> Any:
        made.append(sharp)
        return residuals(*at, sharp=sharp)

    object.__setattr__(proof.balanced, "residuals", counted)
    (found,) = proof.proven([load], [1.001 * lam], enough_mm=3e-7)
    assert abs(found.x.hi - x).max() <= found.bound_mm <= 3e-7
    assert made == [False]


def test_the_rounding_of_what_a_translation_leaves_counts() -> None:
    proof, _ = springs(np.asfortranarray, 4.0, 16.0)
    for size in (0.7, 1e-323):
        gap = Enclosure(np.full((1, 1), -size), np.full((1, 1), 1e-3) * size)
        left, _ = proof._translated(gap, np.ones((1, 1), dtype=bool))
        assert abs(left.value) <= left.error
        assert left.error >= 1e-3 * size + 2 * gamma(2) * 0.99 * size
        assert left.error >= 2.0**-1074


def test_a_first_correction_closes_the_gaps_of_a_dense_q() -> None:
    """y_C + Q'dλ is zero on C where contacts off it lose a force, in units R that differ."""
    random, R = np.random.default_rng(0), 2.0 ** np.arange(-6, 6)
    Q = definite(12, 1, 10.0)
    scaled = Q * R * R[:, None]
    lam = np.full(12, 1e3)
    y = np.where(np.arange(12) % 3, random.uniform(-1, 1, 12), 2 * np.diag(scaled) * lam)
    start = ClosedContacts(ScaledInverse(None, np.diag(scaled), R, Q), y, lam)
    assert 0 < start.C.sum() < 12
    np.testing.assert_array_equal(start.dlam[~start.C], -1e3)
    kept = start.C & (start.dlam > -1e3)
    np.testing.assert_array_equal(kept, start.C)
    after = y + scaled @ start.dlam
    assert (abs(after) <= 1e-10 * abs(scaled) @ abs(start.dlam))[start.C].all()


def test_many_answers_are_proven_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a correction, and to no more than some times their error."""
    data, load, x, lam = beam(150, np.asfortranarray, 0)
    proof = proof_of(data)
    monkeypatch.setattr(proof, "corrections", None)
    noise = 1 + 1e-9 * np.random.default_rng(1).standard_normal((20, len(lam)))
    for each in assess(proof, [load] * 20, list(lam * noise), [None] * 20, enough_mm=1.0):
        assert abs(each.x - x).max() <= each.bound_mm <= 100 * abs(each.x - x).max()


@KINDS
def test_what_is_cut_off_from_x_counts_in_mm(kind: Any) -> None:
    proof, _ = springs(kind, 4.0, 16.0)
    load = LoadCase(array(10.0, 32.0) + array(4.0, 16.0) * 0.25, array(1.25))
    assert 0.25 <= bound(proof, load, array(1.0, 2.0), array(6.0), lo=0.25) <= 0.26


@KINDS
def test_an_answer_that_underflows_is_rounded(kind: Any) -> None:
    """x* = 0.75 η is no number."""
    proof, _ = springs(kind, 2.0**40)
    eta = 2.0**-1074
    (found,) = proof.proven([LoadCase(array(0.75 * 2.0**40 * eta), array(1.0))], [array(0.0)])
    assert (
        abs(Fraction(float(found.x.hi[0])) - Fraction(eta) * 3 / 4) <= Fraction(found.bound_mm) <= 2.0**-1060
    )


@KINDS
@pytest.mark.parametrize(("f", "g", "exact"), [(1, 2**50, Fraction(1, 2**40)), (0, -1, Fraction(-1, 2**30))])
def test_a_load_that_underflows_in_its_unit_is_not_lost(kind: Any, f: int, g: int, exact: Fraction) -> None:
    """f, g and x* in units of η: a force on a stiff spring, and an overlap in a unit of its own."""
    proof, _ = springs(kind, 2.0**40, A=[[2.0**30]])
    eta = 2.0**-1074
    assert not (proof.balanced.D * eta).any()
    assert not (proof.balanced.R * eta).any()
    (found,) = proof.proven([LoadCase(array(f * eta), array(g * eta))], [array(0.0)])
    off = abs(Fraction(float(found.x.hi[0])) - exact * Fraction(eta))
    assert off <= Fraction(found.bound_mm) <= 2.0**-1060


@KINDS
def test_the_norm_of_K_is_in_balanced_units(kind: Any) -> None:
    assert 1.0 <= springs(kind, 4.0, 2.0**40, exact=False)[0].balanced.stiffest <= 1.02


@KINDS
def test_nothing_is_proven_of_forces_that_pull_or_of_a_K_that_is_not(kind: Any) -> None:
    at = array(1.0, 2.0)
    proof, _ = springs(kind, 4.0, 16.0)
    assert bound(proof, LOAD, at, array(-1e-30)) == np.inf
    proof.kappa = 0.0
    with np.errstate(all="ignore"):
        assert bound(proof, LOAD, at, array(6.0)) == np.inf
        assert proof.proven([LOAD], [array(6.0)])[0].bound_mm == np.inf
        twice, _ = springs(kind, 4.0, 16.0, A=[[1.0, 1.0], [0.0, 0.0]], exact=False)
        load = LoadCase(LOAD.f, array(1.0, 1.0))
        assert twice.balanced.sigma2 == 0.0
        assert 1e-3 < bound(twice, load, array(0.999, 2.0), array(3.0, 3.0)) < 0.1


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@KINDS
@pytest.mark.parametrize("bad", [1.7e308, np.inf, np.nan])
def test_what_overflows_proves_nothing(kind: Any, bad: float) -> None:
    proof, _ = springs(kind, 0.25, exact=False)
    load = LoadCase(array(1.7e308), array(1.0))
    found = proof.proven([load], [array(0.0)], [array(bad)])[0]
    assert found.bound_mm == np.inf or np.isfinite(found.x.hi).all()
    if np.isfinite(bad):
        for lam in (bad, -bad):
            assert assess(proof, [load], [array(lam)], [None])[0].bound_mm == np.inf


def beam(n: int, kind: Any, spread: int) -> tuple[Prepared, LoadCase, np.ndarray, np.ndarray]:
    """A chain held softly with a contact at each unknown, and its answer in integers: a third of the contacts
    closed, a third closed without a force. spread : bits between the sizes of the contacts' units.
    """
    rng = np.random.default_rng(n)
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K = K @ K + 2.0**-10 * np.eye(n)
    A = np.diag(rng.choice([-1.0, 1.0], n) * 2.0 ** rng.integers(-spread, spread + 1, n))
    x, of = rng.integers(-(2**10), 2**10, n).astype(float), np.arange(n) % 3
    lam = np.where(of == 0, rng.integers(1, 2**10, n), 0).astype(float)
    y = np.where(of == 2, rng.integers(1, 2**10, n), 0) / 2.0**spread
    load = LoadCase(K @ x + A @ lam, A.T @ x + y)
    nodes = np.column_stack([np.arange(n, dtype=float), np.zeros(n)])
    return Prepared(Assembly(Stiffness.of(kind(K)), sp.csc_array(A), nodes)), load, x, lam


@KINDS
@pytest.mark.parametrize("spread", [0, 8])
@pytest.mark.parametrize("without_M", [False, True])
@pytest.mark.parametrize("n", [6, 150])
def test_forces_near_the_answer_are_refined_to_rounding(
    n: int, without_M: bool, spread: int, kind: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By an approximate inverse of Q, by its exact one, and by conjugate gradients alone, which need a better
    guess of which contacts touch without a force."""
    data, load, x, lam = beam(n, kind, spread)
    if without_M:
        none = ApproximateInverse(None, np.ones(n))
        monkeypatch.setattr(Prepared, "approximate_inverse", none)
    noise = 1 + (1e-12 if without_M else 1e-6) * np.random.default_rng(1).standard_normal((3, n))
    found = proof_of(data).proven([load] * 3, list(lam * noise))
    for each in found:
        assert abs(each.x.hi - x).max() <= each.bound_mm <= 1e-12
        np.testing.assert_allclose(each.lam.hi, lam, atol=1e-9 * lam.max())


def test_a_case_that_is_near_enough_is_not_refined_with_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    data, load, _, lam = beam(60, sp.csc_array, 0)
    proof, passes = proof_of(data), []
    corrections = proof.corrections

    def noted(r: np.ndarray, *others: Any) -> Any:
        passes.append(r.shape[1])
        return corrections(r, *others)

    monkeypatch.setattr(proof, "corrections", noted)
    assert proof.proven([load], [lam * 1.001], enough_mm=1e9)[0].bound_mm <= 1e9
    assert not passes
    both = proof.proven([load, load], [lam, lam * 1.001], enough_mm=1e-7)
    assert set(passes) == {1}
    assert max(each.bound_mm for each in both) <= 1e-7


@KINDS
def test_a_correction_that_goes_beyond_zero_forces_is_not_believed(
    kind: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """x + dx and λ + dλ balance, but λ + dλ is negative: the pressed contact would be open."""
    proof, _ = springs(kind, 4.0, 16.0)
    steps = array(0.5, 0.0)[:, None] / proof.balanced.D, array(-2.0)[:, None] / proof.balanced.R
    monkeypatch.setattr(proof, "corrections", lambda *_: steps)
    (found,) = proof.proven([LoadCase(array(5.0, 32.0), array(2.0))], [array(1.0)], [array(1.0, 2.0)], 1e-3)
    assert abs(found.x.hi - array(1.25, 2.0)).max() <= found.bound_mm


@KINDS
@pytest.mark.parametrize("stiffness", [1.0, 3.0, 7e-290])
def test_an_answer_is_bounded_by_its_distance_from_the_proven_one(kind: Any, stiffness: float) -> None:
    """Answers that press an open contact with a force, or lie elsewhere; no load, x* = 0."""
    proof, _ = springs(kind, stiffness, exact=False)
    away = [array(1 + k / 7) for k in range(20)]
    none, load = [array(0.0)] * 20, LoadCase(array(0.0), array(10.0))
    pressed = assess(proof, [load] * 20, [stiffness * x for x in away], [None] * 20)
    for found in pressed + assess(proof, [load] * 20, none, away):
        error = abs(Fraction(float(found.x[0])))
        assert error <= Fraction(found.bound_mm) <= error * Fraction(102, 100)


@KINDS
def test_the_rounding_of_what_was_moved_counts(kind: Any) -> None:
    """A solver's own x, far from k/3 and near it: the distance is itself rounded."""
    proof, _ = springs(kind, 3.0, exact=False)
    given = [(k, x) for k in range(1, 60) for x in (1e9 * k / 7, k / 3, np.nextafter(k / 3, 0.0))]
    loads = [LoadCase(array(float(k)), array(1e12)) for k, _ in given]
    answers = assess(proof, loads, [array(0.0)] * len(given), [array(x) for _, x in given])
    for (k, x), found in zip(given, answers, strict=True):
        error = abs(Fraction(float(x)) - Fraction(k, 3))
        assert error <= Fraction(found.bound_mm) <= error * 4 + Fraction(k, 10**15)
