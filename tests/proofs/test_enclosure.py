"""Residuals against rational arithmetic: the error bounds hold, are small, and each of their terms counts."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from exact_answer import exactly

from harness.verification import enclosure
from harness.verification.balanced_units import Balanced
from harness.verification.enclosure import DoubleDouble, Enclosure, Residual, length, two_sum
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness import gamma
from problems.stiffness.operator import Stiffness

ETA = 2.0**-1074
WHOLE = slice(None)


def missed(found: Enclosure, column: int, wanted: list[Fraction]) -> list[Fraction]:
    """How far each value is from what it should be, less its error bound."""
    pairs = zip(found.value[:, column], found.error[:, column], wanted, strict=True)
    return [abs(Fraction(float(v)) - w) - Fraction(float(e)) for v, e, w in pairs]


def residual_of(
    value: np.ndarray, M: np.ndarray, x: DoubleDouble, kind: str, sharp: bool = True
) -> Enclosure:
    total = Residual(value)
    panel: Any = sp.csr_array(M) if kind == "sparse" else M
    total.subtract_product([(WHOLE, WHOLE, panel)], M.shape[1], x, sharp)
    return total.enclosed()


def wanted_of(value: np.ndarray, M: np.ndarray, x: DoubleDouble, column: int) -> list[Fraction]:
    whole = [a + b for a, b in zip(exactly(x.hi[:, column]), exactly(x.lo[:, column]), strict=True)]
    products = [sum(Fraction(float(m)) * v for m, v in zip(row, whole, strict=True)) for row in M]
    return [a - b for a, b in zip(exactly(value[:, column]), products, strict=True)]


def wild(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Entries of very different size."""
    return rng.standard_normal(shape) * 10.0 ** rng.uniform(-8, 4, shape)


def doubled(hi: np.ndarray, lo: np.ndarray | float = 0.0) -> DoubleDouble:
    return DoubleDouble(hi, np.broadcast_to(lo, hi.shape).copy())


