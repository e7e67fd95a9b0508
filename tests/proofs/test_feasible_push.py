"""Contacts that depend on one another: x against exact answers without the redundant rows, and its bound."""

from collections.abc import Iterator
from fractions import Fraction
from itertools import compress, product

import numpy as np
import pytest
import scipy.sparse as sp
from exact_answer import exact_optimum
from hypothesis import given, settings
from hypothesis import strategies as st

from harness import own_matrices, solve
from harness.verification.feasible_push import Push, nearly_closed
from harness.verification.reference import proof_of
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness

SMALL = 1e-10  # mm: of a bound


def definite(random: np.random.Generator, n: int) -> np.ndarray:
    """K (n, n) of small integers, λmin ≥ 1."""
    B = random.integers(-2, 3, (n, n))
    return (B @ B.T + np.eye(n)).astype(float)


@pytest.mark.parametrize(("factor", "bound_mm"), [(1.0, SMALL), (3.0, SMALL), (0.1, 1e-7)])
def test_a_contact_that_is_there_twice_leaves_x(factor: float, bound_mm: float) -> None:
    """A tenth of a gap is rounded: of the two, one is open by some 1e-18 mm."""
    random = np.random.default_rng(1)
    K, A, f, g = definite(random, 6), np.eye(6, 4), 10 * random.standard_normal(6), random.random(4) / 10
    once = solve(own_matrices(K, A, f, g))
    twice = solve(own_matrices(K, np.c_[A, factor * A], f, np.append(g, factor * g)))
    assert twice.choice.form == "sparse"
    assert any("λ are one choice of many" in note for note in twice.notes)
    assert abs(twice.x - once.x).max() <= twice.error_bound_mm + once.error_bound_mm <= bound_mm
    assert twice.lam.min() >= 0
    np.testing.assert_allclose(np.c_[A, factor * A] @ twice.lam, A @ once.lam, atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 4), st.booleans())
def test_redundant_rows_leave_x_and_no_bound_is_too_small(seed: int, more: int, tight: bool) -> None:
    """Rows z ≥ 0 of the others, with gaps that they allow, against rational numbers without them."""
    random, n, m = np.random.default_rng(seed), 5, 4
    K, A = definite(random, n), np.triu(random.integers(-2, 3, (n, m)), 1) + np.eye(n, m)
    f, g = random.integers(-20, 20, n).astype(float), random.integers(0, 3, m).astype(float)
    x, *_ = exact_optimum(Assembly(Stiffness.of(K), sp.csc_array(A)), LoadCase(f, g))
    z = random.integers(0, 3, (m, more)) + np.eye(m, more)
    added = 0.0 if tight else random.integers(0, 2, more)
    K, A, g = sp.csc_array(K), sp.csc_array(np.c_[A, A @ z]), np.append(g, g @ z + added)
    proof = proof_of(Prepared(Assembly(Stiffness.of(K), A)))
    load, answer = LoadCase(f, g), solve(own_matrices(K, A, f, g), form="sparse")
    assert answer.error_bound_mm <= SMALL
    for noise in (0.0, 1e-9, 1e-3, 1.0):
        lam = answer.lam * (1 + noise * random.random(m + more))
        (found,) = proof.proven([load], [lam])
        both = zip(found.x.hi, found.x.lo, x, strict=True)
        away = max(abs(Fraction(hi) + Fraction(lo) - value) for hi, lo, value in both)
        assert away <= found.bound_mm
        assert found.bound_mm <= SMALL or noise == 1


def orders(n: int, below: list[tuple[int, int]]) -> Iterator[frozenset[int]]:
    """The sets that hold with i all that is above it."""
    for bits in product((False, True), repeat=n):
        if all(bits[j] for i, j in below if bits[i]):
            yield frozenset(compress(range(n), bits))


