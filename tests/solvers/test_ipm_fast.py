"""The fast interior-point method: its answers with each ingredient."""

import numpy as np
import pytest
from small import make_load, make_prepared, solve_by_nnls

from problems.errors import InputError
from problems.forms.problem import in_form
from solvers.methods.ipm_fast import FastIpm


@pytest.mark.parametrize("options", [{}, {"finish": False}, {"band": False}, {"start_at_gaps": False}])
@pytest.mark.parametrize("seed", range(3))
def test_answers_against_nnls(seed: int, options: dict[str, bool]) -> None:
    prepared = make_prepared(seed, 5 + 6 * seed, tools=seed % 3)
    case, load = make_load(seed, prepared)
    solver = FastIpm(**options)
    answer = solver.solve(solver.prepare(in_form(prepared, "dual")), load, 1e-11)
    x, _ = solve_by_nnls(prepared, case)
    assert answer.status == "solved"
    assert (answer.lam >= 0).all()
    np.testing.assert_allclose(prepared.recover(answer.lam, case), x, atol=1e-9)


def test_the_finish_saves_newton_matrices() -> None:
    prepared = make_prepared(3, 60)
    _, load = make_load(3, prepared)
    counts = {}
    for finish in (True, False):
        solver = FastIpm(finish=finish)
        counts[finish] = solver.solve(solver.prepare(in_form(prepared, "dual")), load, 1e-11).iterations
    assert counts[True] < counts[False]


def test_all_invalid_options_are_named() -> None:
    with pytest.raises(InputError, match=r"finish(.|\n)*band"):
        FastIpm(finish="no", band=2)  # type: ignore[arg-type]
