"""Problems that others wrote, with printed optima: membranes bounded by an obstacle, and an oil film.

On squares of two right triangles each, the stiffness of linear elements is the five-point stencil, free of h.

obstacle    min ∫ ½|∇v|² − v,   v ≥ sin(3.2 x) sin(3.3 y),   v = 0 on the edge of the unit square

Problem A of R. Dembo and U. Tulowitzki, On the minimization of quadratic functions subject to box
constraints, Yale University (1983); J. Moré and G. Toraldo, SIAM J. Optim. 1:93–113 (1991). The bound v ≤
2000 is never active. Near the corner (1, 1) the obstacle is above zero and the edge is not: the energy of
that step grows as 1/h, so that there is no limit under refinement.

torsion     min ∫ ½|∇v|² − c v,   |v(x)| ≤ dist(x, ∂Ω),   v = 0 on ∂Ω,   Ω = (0, 1)²,  c = 5

Elastic–plastic torsion of a square bar: the stress potential may not be steeper than the yield stress.
Averick, Carter, Moré and Xue, The MINPACK-2 Test Problem Collection, ANL/MCS-P153-0692 (1992); R. Glowinski,
Numerical Methods for Nonlinear Variational Problems (1984). Only v ≤ dist is stated: K is an M-matrix and c >
0, so that v is nowhere negative, and v ≥ −dist holds of itself. COPS (Dolan, Moré and Munson, ANL/MCS-TM-273,
2004) is the same on 51 × 51 cells.

hemisphere  a free boundary in closed form: on (−2, 2)², v ≥ ψ = √(1 − r²) where r < 1, and v = u on the edge,

    u = ψ for r ≤ a,   u = A log(2/r) for r > a,   a² (log 2 − log a) = 1 − a²,   A = a²/√(1 − a²)

from E. Bueler, PETSc, src/snes/tutorials/ex9.c. Contacts are the nodes with r < 1; beyond, u is above ψ. The
unknowns are x = v − w, where w is the membrane without the hemisphere, so that f = 0; the objective is the
energy that the hemisphere adds.

journal_bearing  the pressure in an oil film, nowhere negative: v = 0 on the edge of (0, 2π) × (0, 2b), and

    min ∫ ½ w(x)|∇v|² − ε sin(x) v,   v ≥ 0,   w = (1 + ε cos x)³

G. Cimatti, Appl. Math. Optim. 3:227–242 (1977); Averick, Carter, Moré and Xue, The MINPACK-2 Test Problem
Collection, ANL/MCS-P153-0692 (1992), with ε = 0.1 and b = 10. Linear triangles; the mean of w over a triangle
is that of its corners. With an even number of cells, sin(x) = 0 on the line in the middle: the contacts there
carry hardly any force.

CUTEst's OBSTCLAE and TORSION1 sum over the four differences of each inner node, so that those to the edge
count half.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy.sparse as sp
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve

from problems.forms.assembly import Assembly, Indices, LoadCase, Matrix, Vector
from problems.model.scene import ManufacturedProblem, ManufacturedScene, PrintedOptimum
from problems.stiffness.operator import Stiffness

from . import Ladder, Scene

Make = Callable[[], ManufacturedProblem]
CELLS = (20, 40, 80, 160, 320)
COUPLE = 5.0  # c: twice the angle of twist per length, in units of the yield stress
COPS = "COPS 3.0, torsion, nx = ny = 50 (as MadNLP/COPSBenchmark.jl quotes it)"
#: Nodes a side, edges included, and the optimum that CUTEst prints; its digits.
OBSTCLAE = {4: 0.753659753, 10: 1.397897560, 23: 1.678027027, 32: 1.748270031}, 9
TORSION1 = {4: -5.1851852e-1, 10: -4.9234185e-1, 22: -4.5608771e-1}, 8
JNLBRNG1 = {10: -0.17896, 23: -0.18005, 32: -0.1803, 75: -0.18055, 100: -0.18057, 125: -0.18058}, 5
HALF_WIDTH = 10.0  # b
PETSC = {  # inner nodes in x and y, ε, optimum, its digits
    "8x12": (8, 12, 0.1, PrintedOptimum(-0.183437, 6, "PETSc/TAO, jbearing2_1.out")),
    "10x16": (10, 16, 0.9, PrintedOptimum(-15.607, 5, "PETSc/TAO, jbearing2_3.out")),
    "50x50": (50, 50, 0.99, PrintedOptimum(-60.1509, 6, "PETSc/TAO, jbearing2_2.out")),
}
FREE = float(brentq(lambda a: a**2 * np.log(2 / a) - 1 + a**2, 0.5, 0.9, xtol=1e-15))  # a of the hemisphere


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
    """(n, 2) the crossings of the lines x and y, line x by line x."""
    X, Y = np.meshgrid(x, y, indexing="ij")
    return np.column_stack([X.ravel(), Y.ravel()])


def bounded(
    K: sp.csc_array, f: Vector, at: Matrix, sign: float, bound: Vector, held: Indices | None = None
) -> ManufacturedProblem:
    """A membrane with ±u ≤ ±`bound` at the unknowns `held`, by default all; each is a contact."""
    rows = np.arange(f.size) if held is None else held
    A = sp.csc_array((np.full(rows.size, sign), (rows, np.arange(rows.size))), shape=(f.size, rows.size))
    assembly = Assembly(Stiffness.of(K, nodes=at), A, at, ("membrane",))
    return ManufacturedProblem(assembly, LoadCase(f, sign * bound))


def membrane(
    title: str, size: int, make: Make, m: int | None = None, printed: PrintedOptimum | None = None
) -> Scene:
    """A rung of `size` unknowns with m contacts, by default one at each unknown, made when needed."""
    return ManufacturedScene("", title, make, (size,), m or size, sparse=True, printed=printed)


def _unit_square(
    title: str,
    load: float,
    sign: float,
    bound: Callable[[Vector], Matrix],
    cells: int,
    edge: float = 1.0,
    printed: PrintedOptimum | None = None,
) -> Scene:
    """A rung on the unit square: `load` per area, and ±u ≤ ±`bound` at the nodes of the inner lines."""
    size, h = cells - 1, 1 / cells

    def make() -> ManufacturedProblem:
        line: Vector = np.arange(1.0, cells) * h
        f = np.full(size**2, load * h**2)
        return bounded(five_point(size, edge), f, nodes(line, line), sign, bound(line).ravel())

    return membrane(f"{title}, {cells} × {cells} cells", size**2, make, printed=printed)


def _sines(line: Vector) -> Matrix:
    return np.outer(np.sin(3.2 * line), np.sin(3.3 * line))


def _distance(line: Vector) -> Matrix:
    """The distance from the nodes of the inner lines to the nearest edge."""
    to_edge = np.minimum(line, 1 - line)
    return np.minimum.outer(to_edge, to_edge)


def exact_membrane(at: Matrix) -> Vector:
    """u of the hemisphere at points (n, 2)."""
    r = np.hypot(*at.T)
    inside = np.sqrt(np.maximum(1 - r**2, 0.0))
    return np.where(r <= FREE, inside, FREE**2 / np.sqrt(1 - FREE**2) * np.log(2 / np.maximum(r, FREE)))


def bare_membrane(cells: int) -> Vector:
    """w at the inner nodes: the membrane without the hemisphere."""
    line, size = np.linspace(-2.0, 2.0, cells + 1), cells - 1
    f = np.zeros((size, size))
    for edge in (0, -1):
        beyond = exact_membrane(np.column_stack([np.full(size, line[edge]), line[1:-1]]))
        f[edge] += beyond
        f[:, edge] += beyond
    return np.asarray(spsolve(five_point(size), f.ravel()))


def _hemisphere(cells: int) -> Scene:
    line = np.linspace(-2.0, 2.0, cells + 1)[1:-1]
    at = nodes(line, line)
    covered = np.flatnonzero((at**2).sum(axis=1) < 1)

    def make() -> ManufacturedProblem:
        lowest = np.sqrt(1 - (at[covered] ** 2).sum(axis=1)) - bare_membrane(cells)[covered]
        return bounded(five_point(line.size), np.zeros(len(at)), at, -1.0, lowest, covered)

    return membrane(f"A membrane over a hemisphere, {cells} × {cells} cells", len(at), make, len(covered))


def journal_bearing(nx: int, ny: int, eccentricity: float) -> ManufacturedProblem:
    """The oil film with nx × ny inner nodes."""
    hx, hy = 2 * np.pi / (nx + 1), 2 * HALF_WIDTH / (ny + 1)
    w: Vector = (1 + eccentricity * np.cos(hx * np.arange(nx + 2))) ** 3
    # ∫w over the two triangles of a cell: two corners of one are on its left line, of the other on its right.
    left, right = hx * hy / 6 * (2 * w[:-1] + w[1:]), hx * hy / 6 * (w[:-1] + 2 * w[1:])
    along = (left + right) / hx**2  # of the differences in x, between lines
    across = (left[1:] + right[:-1]) / hy**2  # of those in y, on a line
    of_lines = sp.diags_array([-along[1:-1], along[:-1] + along[1:], -along[1:-1]], offsets=[-1, 0, 1])
    K = sp.kron(of_lines, sp.eye_array(ny)) + sp.kron(sp.diags_array(across), second_difference(ny))
    x: Vector = hx * np.arange(1.0, nx + 1)
    y: Vector = hy * np.arange(1.0, ny + 1)
    f = np.repeat(hx * hy * eccentricity * np.sin(x), ny)
    return bounded(sp.csc_array(K), f, nodes(x, y), -1.0, np.zeros(nx * ny))


def _bearing(nx: int, ny: int, eccentricity: float = 0.1, printed: PrintedOptimum | None = None) -> Scene:
    title = f"Journal bearing, {nx + 1} × {ny + 1} cells, eccentricity {eccentricity:g}"
    return membrane(title, nx * ny, partial(journal_bearing, nx, ny, eccentricity), printed=printed)


def _cutest(name: str, rung: Callable[..., Scene], optima: dict[int, float], digits: int) -> Ladder:
    """The rungs of a problem of CUTEst. rung : makes one of nodes a side and its optimum."""
    printed = {k: PrintedOptimum(value, digits, f"CUTEst, {name}.SIF") for k, value in optima.items()}
    return {f"cutest-{k}": partial(rung, k, optimum) for k, optimum in printed.items()}


_obstacle = partial(_unit_square, "A membrane on an obstacle", 1.0, -1.0, _sines)
_torsion = partial(_unit_square, "Elastic–plastic torsion", COUPLE, 1.0, _distance)

OUTSIDE: dict[str, Ladder] = {
    "hemisphere": {f"{cells}": partial(_hemisphere, cells) for cells in (8, *CELLS)},
    "journal_bearing": {
        **{f"{cells}": partial(_bearing, cells - 1, cells - 1) for cells in CELLS},
        **_cutest("JNLBRNG1", lambda k, optimum: _bearing(k - 2, k - 2, printed=optimum), *JNLBRNG1),
        **{f"petsc-{name}": partial(_bearing, *given) for name, given in PETSC.items()},
    },
    "obstacle": {
        **{f"{cells}": partial(_obstacle, cells) for cells in CELLS},
        **_cutest("OBSTCLAE", lambda k, optimum: _obstacle(k - 1, 0.5, optimum), *OBSTCLAE),
    },
    "torsion": {
        **{f"{cells}": partial(_torsion, cells) for cells in CELLS},
        "cops-50x50": partial(_torsion, 51, printed=PrintedOptimum(-4.18087e-1, 6, COPS)),
        **_cutest("TORSION1", lambda k, optimum: _torsion(k - 1, 0.5, optimum), *TORSION1),
    },
}
