"""The pressure in the oil film of a journal bearing: nowhere negative.

    min ∫ ½ w(x)|∇v|² − ε sin(x) v,   v ≥ 0,   v = 0 on the edge of (0, 2π) × (0, 2b),   w = (1 + ε cos x)³

G. Cimatti, Appl. Math. Optim. 3:227–242 (1977); Averick, Carter, Moré and Xue, The MINPACK-2 Test Problem
Collection, ANL/MCS-P153-0692 (1992), with ε = 0.1 and b = 10. Linear triangles; the mean of w over a triangle
is that of its corners. With an even number of cells, sin(x) = 0 on the line in the middle: the contacts there
carry hardly any force.
"""

from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.model.scene import ManufacturedProblem, PrintedOptimum

from . import Ladder, Scene
from .membranes import bounded, membrane, nodes, second_difference

HALF_WIDTH = 10.0  # b
CUTEST = {10: -0.1789600, 23: -0.1800500, 32: -0.1803000, 75: -0.1805500, 100: -0.1805700, 125: -0.1805800}
PETSC = {  # inner nodes in x and y, ε, optimum, its digits
    "8x12": (8, 12, 0.1, PrintedOptimum(-0.183437, 6, "PETSc/TAO, jbearing2_1.out")),
    "10x16": (10, 16, 0.9, PrintedOptimum(-15.607, 5, "PETSc/TAO, jbearing2_3.out")),
    "50x50": (50, 50, 0.99, PrintedOptimum(-60.1509, 6, "PETSc/TAO, jbearing2_2.out")),
}


def problem(nx: int, ny: int, eccentricity: float) -> ManufacturedProblem:
    """With nx × ny inner nodes."""
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


def _rung(nx: int, ny: int, eccentricity: float = 0.1, printed: PrintedOptimum | None = None) -> Scene:
    title = f"Journal bearing, {nx + 1} × {ny + 1} cells, eccentricity {eccentricity:g}"
    return membrane(title, nx * ny, partial(problem, nx, ny, eccentricity), printed=printed)


OUTSIDE: dict[str, Ladder] = {
    "journal_bearing": {
        **{f"{cells}": partial(_rung, cells - 1, cells - 1) for cells in (20, 40, 80, 160, 320)},
        **{
            f"cutest-{side}": partial(
                _rung, side - 2, side - 2, printed=PrintedOptimum(value, 5, "CUTEst, JNLBRNG1.SIF")
            )
            for side, value in CUTEST.items()
        },
        **{f"petsc-{name}": partial(_rung, *given) for name, given in PETSC.items()},
    }
}
