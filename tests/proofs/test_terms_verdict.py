"""Terms of the judge's verdict and the solvers' KKT residual, each where it dominates.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification.judge import Reference, judge
from harness.verification.reference import proven_lambda_min
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness
from solvers.kkt import EPS, kkt_status


def array(*values: float) -> np.ndarray:
    return np.array(values, dtype=float)


@pytest.mark.parametrize(("bound", "verdict"), [(0.999e-8, "within"), (1.001e-8, "cannot_be_judged")])
def test_judge_a_reference_may_be_off_by_a_tenth_of_the_limit(bound: float, verdict: str) -> None:
    spring = Assembly(Stiffness.of(np.eye(1)), sp.csc_array(np.eye(1)))
    prepared, load = Prepared(spring), LoadCase(array(1.0), array(10.0))
    known = Reference(array(1.0), array(0.0), np.zeros(1, dtype=bool), bound, "by hand")
    assert judge(prepared, load, known, array(1.0), array(0.0), 1e-7).verdict == verdict


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


def test_kkt_residual_within_the_rounding_of_another_contact_is_not_solved() -> None:
    Q, p, lam = np.eye(2), array(1.0, -1e30), array(0.0, 0.0)
    assert kkt_status(Q, p, lam, Q @ lam - p, 1e-7) == ("inaccurate", 1.0)


@pytest.mark.parametrize("kind", [np.asfortranarray, sp.csc_array], ids=["dense", "sparse"])
def test_reference_proves_each_part_by_its_own_eigenvalue(kind: Callable[[np.ndarray], Any]) -> None:
    """λmin of one part is a hundredth of that of the other, whatever the stiffness of each."""
    soft = np.array([[1.0, 0.99], [0.99, 1.0]])
    for scale in (1.0, 2.0**60, 2.0**-60):
        for blocks in ((soft, scale * np.eye(2)), (scale * np.eye(2), soft), (scale * soft, np.eye(2))):
            assembly = Assembly(Stiffness.of(*map(kind, blocks)), sp.csc_array(np.eye(4)))
            assert 0.004 <= proven_lambda_min(Prepared(assembly)) < 0.0101
