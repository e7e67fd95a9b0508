"""The referee's search for the contact set ends: by pivoting, by its interior point, or when stopped."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small import make_load, make_prepared

from harness.verification import principal_pivoting
from harness.verification.interior_point import interior_contact_set
from harness.verification.principal_pivoting import contact_set
from harness.verification.reference import refined_active_set
from problems.forms.prepared import Prepared
from problems.manufactured.ladder import make_rung


def fathi(m: int) -> Prepared:
    made = make_rung(f"hard/pivoting/fathi-{m:03d}").made
    assert made is not None
    return Prepared(made.assembly)


@pytest.mark.parametrize("m", [32, 64, 128, 256])
def test_an_exponential_family_takes_few_factorisations(m: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Single exchanges alone visited 2^(m/2) or so sets: more than 20 s at m = 48."""
    solve, calls = principal_pivoting._solve_for, itertools.count()

    def counted(*arguments: object) -> object:
        assert next(calls) < 200
        return solve(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(principal_pivoting, "_solve_for", counted)
    Q, p = fathi(m).Q, np.ones(m)
    for order in (np.arange(m), np.arange(m)[::-1], np.random.default_rng(m).permutation(m)):
        found = contact_set(Q[np.ix_(order, order)], p, p > 0)
        assert order[found].tolist() == [0]


def test_the_interior_point_is_what_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def noted(*arguments: object) -> object:
        asked.append(True)
        return interior_contact_set(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(principal_pivoting, "interior_contact_set", noted)
    contact_set(fathi(64).Q, np.ones(64), np.ones(64, dtype=bool))
    assert len(asked) == 1


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), pairs=st.integers(1, 30), tools=st.integers(0, 8))
def test_the_interior_point_finds_the_set_of_the_refined_answer(seed: int, pairs: int, tools: int) -> None:
    """Where every contact is clearly closed or open; in any units of force and length."""
    prepared = make_prepared(seed, pairs, tools)
    case, load = make_load(seed + 1, prepared)
    known = refined_active_set(prepared, case)
    y = prepared.Q @ known.lam - load.p
    clear = np.maximum(known.lam * np.diag(prepared.Q), y) > 1e-9 * abs(load.p).max()
    for scale in (1.0, 2.0**60, 2.0**-60):
        found = interior_contact_set(prepared.Q, load.p * scale)
        np.testing.assert_array_equal(found[clear], known.active[clear])


def test_degenerate_contacts_end_the_interior_point() -> None:
    """λ = y = 0 at every contact but one: any set of them is right."""
    prepared = make_prepared(3, 20)
    lam = np.zeros(20)
    lam[4] = 50.0
    found = interior_contact_set(prepared.Q, prepared.Q @ lam)
    assert found[4]


def test_a_stopped_search_returns_at_once() -> None:
    calls = itertools.count()
    found = contact_set(fathi(64).Q, np.ones(64), np.ones(64, dtype=bool), lambda: next(calls) >= 3)
    assert next(calls) <= 6
    assert found.shape == (64,)
