"""The referee by products alone: K sparse, K⁻¹ by a sparse factor, no dense factor, inverse or Q."""

from functools import cached_property

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from small import make_load, make_prepared, make_strips, solve_by_nnls

from harness.verification.judge import judge
from harness.verification.reference import best_of_candidates
from problems.forms.assembly import Assembly, Matrix
from problems.forms.prepared import Prepared
from problems.stiffness.general import GeneralBlock
from problems.stiffness.operator import Stiffness


class BySolutions(GeneralBlock):
    """The same block by another library's factor; what is dense of order n or m fails the test."""

    def solve(self, b: Matrix) -> Matrix:
        x: Matrix = splu(sp.csc_matrix(self.matrix)).solve(np.asarray(b))
        return x


class ByProducts(Prepared):
    """The same assembly with sparse blocks."""

    def __init__(self, dense: Prepared) -> None:
        blocks = [BySolutions(sp.csc_array(K), len(K)) for K in dense.assembly.K.matrices]
        super().__init__(Assembly(Stiffness(blocks), dense.assembly.A))

    @cached_property
    def Q(self) -> Matrix:
        pytest.fail("a dense Q was asked for")


@pytest.mark.parametrize("dense", [make_prepared(1, 12), make_prepared(2, 20, 5), make_strips(150)])
def test_reference_and_judge_need_no_matrix(dense: Prepared) -> None:
    case, _ = make_load(3, dense)
    products = ByProducts(dense)
    known, usual = best_of_candidates(products, case), best_of_candidates(dense, case)
    x, lam = solve_by_nnls(dense, case)
    assert 0 < known.active.sum() < dense.assembly.m
    np.testing.assert_array_equal(known.active, usual.active)
    assert known.bound_mm <= 1e-12
    assert abs(known.x - usual.x).max() <= known.bound_mm + usual.bound_mm
    found, expected = (judge(data, case, known, x, lam, 1e-7) for data in (products, dense))
    assert found.verdict == expected.verdict == "within"
    assert found.backward_error == pytest.approx(expected.backward_error, rel=0.5, abs=1e-17)
    assert judge(products, case, known, x + 2e-7, lam, 1e-7).verdict == "outside"
