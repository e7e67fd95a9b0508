"""Bound-constrained problems on a rectangular grid: a membrane of linear triangles, with its edges held.

On squares of two right triangles each, the stiffness of linear elements is the five-point stencil, free of h.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.forms.manufactured_problem import DeferredProblem, ManufacturedProblem
from problems.stiffness.operator import Stiffness


def second_difference(size: int, edge: float = 1.0) -> sp.csc_array:
    """(size, size): 2 on the diagonal, −1 beside it. edge : the weight of the first and the last difference,
    those to the held edges.
    """
    diagonal = np.full(size, 2.0)
    diagonal[0] += edge - 1
    diagonal[-1] += edge - 1
    beside = np.full(size - 1, -1.0)
    return sp.csc_array(sp.diags_array([beside, diagonal, beside], offsets=[-1, 0, 1]))


def five_point(size: int, edge: float = 1.0) -> sp.csc_array:
    """K (size², size²) of a unit membrane on a square grid with `size` inner nodes a side."""
    T, one = second_difference(size, edge), sp.eye_array(size)
    return sp.csc_array(sp.kron(T, one) + sp.kron(one, T))


def nodes(x: Vector, y: Vector) -> Matrix:
    """(n, 2): the grid of the lines x and y, line x by line x."""
    X, Y = np.meshgrid(x, y, indexing="ij")
    return np.column_stack([X.ravel(), Y.ravel()])


def above(
    K: sp.csc_array, f: Vector, at: Matrix, lowest: Vector, held: NDArray[np.intp] | None = None
) -> ManufacturedProblem:
    """u ≥ `lowest` at the unknowns `held`, by default all: Aᵀ = −I there, g = −lowest."""
    return _bounded(K, f, at, -1.0, -lowest, held)


def below(K: sp.csc_array, f: Vector, at: Matrix, highest: Vector) -> ManufacturedProblem:
    """u ≤ `highest` at all unknowns."""
    return _bounded(K, f, at, 1.0, highest, None)


def _bounded(
    K: sp.csc_array, f: Vector, at: Matrix, sign: float, g: Vector, held: NDArray[np.intp] | None
) -> ManufacturedProblem:
    size = K.shape[0]
    rows = np.arange(size) if held is None else held
    A = sp.csc_array((np.full(rows.size, sign), (rows, np.arange(rows.size))), shape=(size, rows.size))
    return ManufacturedProblem(Assembly(Stiffness.of(K, nodes=at), A, at, ("membrane",)), LoadCase(f, g))


def deferred(size: int, make: Callable[[], ManufacturedProblem], m: int | None = None) -> DeferredProblem:
    """A problem of `size` unknowns in one block, with m contacts, by default one at each unknown."""
    return DeferredProblem((size,), size if m is None else m, make, sparse=True)
