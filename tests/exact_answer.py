"""Answers without any rounding: that of a small problem, and whether a manufactured one's is optimal."""

from fractions import Fraction
from itertools import product
from math import lcm
from typing import Any

import numpy as np

from problems.forms.assembly import Assembly, LoadCase, Mask, Vector
from problems.model.scene import ManufacturedProblem

Exact = list[Fraction]


def exactly(v: Vector) -> Exact:
    return [Fraction(float(value)) for value in v]


def solve_exactly(M: list[Exact], b: Exact) -> Exact:
    """M x = b, M regular, by whole numbers (E. H. Bareiss, Math. Comput. 22:565–578, 1968)."""
    one = lcm(*(value.denominator for row in (*M, b) for value in row))
    rows = [[int(value * one) for value in (*row, right)] for row, right in zip(M, b, strict=True)]
    last = 1
    for j in range(len(rows)):
        pivot = next(i for i in range(j, len(rows)) if rows[i][j])
        rows[j], rows[pivot] = rows[pivot], rows[j]
        top = rows[j]
        for i in range(len(rows)):
            if i != j:
                factor = rows[i][j]
                rows[i] = [(top[j] * a - factor * c) // last for a, c in zip(rows[i], top, strict=True)]
        last = top[j]
    return [Fraction(row[-1], row[j]) for j, row in enumerate(rows)]


def exact_solution(assembly: Assembly, load: LoadCase, active: Mask) -> tuple[Exact, Exact, Exact]:
    """x, λ_C and the open gaps of the contact set, all exact for the given floating-point data."""
    K, A = assembly.K.matrix.toarray(), assembly.A.toarray()
    A_C = A[:, active]
    zero = np.zeros((A_C.shape[1],) * 2)
    M = [exactly(row) for row in np.block([[K, A_C], [A_C.T, zero]])]
    solution = solve_exactly(M, exactly(np.append(load.f, load.g[active])))
    x, lam = solution[: len(K)], solution[len(K) :]
    gaps = [
        Fraction(float(load.g[j])) - sum(a * b for a, b in zip(exactly(A[:, j]), x, strict=True))
        for j in np.flatnonzero(~active)
    ]
    return x, lam, gaps


def exact_optimum(assembly: Assembly, load: LoadCase, *first: Mask) -> tuple[Exact, Mask, Exact]:
    """x, the contact set and its λ: of `first`, or of all sets the first that is optimal."""
    every = map(np.array, product((False, True), repeat=assembly.m))
    for active in (*first, *every):
        x, lam, gaps = exact_solution(assembly, load, active.astype(bool))
        if min([*lam, *gaps], default=0) >= 0:
            return x, active.astype(bool), lam
    raise AssertionError("a strictly convex problem has an answer")


def whole(values: Any, one: int) -> Any:
    """Whole numbers that are `one` times the values."""
    ratios = [v.as_integer_ratio() for v in np.asarray(values, dtype=float).ravel().tolist()]
    assert not any(one % below for _, below in ratios)
    numbers = np.array([above * (one // below) for above, below in ratios], dtype=object)
    return numbers.reshape(np.shape(values))


def times(M: Any, v: Any, one: int) -> Any:
    """`one` times Mv, v of whole numbers."""
    rows, columns = np.nonzero(M)
    sums = np.zeros(len(M), dtype=object)
    np.add.at(sums, rows, whole(M[rows, columns], one) * v[columns])
    return sums


def is_exact(made: ManufacturedProblem) -> bool:
    """Kx + Aλ = f, K = Kᵀ, λ ≥ 0, y = g − Aᵀx ≥ 0 and λy = 0, in whole numbers."""
    K, A = made.assembly.K, made.assembly.A.toarray()
    others = made.x, made.lam, made.load.f, made.load.g
    numbers = np.concatenate([np.ravel(v) for v in (*K.matrices, A, *others)])
    one = 2 ** max(0, 53 - int(np.frexp(numbers[numbers != 0])[1].min()))  # of which all are multiples
    x, lam, f, g = (whole(values, one) for values in others)
    Kx = np.concatenate([times(M, x[rows], one) for M, rows in zip(K.matrices, K.slices, strict=True)])
    y = g * one - times(A.T, x, one)
    symmetric = all((M == M.T).all() for M in K.matrices)
    balanced = (Kx + times(A, lam, one) == f * one).all()
    return bool(symmetric and balanced and (lam >= 0).all() and (y >= 0).all() and not (lam * y).any())
