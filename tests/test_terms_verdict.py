"""Terms of the judge's verdict and the solvers' KKT residual, each where it dominates.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from springs import array, diagonal

from harness.verification.judge import REFERENCE_SHARE, judge
from harness.verification.reference import Reference, proven_lambda_min
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness
from solvers.kkt import EPS, kkt_status


@pytest.mark.parametrize(("bound", "verdict"), [(0.999e-8, "within"), (1.001e-8, "cannot_be_judged")])
def test_judge_a_reference_may_be_off_by_a_tenth_of_the_limit(bound: float, verdict: str) -> None:
    prepared, load = Prepared(diagonal(1.0)), LoadCase(array(1.0), array(10.0))
    known = Reference(array(1.0), array(0.0), np.zeros(1, dtype=bool), bound, "by hand")
    assert judge(prepared, load, known, array(1.0), array(0.0), 1e-7).verdict == verdict
    assert REFERENCE_SHARE == 0.1


@pytest.mark.parametrize(
    ("lam", "y", "residual_mm"),
    [
        ([0.0, 0.0], [-1e-3, 5.0], 1e-3),  # an overlap of an open contact
        ([2.0, 0.0], [1e-3, 5.0], 1e-3),  # a gap of a closed one
        ([2.0, 0.0], [-2e-3, -1e-3], 2e-3),
        ([0.0, 3.0], [7.0, -1e-12], 1e-12),
    ],
)
def test_kkt_residual_is_overlap_or_gap_of_a_closed_contact(
    lam: list[float], y: list[float], residual_mm: float
) -> None:
    Q, p = np.eye(2), array(1.0, 1.0)
    for tolerance, status in ((1.01 * residual_mm, "solved"), (0.99 * residual_mm, "inaccurate")):
        found = kkt_status(Q, p, array(*lam), array(*y), tolerance)
        assert found == (status, residual_mm)


def test_kkt_residual_within_rounding_is_solved() -> None:
    """4ε max(|p| + |Q|λ), where |p| = |Q|λ = 1e6: half of it is due to each."""
    Q, p, lam = np.eye(1) * 1e3, array(1e6), array(1e3)
    for share, status in ((0.99, "solved"), (1.01, "inaccurate")):
        y = array(share * 4 * EPS * 2e6)
        assert kkt_status(Q, p, lam, y, 0.0)[0] == status


def test_reference_takes_the_least_proven_eigenvalue_of_the_parts() -> None:
    class Overestimated(Prepared):
        facts = {"lambda_min": 3.0}  # noqa: RUF012

    blocks = (np.full((1, 1), 4.0), np.full((1, 1), 1.0))
    assembly = Assembly(Stiffness.of(*blocks), sp.csc_array(np.eye(2)))
    assert 0.8 <= proven_lambda_min(Prepared(assembly)) < 1.0
    assert 0.2 <= proven_lambda_min(Overestimated(assembly)) < 1.0


@pytest.mark.parametrize("known", [False, True], ids=["computed", "from the facts"])
def test_reference_proves_each_part_by_its_own_eigenvalue(known: bool) -> None:
    """λmin of the soft part, 1, is far below the rounding of the stiff one, 1e16 to 1e18."""

    class Factored(Prepared):
        facts = {"lambda_min": 1.0, "cond_blocks": [100.0, 100.0]}  # noqa: RUF012

    soft = np.diag([1.0, 10.0, 100.0])
    assembly = Assembly(Stiffness.of(soft, 1e16 * soft), sp.csc_array(np.eye(6)))
    assert 0.8 <= proven_lambda_min((Factored if known else Prepared)(assembly)) < 1.0