@pytest.mark.parametrize("seed", range(4))
def test_regression_in_a_partial_order_is_the_max_of_min_of_means(seed: int) -> None:
    """x_i = max over upper sets U ∋ i of min over lower sets L ∋ i of the mean of y on L ∩ U (Robertson,
    Wright and Dykstra, Order Restricted Statistical Inference, 1988): pairs form cycles in the order."""
    random, n = np.random.default_rng(seed), 7
    below = [(i, j) for i in range(n) for j in range(i + 1, n) if random.random() < 0.5]
    y, w = random.integers(-9, 10, n), random.integers(1, 4, n)
    uppers = [*orders(n, below)]
    lowers = [frozenset(range(n)) - upper for upper in uppers]

    def mean(some: frozenset[int]) -> Fraction:
        return Fraction(int(sum(w[i] * y[i] for i in some)), int(sum(w[i] for i in some)))

    x = [
        max(min(mean(U & L) for L in lowers if i in L) for U in uppers if i in U)  #
        for i in range(n)
    ]
    A = np.zeros((n, len(below)))
    for k, (i, j) in enumerate(below):
        A[[i, j], k] = 1, -1
    answer = solve(own_matrices(np.diag(w), A, w * y, np.zeros(len(below))))
    assert np.linalg.matrix_rank(A) < len(below)
    assert max(abs(Fraction(a) - b) for a, b in zip(answer.x, x, strict=True)) <= answer.error_bound_mm
    assert answer.error_bound_mm <= SMALL


@pytest.mark.parametrize("lam", [0.0, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("overlap", [-0.25, 0.0, 1e-3, 0.5])
@pytest.mark.parametrize("slope", [0.5, 2.0])
def test_the_distance_holds_on_a_spring(lam: float, overlap: float, slope: float) -> None:
    """½kx² − fx, x ≤ 0, twice, at x = overlap with forces λ each: K x + 2λ = f, and p opens by `slope`."""
    k = 4.0
    f = k * overlap + 2 * lam
    away = k**0.5 * abs(overlap - min(f / k, 0.0))
    one = np.ones(2)
    for error in (0.0, 1e-2):
        push = Push(slope * one, error * one, k**0.5 * slope)
        found = push.distance(-(overlap - error) * one, error * one, lam * one)
        most = k * (abs(overlap) + 3 * error) ** 2 + 16 * lam * (abs(overlap) + 3 * error)
        assert away <= found <= 1.1 * most**0.5 + 1e-160
        theta, open_mm = max(overlap, 0.0) / (slope - error), abs(overlap - error) + error
        gap = lam * (open_mm + theta * (slope + error))  # of each of the two
        assert found >= (k * (theta * slope) ** 2 + 4 * gap) ** 0.5


def test_a_push_that_closes_another_contact_proves_nothing() -> None:
    for opening, s in (([1.0, -1.0], [-1.0, 0.5]), ([0.0, 1.0], [-1.0, 1.0]), ([-1.0, 1.0], [-1.0, 1.0])):
        push = Push(np.array(opening), np.zeros(2), 1.0)
        assert push.distance(np.array(s), np.zeros(2), np.ones(2)) == np.inf
    push, none = Push(np.array([1.0, -1.0]), np.zeros(2), 1.0), np.zeros(2)
    assert push.distance(np.array([-1.0, 1.1]), none, none) < 1.1
    np.testing.assert_array_equal(
        nearly_closed(np.array([-1e-9, 1e-6, 1.0, 1.0]), np.zeros(4), np.array([0.0, 0.0, 0.0, 1.0])),
        [True, True, False, True],
    )


@pytest.mark.parametrize("g", [(0.125, -0.125), (0.125, -0.25)])
def test_contacts_that_hold_each_other_closed_are_not_proven(g: tuple[float, float]) -> None:
    """An equation as two rows, and one that no x meets."""
    answer = solve(own_matrices(4 * np.eye(2), [[1.0, -1.0], [0.0, 0.0]], [1.0, 1.0], g))
    assert (answer.judgement.verdict, answer.error_bound_mm) == ("cannot_be_judged", np.inf)
