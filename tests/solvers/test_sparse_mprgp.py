"""`mprgp` on the sparse form, where a product with Q is a solution with K's factors."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from small import make_load, make_strips, solve_by_nnls

from harness.solving.session import SolverSession
from harness.verification.reference import best_of_candidates
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.scene import read_scene
from problems.stiffness.operator import Stiffness
from solvers.base import Answer, WarmStart
from solvers.registry import make_solver

LIMIT_MM = 1e-7 / 4


def session_of(data: Prepared, **options: Any) -> SolverSession:
    made = SolverSession(make_solver("mprgp", options), in_form(data, "sparse"), 1e-10)
    made.open(batched=False)
    return made


def strips() -> tuple[Prepared, Prepared]:
    """Dense, and the same as sparse blocks."""
    dense = make_strips(150)
    blocks = tuple(sp.csc_array(K) for K in dense.assembly.K.matrices)
    return dense, Prepared(Assembly(Stiffness.of(*blocks), dense.assembly.A))


@pytest.mark.parametrize("kind", ["band", "face", "none"])
def test_cold_and_warm_are_the_answer_of_nnls(kind: str) -> None:
    dense, data = strips()
    first, _ = make_load(3, dense)
    second = LoadCase(first.f * 1.02, first.g)
    session = session_of(data, preconditioner=kind)
    cold = session.next(first, None)
    check(cold, dense, first)
    start = WarmStart(first, cold.lam, first.g - data.assembly.A.T @ cold.x, cold.x)
    warm = session.next(second, start)
    check(warm, dense, second)
    again = session_of(data, preconditioner=kind).next(second, None)
    assert warm.details["products"] <= again.details["products"]


def check(answer: Answer, dense: Prepared, load: LoadCase) -> None:
    x, lam = solve_by_nnls(dense, load)
    assert 0 < np.count_nonzero(lam) < len(lam)
    assert answer.status == "solved"
    np.testing.assert_allclose(answer.x, x, rtol=0, atol=LIMIT_MM)
    np.testing.assert_allclose(answer.lam, lam, rtol=0, atol=1e-5 * lam.max())


@pytest.mark.parametrize("name", ["4386/1471", "gallery/three-part-stack"])
def test_a_scene_in_a_few_products(name: str) -> None:
    scene = read_scene(name)
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    answer = session_of(data).next(load, None)
    assert answer.status == "solved"
    known = best_of_candidates(data, load, given=[answer.lam])
    assert known.bound_mm < LIMIT_MM
    assert abs(np.asarray(answer.x) - known.x).max() < LIMIT_MM
    assert answer.details["products"] <= 20


def test_contacts_all_over_an_area_are_refused_with_the_reason() -> None:
    """For them M would take longer than some factorisations of K; newton solves them with those."""
    scene = read_scene("outside/obstacle/80")
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    assert data.approximate_inverse.M is None
    answer = session_of(data).next(load, None)
    assert (answer.status, answer.lam) == ("failed", None)
    assert "all over an area" in answer.details["cause"]
