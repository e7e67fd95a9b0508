"""The referee's search for the contact set ends: by pivoting, by its interior point, or when stopped."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small import make_load, make_prepared

from harness.measurement.row import _why_not_judged
from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.verification import principal_pivoting
from harness.verification.interior_point import interior_contact_set
from harness.verification.judge import Judgement
from harness.verification.principal_pivoting import contact_set
from harness.verification.reference import STOPPED, reference, refined_active_set
from harness.verification.reference_problem import reference_problem
from problems.forms.prepared import Prepared
from problems.scene import read_scene


def fathi(m: int) -> Prepared:
    made = read_scene(f"hard/pivoting/fathi-{m:03d}").made
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


def test_a_search_out_of_time_says_so_and_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path))
    made = read_scene("hard/pivoting/fathi-128").made
    data = Prepared(made.assembly)
    data.key = "fathi"
    stopped = reference(data, made.load, 1e-9)
    assert "stopped after 1e-09 s" in stopped.route
    x = np.asarray(made.x)
    assert abs(stopped.x - x).max() <= stopped.bound_mm  # wide or not, the bound holds
    found = reference(data, made.load)
    assert found.route.startswith("proven")
    assert found.bound_mm < 1e-12
    again = reference(data, made.load, 1e-9)
    assert (again.route, again.bound_mm) == (found.route, found.bound_mm)


def test_a_row_says_why_it_cannot_be_judged(tmp_path: Path) -> None:
    """The search is stopped at once: either the first set was right, or the rows say that it was stopped."""
    suite = tmp_path / "mine.toml"
    suite.write_text(
        'scenes = ["hard/pivoting/fathi-008"]\nreference_limit_s = 0.001\n[[solver]]\nname = "newton"\n'
    )
    assert read_suite(str(suite)).reference_limit_s == 0.001
    assert {m.reference_limit_s for m in expand(read_suite(str(suite)))} == {0.001}
    judgement = Judgement("cannot_be_judged", 1e-3)
    problem = reference_problem("hard/pivoting/fathi-008")
    wide = replace(problem, reference=replace(problem.reference, bound_mm=1e-3, route=f"proven, {STOPPED}"))
    assert _why_not_judged(judgement, wide) == f"reference error bound 1e-03 mm: proven, {STOPPED}"
    assert _why_not_judged(Judgement("within"), problem) is None


def test_the_interior_point_ends_where_its_products_underflow() -> None:
    """λ and y of 1e-200: their product is 0, and so is the duality gap."""
    Q, p = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([1e-200, -1e-200])
    assert interior_contact_set(Q, p, lambda: False).shape == (2,)
