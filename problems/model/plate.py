"""A rectangular Kirchhoff plate of Bogner–Fox–Schmit elements on a tensor mesh.

Four degrees of freedom per node: w, w_x, w_y, w_xy. The shape functions are products of cubic
Hermite functions, so the stiffness is a sum of Kronecker products of one-dimensional matrices:

    K = D [My⊗Hx + Hy⊗Mx + ν (By⊗Bxᵀ + Byᵀ⊗Bx) + 2(1−ν) Gy⊗Gx],   D = E t³ / (12 (1 − ν²))

Source: Bogner, Fox, Schmit, Proc. Conf. Matrix Methods in Struct. Mech., 1965. On a line each node
carries two degrees of freedom, value and derivative, numbered 2i and 2i + 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded_types import Range

WHOLE: Range = -np.inf, np.inf
LineLoads = tuple[Vector, Vector]


@dataclass(frozen=True)
class Plate:
    """The mesh and the material of one part.

    x (nx,), y (ny,) : mesh lines in mm, ascending. thickness in mm, young in N/mm².
    Degree of freedom (iy, b, ix, a) has the index ((2 iy + b) nx + ix) 2 + a, where a and b count
    the derivatives along x and y: the lines y = const are contiguous.
    """

    x: Vector
    y: Vector
    thickness: float
    young: float
    poisson: float

    @property
    def size(self) -> int:
        return 4 * len(self.x) * len(self.y)

    @property
    def bounds(self) -> Matrix:
        """(2, 2) the lower and the upper corner, mm."""
        return np.array([[self.x[0], self.y[0]], [self.x[-1], self.y[-1]]])

    def covers(self, x: float, y: float) -> bool:
        """Whether a point is on the part, its border included."""
        return bool(self.x[0] <= x <= self.x[-1] and self.y[0] <= y <= self.y[-1])

    @property
    def rigidity(self) -> float:
        """D = E t³ / (12 (1 − ν²)), N·mm."""
        return self.young * self.thickness**3 / (12 * (1 - self.poisson**2))

    def stiffness(self, x: Range = WHOLE, y: Range = WHOLE) -> sp.csr_array:
        """The bending stiffness (size, size), N/mm and N, of the free plate within the ranges.

        All terms have the same nonzero entries, those of nodes of a common element. Their sum is therefore
        formed on the values alone, an entry of a one-dimensional matrix along y at a time. It is symmetric to
        the last bit.
        """
        X, Y = line_matrices(self.x, *x), line_matrices(self.y, *y)
        D, nu = self.rigidity, self.poisson
        x_B, y_B = X.B.data, Y.B.data
        x_Bt, y_Bt = (sp.csr_array(B.T).data for B in (X.B, Y.B))
        x_counts, y_counts = np.diff(X.M.indptr), np.diff(Y.M.indptr)
        indptr = np.cumsum(np.append(0, np.outer(y_counts, x_counts)), dtype=np.int32)
        values, columns = np.empty(indptr[-1]), np.empty(indptr[-1], dtype=np.int32)
        # Of the entries of a row (y, x), those of an entry of row y are consecutive, as many as row x has.
        x_row, x_first = _row_numbers(X.M), np.arange(X.M.nnz) - X.M.indptr[_row_numbers(X.M)]
        y_row, y_first = _row_numbers(Y.M), np.arange(Y.M.nnz) - Y.M.indptr[_row_numbers(Y.M)]
        width, counts = X.M.shape[0], x_counts[x_row]
        for k, (row, first) in enumerate(zip(y_row, y_first, strict=True)):
            place = indptr[row * width + x_row] + first * counts + x_first
            values[place] = D * (
                Y.M.data[k] * X.H.data
                + Y.H.data[k] * X.M.data
                + nu * (y_B[k] * x_Bt + y_Bt[k] * x_B)
                + 2 * (1 - nu) * Y.G.data[k] * X.G.data
            )
            columns[place] = Y.M.indices[k] * width + X.M.indices
        return sp.csr_array((values, columns, indptr), shape=(self.size, self.size))

    def evaluate(self, x: float, y: float, dx: int = 0, dy: int = 0) -> sp.csr_array:
        """The row vector e (1, size) with e·(degrees of freedom) = deflection at a point, or a derivative."""
        return sp.kron(evaluate(self.y, y, dy), evaluate(self.x, x, dx)).tocsr()

    def beams(
        self, lines: Sequence[float], inertia: float, torsion: float, along_x: bool, ends: Range = WHOLE
    ) -> sp.csr_array:
        """The stiffness of beams along x, or y, on each of the lines, between two ends.

        Σ EI ∫ w_ss² ds + GJ ∫ w_xy² ds with s along the beam; inertia I and torsion J in mm⁴.
        """
        own, other = (self.x, self.y) if along_x else (self.y, self.x)
        line = line_matrices(own, *ends)
        e, slope = (sp.vstack([evaluate(other, each, d) for each in lines]) for d in (0, 1))
        EI, GJ = self.young * inertia, self.young / (2 * (1 + self.poisson)) * torsion
        terms = (EI, (e.T @ e, line.H)), (GJ, (slope.T @ slope, line.G))
        return sum(factor * sp.kron(*(pair if along_x else pair[::-1])) for factor, pair in terms).tocsr()

    def line_dofs(self, line: int) -> np.ndarray:
        """The 4 nx degrees of freedom on the mesh line y[line]."""
        width = 4 * len(self.x)
        return np.arange(line * width, (line + 1) * width)

    def deflection_dofs(self, line: int) -> np.ndarray:
        """The nx deflections on the mesh line y[line], in order of ascending x."""
        return 4 * len(self.x) * line + 2 * np.arange(len(self.x))


def _row_numbers(M: sp.csr_array) -> np.ndarray:
    """The row of each stored entry."""
    return np.repeat(np.arange(M.shape[0], dtype=M.indices.dtype), np.diff(M.indptr))


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
    first = np.clip(grid[:-1], start, stop)
    length = np.clip(grid[1:], start, stop) - first

    dofs = 2 * elements[:, None] + np.arange(4)
    rows = np.repeat(dofs, 4, axis=1).ravel()
    columns = np.tile(dofs, 4).ravel()
    entries = np.zeros((4, len(elements), 4, 4))
    for point, weight in zip(points, weights, strict=True):
        t = (first + length * (1 + point) / 2 - grid[:-1]) / h
        phi, slope, curvature = (shape(t, h, d).T for d in range(3))
        w = (weight * length / 2)[:, None, None]
        for k, (u, v) in enumerate([(phi, phi), (slope, slope), (curvature, curvature), (curvature, phi)]):
            entries[k] += w * (u[:, :, None] * v[:, None, :])  # symmetric to the last bit if u is v

    def assemble(values: Matrix) -> sp.csr_array:
        return sp.coo_array((values.ravel(), (rows, columns)), shape=(size, size)).tocsr()

    return LineMatrices(*(assemble(values) for values in entries))


def evaluate(grid: Vector, at: float, derivative: int = 0) -> sp.csr_array:
    """The row vector e (1, 2N) with e·(degrees of freedom) = the field at a point, or its derivative."""
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
