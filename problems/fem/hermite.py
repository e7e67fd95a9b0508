"""Cubic Hermite functions on a line: the one-dimensional factors of the plate element.

Each grid point carries two degrees of freedom, value and derivative, numbered 2i and 2i + 1.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Matrix, Vector

LineLoads = tuple[Vector, Vector]


@dataclass(frozen=True)
class LineMatrices:
    """∫ over a line of products of the cubic Hermite functions φ and their derivatives, (2N, 2N).

    M = ∫φφ, G = ∫φ'φ', H = ∫φ''φ'', B = ∫φ''φ (the row carries the second derivative).
    """

    M: sp.csr_array
    G: sp.csr_array
    H: sp.csr_array
    B: sp.csr_array


def shape(t: Vector, h: Vector | float, derivative: int = 0) -> Matrix:
    """The four Hermite functions of an element of length h at t ∈ [0, 1], or their derivatives.

    Returns (4, len(t)): value and slope at the left end, value and slope at the right end.
    """
    zero, one = np.zeros_like(t), np.ones_like(t)
    if derivative == 0:
        rows = [1 - 3 * t**2 + 2 * t**3, h * t * (1 - t) ** 2, t**2 * (3 - 2 * t), h * t**2 * (t - 1)]
    elif derivative == 1:
        rows = [(6 * t**2 - 6 * t) / h, 3 * t**2 - 4 * t + 1, (6 * t - 6 * t**2) / h, 3 * t**2 - 2 * t]
    else:
        rows = [(12 * t - 6) / h**2, (6 * t - 4) / h, (6 - 12 * t) / h**2, (6 * t - 2) / h]
    return np.stack([row * one + zero for row in rows])


def line_matrices(grid: Vector, start: float = -np.inf, stop: float = np.inf) -> LineMatrices:
    """M, G, H, B on the grid, integrated over [start, stop] only.

    Four Gauss points on each (clipped) element integrate the products, of degree six, exactly.
    """
    size = 2 * len(grid)
    points, weights = np.polynomial.legendre.leggauss(4)
    elements = np.arange(len(grid) - 1)
    h = np.diff(grid)
    left = np.clip(grid[:-1], start, stop)
    length = np.clip(grid[1:], start, stop) - left

    dofs = 2 * elements[:, None] + np.arange(4)
    rows = np.repeat(dofs, 4, axis=1).ravel()
    columns = np.tile(dofs, 4).ravel()
    entries = np.zeros((4, len(elements), 4, 4))
    for point, weight in zip(points, weights, strict=True):
        t = (left + length * (1 + point) / 2 - grid[:-1]) / h
        phi, slope, curvature = (shape(t, h, d).T for d in range(3))
        w = (weight * length / 2)[:, None, None]
        for k, (u, v) in enumerate([(phi, phi), (slope, slope), (curvature, curvature), (curvature, phi)]):
            entries[k] += w * (u[:, :, None] * v[:, None, :])  # symmetric to the last bit if u is v

    def assemble(values: Matrix) -> sp.csr_array:
        return sp.coo_array((values.ravel(), (rows, columns)), shape=(size, size)).tocsr()

    return LineMatrices(*(assemble(values) for values in entries))


def evaluate(grid: Vector, at: float, derivative: int = 0) -> sp.csr_array:
    """Row vector e (1, 2N): e·(degrees of freedom) is the field, or its derivative, at a point."""
    element = int(np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2))
    h = grid[element + 1] - grid[element]
    values = shape(np.array([(at - grid[element]) / h]), h, derivative)[:, 0]
    keep = np.flatnonzero(values)
    return sp.csr_array((values[keep], (np.zeros_like(keep), 2 * element + keep)), shape=(1, 2 * len(grid)))


def line_loads(grid: Vector, start: float, stop: float) -> LineLoads:
    """∫φ and ∫φ'' over [start, stop], each (2N,): M and B applied to the function 1."""
    line = line_matrices(grid, start, stop)
    one = np.tile([1.0, 0.0], len(grid))
    return line.M @ one, line.B @ one
