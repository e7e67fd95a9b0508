"""What the in-house methods say when they cannot solve a problem, or may not go on."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from small_problems import make_load, make_prepared, make_strips
from solver_forms import IN_HOUSE

from harness.solving.solver_session import SolverSession
from problems.forms.assembly import Assembly, DualLoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.stiffness.operator import Stiffness
from solvers.base import Answer, Form
from solvers.registry import make_solver


def answered(name: str, form: Form, prepared: Prepared, load: DualLoadCase, **options: Any) -> Answer:
    session = SolverSession(make_solver(name, options), in_form(prepared, form), 1e-10)
    session.open(batched=False)
    return session.next(load, None)


@pytest.mark.filterwarnings("ignore:invalid value encountered in sqrt")
@pytest.mark.parametrize(("name", "form"), IN_HOUSE)
def test_a_matrix_that_is_not_positive_definite_is_a_failure_that_says_so(name: str, form: Form) -> None:
    K, A = np.diag([1.0] * 9 + [-1.0]), sp.eye_array(10, 3, format="csc")
    if form == "sparse":
        prepared = Prepared(Assembly(Stiffness.of(sp.csc_array(K)), A))
    else:
        prepared = Prepared(Assembly(Stiffness.of(abs(K)), A), np.diag([1.0, -2.0, 3.0]))
    answer = answered(name, form, prepared, DualLoadCase(np.ones(10), np.zeros(3), np.ones(3)))
    assert (answer.status, answer.lam) == ("failed", None)
    assert "definite" in answer.details["cause"]


@pytest.mark.parametrize(
    ("name", "options", "limit", "cause"),
    [
        ("ipm", {"max_cg": 30}, {}, "max_cg = 30"),
        ("ipm", {}, {"methods.ipm.MAX_ITERATIONS": 2}, "2 iterations"),
        ("ipm-fast", {}, {"methods.ipm_fast.MAX_ITERATIONS": 2}, "2 iterations"),
        ("mprgp", {"preconditioner": "none"}, {"methods.mprgp.MAX_PRODUCTS": 3}, "3 products"),
        ("projected-gauss-seidel", {}, {"textbook.projected_gauss_seidel.MAX_SWEEPS": 3}, "3 sweeps"),
        ("textbook-active-set", {}, {"textbook.textbook_active_set.MAX_SETS": 1}, "1 sets"),
        ("l-bfgs-b", {}, {"textbook.l_bfgs_b.LIMIT": 3}, ""),
    ],
    ids=str,
)
def test_a_limit_that_was_reached_is_said(
    name: str, options: dict[str, Any], limit: dict[str, int], cause: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place, value in limit.items():
        monkeypatch.setattr(f"solvers.{place}", value)
    prepared = make_strips(400)
    answer = answered(name, "dual", prepared, make_load(3, prepared)[1], **options)
    assert answer.status == "iteration_limit"
    assert cause in answer.details.get("cause", "")


THROUGH_QPSOLVERS = ("scs", "qpalm")
#: With options of their own.
OPTIONS = {"mprgp": {"preconditioner": "none"}, "cvxpy for Clarabel": {"via": "CLARABEL"}}
SILENT = ("gi", "l-bfgs-b")
ITERATIVE = [
    *(
        "gi",
        "ipm",
        "ipm-fast",
        "mprgp",
        "newton",
        "projected-gauss-seidel",
        "textbook-active-set",
        "l-bfgs-b",
    ),
    *("clarabel", "cvxpy", "cvxpy for Clarabel", "osqp", "piqp", "proxqp", "scs", "qpalm"),
]


@pytest.mark.parametrize("name", ITERATIVE)
def test_a_solver_stops_after_the_iterations_that_are_allowed(
    name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    prepared = make_strips(400) if name == "newton" else make_prepared(4, 30, 5)
    solver = make_solver(name.partition(" ")[0], OPTIONS.get(name, {}))
    vars(solver).update(iteration_limit=1, prints=True)
    session = SolverSession(solver, in_form(prepared, "dual"), 1e-10)
    session.open(batched=False)
    answer = session.next(make_load(5, prepared)[1], None)
    assert answer.status == ("failed" if name in THROUGH_QPSOLVERS else "iteration_limit")
    assert answer.iterations == 1
    assert answer.lam is not None
    assert bool(capfd.readouterr().out) is (name not in SILENT)
