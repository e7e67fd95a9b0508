"""A membrane pulled down on an obstacle, problem A of Dembo and Tulowitzki.

    min ∫ ½|∇v|² − v,   v ≥ sin(3.2 x) sin(3.3 y),   v = 0 on the edge of the unit square

R. Dembo and U. Tulowitzki, On the minimization of quadratic functions subject to box constraints, Yale
University (1983); J. Moré and G. Toraldo, SIAM J. Optim. 1:93–113 (1991). Linear triangles. The bound
v ≤ 2000 is never active. Near the corner (1, 1) the obstacle is above zero and the edge is not: the energy of
that step grows as 1/h, so that there is no limit under refinement.

CUTEst's OBSTCLAE sums over the four differences of each inner node, so that those to the edge count half.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.forms.assembly import Vector
from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.ladder import Ladder, Rung
from problems.manufactured.membrane import above, deferred, five_point, nodes
from problems.model.scene import PrintedOptimum

CELLS = (20, 40, 80, 160, 320)
CUTEST = {4: 0.753659753, 10: 1.397897560, 23: 1.678027027, 32: 1.748270031}  # nodes a side, edges included


def _problem(cells: int, edge: float) -> ManufacturedProblem:
    size, h = cells - 1, 1 / cells
    line: Vector = np.arange(1.0, size + 1) * h
    lowest = np.outer(np.sin(3.2 * line), np.sin(3.3 * line)).ravel()
    return above(five_point(size, edge), np.full(size**2, h**2), nodes(line, line), lowest)


def _rung(cells: int, edge: float = 1.0, printed: PrintedOptimum | None = None) -> Rung:
    title = f"A membrane on an obstacle, {cells} × {cells} cells"
    return Rung(title, made=deferred((cells - 1) ** 2, partial(_problem, cells, edge)), printed=printed)


RUNGS: Ladder = {
    **{f"{cells}": partial(_rung, cells) for cells in CELLS},
    **{
        f"cutest-{side}": partial(_rung, side - 1, 0.5, PrintedOptimum(value, 9, "CUTEst, OBSTCLAE.SIF"))
        for side, value in CUTEST.items()
    },
}
