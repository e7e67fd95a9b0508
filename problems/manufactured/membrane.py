"""Bound-constrained problems on a rectangular grid: a membrane of linear triangles, with its edges held.

On squares of two right triangles each, the stiffness of linear elements is the five-point stencil, free of h.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, Indices, LoadCase, Matrix, Vector
from problems.forms.manufactured_problem import DeferredProblem, ManufacturedProblem
from problems.model.scene import ManufacturedScene, PrintedOptimum
from problems.stiffness.operator import Stiffness

from .ladder import matrices


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


def bounded(
    K: sp.csc_array, f: Vector, at: Matrix, sign: float, bound: Vector, held: Indices | None = None
) -> ManufacturedProblem:
    """±u ≤ ±`bound` at the unknowns `held`, by default all: a contact each."""
    rows = np.arange(f.size) if held is None else held
    A = sp.csc_array((np.full(rows.size, sign), (rows, np.arange(rows.size))), shape=(f.size, rows.size))
    assembly = Assembly(Stiffness.of(K, nodes=at), A, at, ("membrane",))
    return ManufacturedProblem(assembly, LoadCase(f, sign * bound))


def membrane(
    title: str,
    size: int,
    make: Callable[[], ManufacturedProblem],
    m: int | None = None,
    printed: PrintedOptimum | None = None,
) -> ManufacturedScene:
    """A rung of `size` unknowns with m contacts, by default one at each unknown, made when needed."""
    return matrices(title, DeferredProblem((size,), m or size, make, sparse=True), printed=printed)


def unit_square(
    title: str,
    load: float,
    sign: float,
    bound: Callable[[Vector], Matrix],
    cells: int,
    edge: float = 1.0,
    printed: PrintedOptimum | None = None,
) -> ManufacturedScene:
    """A rung on the unit square: `load` per area, and ±u ≤ ±`bound` at the nodes of the inner lines."""
    size, h = cells - 1, 1 / cells

    def make() -> ManufacturedProblem:
        line: Vector = np.arange(1.0, cells) * h
        f = np.full(size**2, load * h**2)
        return bounded(five_point(size, edge), f, nodes(line, line), sign, bound(line).ravel())

    return membrane(f"{title}, {cells} × {cells} cells", size**2, make, printed=printed)
