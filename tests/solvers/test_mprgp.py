"""MPRGP: its steps, what they count, and where it starts."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from small_problems import make_load, make_strips, solve_by_nnls

from problems.forms import compliance
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.base import WarmStart
from solvers.methods.mprgp import PRECONDITIONERS, Mprgp

TOLERANCE = 1e-10
KINDS = pytest.mark.parametrize("preconditioner", PRECONDITIONERS)


@cache
def strips() -> tuple[Prepared, LoadCase, Vector, Vector]:
    """Contacts in a row, five windows of M long and more, nearly as many open as closed; and x and λ."""
    prepared = make_strips(400)
    _, load = make_load(3, prepared)
    return prepared, load, *solve_by_nnls(prepared, load)


def opened(preconditioner: str, prepared: Prepared) -> tuple[Mprgp, Any]:
    solver = Mprgp(preconditioner=preconditioner)
    return solver, solver.prepare(in_form(prepared, "dual"))


@KINDS
def test_the_products_that_are_told_are_those_made(
    preconditioner: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer is that of NNLS; and from its own few are left."""
    made, original = [], compliance.product

    def counted(Q: Any, v: Vector) -> Vector:
        made.append(1)
        return original(Q, v)

    monkeypatch.setattr(compliance, "product", counted)
    prepared, load, x, lam = strips()
    assert 0 < np.count_nonzero(lam) < len(lam)
    solver, state = opened(preconditioner, prepared)
    made.clear()
    answer = solver.solve(state, load, TOLERANCE)
    assert answer.status == "solved"
    assert answer.details["products"] == len(made) > 0
    np.testing.assert_allclose(prepared.recover(answer.lam, load), x, rtol=0, atol=1e-8)
    start = WarmStart(load, answer.lam, prepared.Q @ answer.lam - load.p)
    warm = solver.solve(solver.update(state, state, load, TOLERANCE, start), load, TOLERANCE)
    assert warm.status == "solved"
    assert warm.details["products"] <= min(5, answer.details["products"])
