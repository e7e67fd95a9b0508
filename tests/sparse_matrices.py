"""Random sparse matrices whose inverses and eigenvalues are those of their dense copies."""

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Matrix


def symmetric(random: np.random.Generator, rows: Matrix, columns: Matrix, n: int) -> sp.csc_array:
    """Entries of both signs, at (rows, columns) and (columns, rows); a dominant diagonal, mixed units."""
    apart = rows != columns
    off = sp.coo_array((random.uniform(-1, 1, apart.sum()), (rows[apart], columns[apart])), shape=(n, n))
    off = sp.csc_array(off + off.T)
    K = off + sp.diags_array(abs(off).sum(axis=0) + random.uniform(0.05, 1.0, n))
    unit = np.exp2(random.integers(-2, 3, n))
    return sp.csc_array(sp.diags_array(unit) @ K @ sp.diags_array(unit))


def band_matrix(random: np.random.Generator, n: int, half: int) -> sp.csc_array:
    """Positive definite, of that half-bandwidth or less."""
    rows, columns = np.nonzero(np.tril(np.ones((n, n)), 0) - np.tril(np.ones((n, n)), -half - 1))
    kept = random.random(len(rows)) < 0.7
    return symmetric(random, rows[kept], columns[kept], n)


def graph_matrix(random: np.random.Generator, n: int, degree: int = 4) -> sp.csc_array:
    """Positive definite, its entries anywhere: no numbering gives it a narrow band."""
    return symmetric(random, *random.integers(0, n, (2, n * degree // 2)), n)


def renumbered(K: sp.csc_array, order: Matrix) -> sp.csc_array:
    return sp.csc_array(K[order][:, order])


def chain(n: int) -> sp.csc_array:
    """n unknowns one after another with springs between them, held nowhere; its pivots are exact."""
    ends = np.array([1.0, *[2.0] * (n - 2), 1.0])
    return sp.csc_array(sp.diags_array([ends, -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]))
