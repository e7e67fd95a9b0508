"""Goldfarb–Idnani: its pivots, and its answers on both forms."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from small_problems import by_nnls, definite, make_load, make_prepared, solve_by_nnls

from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.stiffness.operator import Stiffness
from solvers.algorithms.goldfarb_idnani import goldfarb_idnani
from solvers.base import Answer
from solvers.methods.gi import GoldfarbIdnani


@pytest.mark.parametrize("seed", range(6))
def test_pivots_lead_to_the_solution(seed: int) -> None:
    size = [3, 40, 150][seed % 3]
    G = definite(size, seed)
    s0 = np.random.default_rng(seed).standard_normal(size)

    result = goldfarb_idnani(G, lambda u: (s0 + G @ u, abs(s0)), 1e-12, 1000)
    s = s0 + G @ result.u

    assert result.status == "solved"
    assert (result.u >= 0).all()
    assert s.min() >= -1e-10
    assert abs(s[result.active]).max(initial=0) <= 1e-10
    np.testing.assert_allclose(result.u, by_nnls(G, -s0), atol=1e-9)
    assert result.pivots == len(result.active) + 2 * result.drops


def test_the_limit_on_pivots_is_kept_and_reported() -> None:
    G = definite(50, seed=4)
    result = goldfarb_idnani(G, lambda u: (-np.ones(50) + G @ u, np.ones(50)), 1e-12, 5)
    assert result.status == "iteration_limit"
    assert result.pivots == 5


def test_duplicate_contacts_do_not_hinder_the_primal_form() -> None:
    """A spring of 1 N/mm pulled by 1 N towards two stops at 0.5 and 0.25 mm: x = 0.25 mm, λ = (0, 0.75) N."""
    A = sp.csc_array(np.array([[1.0, 1.0]]))
    prepared = Prepared(Assembly(Stiffness.of(np.eye(1)), A), np.ones((2, 2)))
    case, solver = LoadCase(np.array([1.0]), np.array([0.5, 0.25])), GoldfarbIdnani()
    answer = solver.solve(solver.prepare(in_form(prepared, "primal")), case, 1e-10)
    assert answer.status == "solved"
    assert (answer.x, answer.lam) == (pytest.approx([0.25]), pytest.approx([0.0, 0.75]))


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_block_pivoting_finishes_what_an_inaccurate_inverse_misleads(noise: float) -> None:
    prepared = make_prepared(3, 40)
    case, load = make_load(3, prepared)
    solver = GoldfarbIdnani()
    ready = solver.prepare(in_form(prepared, "dual"))
    assert not isinstance(ready, Answer)
    rough = np.random.default_rng(0).uniform(1 - noise, 1 + noise, ready.G.shape)
    answer = solver.solve(replace(ready, G=np.asfortranarray(ready.G * (rough + rough.T) / 2)), load, 1e-10)
    assert answer.status == "solved"
    assert ("finishing_sets" in answer.details) is (noise > 0)
    np.testing.assert_allclose(answer.lam, solve_by_nnls(prepared, case)[1], atol=1e-6)
