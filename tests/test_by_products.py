"""The referee by products alone: K sparse, K⁻¹ by a sparse factor, no dense factor, inverse or Q."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from small import make_load, make_prepared, make_strips, solve_by_nnls

from harness.verification.judge import judge
from harness.verification.reference import refined_active_set
from problems.forms.assembly import Assembly, Matrix
from problems.forms.compliance import Compliance
from problems.forms.prepared import Prepared


class ByProducts(Prepared):
    """The same assembly with sparse blocks; what is dense of order n or m fails the test."""

    def __init__(self, dense: Prepared) -> None:
        blocks = tuple(sp.csc_array(K) for K in dense.assembly.blocks)
        super().__init__(Assembly(blocks, dense.assembly.A))  # type: ignore[arg-type]
        self.splus = [splu(sp.csc_matrix(K)) for K in blocks]

    def solve_K(self, b: Matrix) -> Matrix:
        pairs = zip(self.splus, self.assembly.slices, strict=True)
        return np.concatenate([factor.solve(np.asarray(b[rows])) for factor, rows in pairs])

    @property
    def compliance(self) -> Compliance:
        return Compliance(self.solve_K, self.assembly.A)

    @cached_property
    def factors(self) -> tuple[Matrix, ...]:
        pytest.fail("a dense factor was asked for")

    @cached_property
    def Q(self) -> Matrix:
        pytest.fail("a dense Q was asked for")


@pytest.mark.parametrize("dense", [make_prepared(1, 12), make_prepared(2, 20, 5), make_strips(150)])
def test_reference_and_judge_need_no_matrix(dense: Prepared) -> None:
    case, _ = make_load(3, dense)
    products = ByProducts(dense)
    known, usual = refined_active_set(products, case), refined_active_set(dense, case)
    x, lam = solve_by_nnls(dense, case)
    assert 0 < known.active.sum() < dense.assembly.m
    np.testing.assert_array_equal(known.active, usual.active)
    assert known.bound_mm <= 1e-12
    assert abs(known.x - usual.x).max() <= known.bound_mm + usual.bound_mm
    found, expected = (judge(data, case, known, x, lam, 1e-7) for data in (products, dense))
    assert found.verdict == expected.verdict == "within"
    assert found.backward_error == pytest.approx(expected.backward_error, rel=0.5, abs=1e-17)
    assert judge(products, case, known, x + 2e-7, lam, 1e-7).verdict == "outside"