@pytest.mark.parametrize("kind", ["dense", "dense, by columns", "sparse"])
@pytest.mark.parametrize("cases", [1, 3])
@pytest.mark.parametrize("sharp", [True, False])
def test_a_residual_lies_within_its_bound(
    kind: str, cases: int, sharp: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if kind == "dense, by columns":
        monkeypatch.setattr(enclosure, "WIDTH", 4)
    for seed in range(15):
        rng = np.random.default_rng(seed)
        M, hi = wild(rng, 6, 9) * (rng.random((6, 9)) < 0.7), wild(rng, 9, cases)
        x = doubled(hi, hi * rng.uniform(-1e-16, 1e-16, hi.shape))
        value = (M @ hi) * (1 + 1e-15 * rng.standard_normal((6, cases)))
        total = residual_of(value, M, x, kind, sharp)
        for column in range(cases):
            assert max(missed(total, column, wanted_of(value, M, x, column))) <= 0
        most = (1e-27 if sharp else 1e-20) * (abs(M) @ abs(hi).max(axis=1))
        assert (total.error.max(axis=1) <= most + 3e-16 * abs(total.value).max(axis=1)).all()


@pytest.mark.parametrize("width", [7, 50])
def test_sums_of_parts_are_in_less_doubt(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """By γ of the roundings of one part and of their sum, not of a row's."""
    rng = np.random.default_rng(0)
    M, x = rng.standard_normal((3, 200)), doubled(rng.standard_normal((200, 2)))
    whole = residual_of(M @ x.hi, M, x, "sparse", sharp=False)
    monkeypatch.setattr(enclosure, "WIDTH", width)
    parts = residual_of(M @ x.hi, M, x, "dense", sharp=False)
    terms = width + -(-200 // width)
    ratio = gamma(terms + enclosure.MORE) / gamma(200 + enclosure.MORE)
    np.testing.assert_allclose(parts.error / whole.error, ratio, rtol=1e-3)
    again = residual_of(M @ x.hi, M, x, "sparse", sharp=False)
    np.testing.assert_array_equal(again.error, whole.error)


#: n, and x and M with the only term of the product that is rounded; the least that its rounding may be.
TERMS = {
    "M1 x3": (2 - 2.0**-20, 0.5 + 2.0**-48, (2 - 2.0**-20) * 2.0**-48),
    "M2 x2": (1 + 2.0**-23, 1 + 2.0**-23, 2.0**-46),
    "M3 x": (1 + 2.0**-47, 1.0, 2.0**-47),
    "(M - M1) x1": (1 + 2.0**-23, 1.0, 2.0**-23),
    "M (x - x1)": (2 - 2.0**-20, 1 + 2.0**-23, (2 - 2.0**-20) * 2.0**-23),
}


@pytest.mark.parametrize("kind", ["dense", "sparse"])
@pytest.mark.parametrize("term", TERMS)
def test_what_is_not_exact_is_in_doubt_by_the_size_of_its_terms(kind: str, term: str) -> None:
    """Rows of alternating signs, whose sums are zero: nothing of the doubt is due to the value."""
    m, v, size = TERMS[term]
    n = 64
    M, x = np.full((1, n), m) * (-1.0) ** np.arange(n), doubled(np.full((n, 1), v))
    found = residual_of(np.zeros((1, 1)), M, x, kind, sharp="-" not in term)
    assert found.value[0, 0] == 0.0
    assert gamma(n) * n * size <= found.error[0, 0] <= 100 * gamma(n) * n * size


def test_the_rounding_of_the_sum_counts() -> None:
    """1 + 2⁻⁵³(1 − 2⁻⁵⁰) is 1, with nearly u lost."""
    small = 2.0**-53 * (1 - 2.0**-50)
    found = residual_of(np.ones((1, 1)), -np.ones((1, 1)), doubled(np.full((1, 1), small)), "dense")
    lost = abs(1 + Fraction(small) - Fraction(float(found.value[0, 0])))
    assert 0 < lost <= Fraction(float(found.error[0, 0])) <= 2 * lost


@pytest.mark.parametrize("sharp", [True, False])
def test_the_rounding_of_the_roundings_counts(sharp: bool) -> None:
    """The terms cancel but for 2⁻¹⁰⁸, which is lost beside 2⁻⁵⁴."""
    total, terms = Residual(np.zeros((1, 1))), [1.0, 2.0**-54, 2.0**-108, -1.0, -(2.0**-54)]
    for term in terms:
        total.subtract_product([(WHOLE, WHOLE, np.ones((1, 1)))], 1, doubled(np.full((1, 1), -term)), sharp)
    found, exact = total.enclosed(), sum(map(Fraction, terms))
    assert found.value[0, 0] == 0.0
    size = sum(abs(Fraction(term)) for term in terms)
    assert Fraction(float(found.error[0, 0])) >= Fraction(gamma(len(terms))) ** 2 * size > exact > 0


@pytest.mark.parametrize("scale", [1e-300, 1e-308, 1e-311, 1e-320])
@pytest.mark.parametrize("kind", ["dense", "sparse"])
def test_the_smallest_numbers_are_enclosed(kind: str, scale: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        M, hi = rng.standard_normal((5, 5)) * scale, rng.standard_normal((5, 1))
        x = doubled(hi, 1e-17 * hi)
        value = scale * rng.standard_normal((5, 1))
        assert max(missed(residual_of(value, M, x, kind), 0, wanted_of(value, M, x, 0))) <= 0


def test_products_that_underflow_count() -> None:
    """Twenty products just below η/2 each; and a load that is rounded to a multiple of η in other units."""
    M, x = np.full((1, 20), 2.0**-537), doubled(np.full((20, 1), 0.98 * 2.0**-538))
    found = residual_of(np.zeros((1, 1)), M, x, "dense")
    assert max(missed(found, 0, wanted_of(np.zeros((1, 1)), M, x, 0))) <= 0
    assert Residual(np.full((1, 1), ETA)).enclosed().error[0, 0] >= ETA
    assert residual_of(np.zeros((1, 1)), M, doubled(np.zeros((20, 1))), "dense").error[0, 0] == 0.0


def test_the_longest_sum_of_the_largest_pieces_is_exact() -> None:
    """All products of M₁x₂ and M₂x₁ near the largest that they can be, and of one sign."""
    rng = np.random.default_rng(0)
    for bits in (22, 23):
        unit = 2.0 ** (1 - bits)
        M, hi = (1 - unit + unit * (0.499 + 1e-6 * rng.random(shape)) for shape in ((8, 512), (512, 1)))
        x, value = doubled(hi), M @ hi
        assert max(missed(residual_of(value, M, x, "dense"), 0, wanted_of(value, M, x, 0))) <= 0


@pytest.mark.parametrize("kind", ["dense", "sparse"])
def test_what_is_small_is_subtracted_with_its_rounding(kind: str) -> None:
    rng = np.random.default_rng(0)
    for scale, of_error in ((1.0, 0.0), (1.0, 1e-3), (2.0**-537, 0.0)):
        M, x = scale * rng.standard_normal((9, 40)), scale * rng.standard_normal((40, 1))
        value = M @ x  # so that little is left
        total = Residual(value, np.full_like(value, of_error))
        total.subtract_small([(WHOLE, WHOLE, M if kind == "dense" else sp.csr_array(M))], 40, x)
        found = total.enclosed()
        off = missed(found, 0, wanted_of(value, M, doubled(x), 0))
        assert max(off) <= -Fraction(of_error) * 99 / 100
        assert found.error.max() <= 1.02 * of_error + 1e-12 * scale**2 + 100 * ETA
    # Terms that cancel are rounded all the same: 1 + 2⁻⁵³ − 1
    M = np.array([[1.0, 2.0**-53, -1.0]])
    total = Residual(np.zeros((1, 1)))
    total.subtract_small([(WHOLE, WHOLE, M if kind == "dense" else sp.csr_array(M))], 3, np.ones((3, 1)))
    assert missed(total.enclosed(), 0, [Fraction(-(2.0**-53))])[0] <= 0
    underflowing = Residual(np.zeros((1, 1)))
    tiny = np.full((1, 20), 0.98 * 2.0**-538)
    underflowing.subtract_small([(WHOLE, WHOLE, tiny)], 20, np.full((20, 1), 2.0**-537))
    wanted = -20 * Fraction(tiny[0, 0]) * Fraction(2.0**-537)
    assert missed(underflowing.enclosed(), 0, [wanted])[0] <= 0


def test_unknowns_of_every_size_keep_their_digits() -> None:
    """Of terms of one size the error is as small as if all factors were of one size."""
    unit = 2.0 ** np.arange(-200, 200, 20)
    rng = np.random.default_rng(0)
    M, hi = rng.standard_normal((3, 20)), rng.standard_normal((20, 1))
    usual = residual_of(np.zeros((3, 1)), M, doubled(hi), "dense")
    other = residual_of(np.zeros((3, 1)), M / unit, doubled(hi * unit[:, None]), "dense")
    np.testing.assert_array_equal(usual.value, other.value)
    np.testing.assert_array_equal(usual.error, other.error)


@pytest.mark.parametrize("kind", ["dense", "band", "general"])
@pytest.mark.parametrize("seed", range(5))
def test_the_residuals_of_a_problem_in_its_units(kind: str, seed: int) -> None:
    """r = D(f − Kx − Aλ) and s = R(g − Aᵀx) of several load cases, K in two blocks, units of every size."""
    rng = np.random.default_rng(seed)
    blocks: list[Any] = []
    for size in (9, 7):
        B, unit = rng.standard_normal((size, size)), 10.0 ** rng.uniform(-6, 6, size)
        K = (B @ B.T + np.eye(size)) * np.outer(unit, unit)
        blocks.append(np.asfortranarray(K + K.T) if kind == "dense" else sp.csc_array(K + K.T))
    A = rng.standard_normal((16, 60)) * (rng.random((16, 60)) < 0.9)
    K = Stiffness.of(*blocks)
    made = Balanced.of(Prepared(Assembly(K, sp.csc_array(A))))
    x, lam = doubled(wild(rng, 16, 2)), doubled(rng.standard_normal((60, 2)))
    both, at = np.hstack([K.matrix.toarray(), A]), doubled(np.vstack([made.D * x.hi, made.R * lam.hi]))
    f, g = both @ at.hi, A.T @ at.hi[:16]  # so that little is left
    loads = [LoadCase(f[:, k], g[:, k]) for k in range(2)]
    load = made.load(loads)
    r, s = made.residuals(load, x, lam)
    for k, case in enumerate(loads):
        force = wanted_of(case.f[:, None], both, at[:, [k]], 0)
        gap = wanted_of(case.g[:, None], A.T, at[:16, [k]], 0)
        units = exactly(made.D[:, 0]), exactly(made.R[:, 0])
        assert max(missed(r, k, [d * v for d, v in zip(units[0], force, strict=True)])) <= 0
        assert max(missed(s, k, [d * v for d, v in zip(units[1], gap, strict=True)])) <= 0


def test_sums_come_with_their_roundings_and_corrections_without_loss() -> None:
    a, b = wild(np.random.default_rng(0), 2, 1000)
    for p, q, value, rounding in zip(a, b, *two_sum(a, b), strict=True):
        assert Fraction(value) + Fraction(rounding) == Fraction(p) + Fraction(q)
    x = DoubleDouble(np.array([1.0]), np.array([1e-20])).plus(np.array([1e-17]))
    assert x.hi[0] == 1.0
    assert x.lo[0] == pytest.approx(1.001e-17, rel=1e-12)


def test_length_neither_under_nor_overflows() -> None:
    for scale in (2.0**-1070, 2.0**-600, 1.0, 2.0**600):
        v = np.array([3.0, 4.0]) * scale
        assert 5 * scale <= length(v) <= 5 * scale * (1 + 1e-15) + ETA
        np.testing.assert_array_equal(length(np.column_stack([v, 0 * v])), [length(v), 0.0])
    assert length(np.array([ETA, ETA])) >= 2 * ETA  # √2 η is no number
    for bad in (np.nan, np.inf):
        assert not np.isfinite(length(np.array([bad])))


def test_the_energy_is_no_less_whatever_is_rounded() -> None:
    """√(zᵀKz) = 5 for K = diag(1, 4) and z = (3, 2)."""
    units = Balanced.of(Prepared(Assembly(Stiffness.of(np.diag([1.0, 4.0])), sp.csc_array(np.eye(2)))))
    z = np.array([[3.0, 0.0], [2.0, 0.0]]) / units.D
    for scale in (1.0, 1e-200, 1e200):
        found = units.energy_norm(z * scale)
        assert 5 * scale <= found[0] <= 5.06 * scale
        assert found[1] == 0
    units.__dict__["stiffest"] = 2.0**60
    assert units.energy_norm(z)[0] >= np.sqrt(25 + gamma(4) * 2.0**60 * 25 / 4)


@pytest.mark.parametrize("kind", ["dense", "band"])
def test_residuals_that_have_moved(kind: str) -> None:
    """r − K dx − A dλ and s − Aᵀdx, of residuals that are uncertain themselves."""
    rng = np.random.default_rng(0)
    B, A = rng.standard_normal((9, 9)), rng.standard_normal((9, 5))
    K = B @ B.T + np.eye(9)
    K = K + K.T
    stored: Any = np.asfortranarray(K) if kind == "dense" else sp.csc_array(K)
    made = Balanced.of(Prepared(Assembly(Stiffness.of(stored), sp.csc_array(A))))
    dx, dlam, r, s = (rng.standard_normal((size, 1)) for size in (9, 5, 9, 5))
    both = np.vstack([np.hstack([K, A]), np.hstack([A.T, np.zeros((5, 5))])])
    units = np.vstack([made.D, made.R])
    step = doubled(units * np.vstack([dx, dlam]))
    wanted = wanted_of(np.vstack([r, s]) / units, both, step, 0)
    wanted = [Fraction(float(u)) * v for u, v in zip(units[:, 0], wanted, strict=True)]
    force, gap = made.moved(
        Enclosure(r, np.full_like(r, 1e-3)), Enclosure(s, np.full_like(s, 1e-4)), dx, dlam
    )
    assert max(missed(force, 0, wanted[:9])) <= Fraction(-99, 10**5)
    assert max(missed(gap, 0, wanted[9:])) <= Fraction(-99, 10**6)
    assert force.error.max() <= 1.02e-3
    assert gap.error.max() <= 1.02e-4
