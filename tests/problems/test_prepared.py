"""K⁻¹ through the Cholesky factors: one column or many, and refined only where the residual asks for it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from small import make_load, make_prepared

from problems.forms.assembly import LoadCase, Matrix
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness


class Counted(Stiffness):
    solves = 0

    def solve(self, b: Matrix) -> Matrix:
        self.solves += 1
        return super().solve(b)


@pytest.mark.parametrize("columns", [None, 1, 2, 7])
def test_one_column_as_many(columns: int | None) -> None:
    prepared = make_prepared(1, 20, tools=3)
    shape = (prepared.assembly.n,) if columns is None else (prepared.assembly.n, columns)
    b = np.random.default_rng(2).standard_normal(shape)
    K = sp.block_diag(prepared.assembly.K.matrices).toarray()
    np.testing.assert_allclose(prepared.assembly.K.solve(b), np.linalg.solve(K, b), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("error", "solves"), [(0.0, 1), (1e-7, 2)])
@pytest.mark.parametrize("block", [False, True])
def test_a_second_pass_only_where_the_first_leaves_a_residual(error: float, solves: int, block: bool) -> None:
    made = make_prepared(4, 20)
    case, _ = make_load(4, made)
    lam: Any = np.random.default_rng(5).random(made.assembly.m)
    K = sp.block_diag(made.assembly.K.matrices).toarray()
    wanted = np.linalg.solve(K, case.f - made.assembly.A @ lam)
    if block:
        case, lam = LoadCase(np.column_stack([case.f] * 2), case.g), np.column_stack([lam] * 2)
        wanted = np.column_stack([wanted] * 2)
    K_counted = Counted.of(*made.assembly.K.matrices)
    for block, U in zip(K_counted.blocks, made.assembly.K.factors, strict=True):
        block.U = U * (1 + error)  # type: ignore[attr-defined]
    prepared = Prepared(replace(made.assembly, K=K_counted))
    np.testing.assert_allclose(
        prepared.recover(lam, case), wanted, rtol=1e-10, atol=1e-12 * abs(wanted).max()
    )
    assert K_counted.solves == solves
