"""Whether a manufactured problem's answer satisfies the optimality conditions, without any rounding."""

from typing import Any

import numpy as np

from problems.forms.manufactured_problem import ManufacturedProblem


def whole(values: Any, one: int) -> Any:
    """Whole numbers that are `one` times the values."""
    ratios = [v.as_integer_ratio() for v in np.asarray(values, dtype=float).ravel().tolist()]
    assert not any(one % below for _, below in ratios)
    numbers = np.array([above * (one // below) for above, below in ratios], dtype=object)
    return numbers.reshape(np.shape(values))


def is_exact(made: ManufacturedProblem, one: int) -> bool:
    """Kx + Aλ = f, K = Kᵀ, λ ≥ 0, y = g − Aᵀx ≥ 0 and λy = 0; every number is a multiple of 1/one."""
    K, (A, x, lam, f, g) = (
        made.assembly.K,
        (
            whole(values, one)
            for values in (made.assembly.A.toarray(), made.x, made.lam, made.load.f, made.load.g)
        ),
    )
    Kx = np.concatenate([whole(M, one) @ x[rows] for M, rows in zip(K.matrices, K.slices, strict=True)])
    y = g * one - A.T @ x
    symmetric = all((M == M.T).all() for M in K.matrices)
    balanced = (Kx + A @ lam == f * one).all()
    return bool(symmetric and balanced and (lam >= 0).all() and (y >= 0).all() and not (lam * y).any())
