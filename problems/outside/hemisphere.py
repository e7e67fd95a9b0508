"""A membrane over a hemisphere, a free boundary in closed form.

On (−2, 2)², v ≥ ψ = √(1 − r²) where r < 1, and v = u on the edge, with the radial solution

    u = ψ for r ≤ a,   u = A log(2/r) for r > a,   a² (log 2 − log a) = 1 − a²,   A = a²/√(1 − a²)

of E. Bueler, PETSc, src/snes/tutorials/ex9.c. Contacts are the nodes with r < 1; beyond, u is above ψ.

The unknowns are x = v − w, where w is the membrane without the hemisphere, so that f = 0; the objective is
the energy that the hemisphere adds.
"""

from functools import partial

import numpy as np
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve

from problems.forms.assembly import Matrix, Vector
from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.ladder import Ladder, Scene
from problems.manufactured.membrane import bounded, five_point, membrane, nodes

FREE = float(brentq(lambda a: a**2 * np.log(2 / a) - 1 + a**2, 0.5, 0.9, xtol=1e-15))  # a


def exact(at: Matrix) -> Vector:
    """u at points (n, 2)."""
    r = np.hypot(*at.T)
    inside = np.sqrt(np.maximum(1 - r**2, 0.0))
    return np.where(r <= FREE, inside, FREE**2 / np.sqrt(1 - FREE**2) * np.log(2 / np.maximum(r, FREE)))


def _lines(cells: int) -> Vector:
    return np.linspace(-2.0, 2.0, cells + 1)


def alone(cells: int) -> Vector:
    """w at the inner nodes: the membrane without the hemisphere."""
    line, size = _lines(cells), cells - 1
    f = np.zeros((size, size))
    for edge in (0, -1):
        beyond = exact(np.column_stack([np.full(size, line[edge]), line[1:-1]]))
        f[edge] += beyond
        f[:, edge] += beyond
    return np.asarray(spsolve(five_point(size), f.ravel()))


def _rung(cells: int) -> Scene:
    line = _lines(cells)[1:-1]
    at = nodes(line, line)
    covered = np.flatnonzero((at**2).sum(axis=1) < 1)

    def make() -> ManufacturedProblem:
        lowest = np.sqrt(1 - (at[covered] ** 2).sum(axis=1)) - alone(cells)[covered]
        return bounded(five_point(line.size), np.zeros(len(at)), at, -1.0, lowest, covered)

    return membrane(f"A membrane over a hemisphere, {cells} × {cells} cells", len(at), make, len(covered))


RUNGS: dict[str, Ladder] = {
    "hemisphere": {f"{cells}": partial(_rung, cells) for cells in (8, 20, 40, 80, 160, 320)}
}
