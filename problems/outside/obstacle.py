"""A membrane pulled down on an obstacle, problem A of Dembo and Tulowitzki.

    min ∫ ½|∇v|² − v,   v ≥ sin(3.2 x) sin(3.3 y),   v = 0 on the edge of the unit square

R. Dembo and U. Tulowitzki, On the minimization of quadratic functions subject to box constraints, Yale
University (1983); J. Moré and G. Toraldo, SIAM J. Optim. 1:93–113 (1991). Linear triangles. The bound
v ≤ 2000 is never active. Near the corner (1, 1) the obstacle is above zero and the edge is not: the energy of
that step grows as 1/h, so that there is no limit under refinement.

CUTEst's OBSTCLAE sums over the four differences of each inner node, so that those to the edge count half.
"""

from functools import partial

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.manufactured.ladder import Ladder
from problems.manufactured.membrane import unit_square
from problems.model.scene import PrintedOptimum

CUTEST = {4: 0.753659753, 10: 1.397897560, 23: 1.678027027, 32: 1.748270031}  # nodes a side, edges included


def _obstacle(line: Vector) -> Matrix:
    return np.outer(np.sin(3.2 * line), np.sin(3.3 * line))


_rung = partial(unit_square, "A membrane on an obstacle", 1.0, -1.0, _obstacle)

RUNGS: dict[str, Ladder] = {
    "obstacle": {
        **{f"{cells}": partial(_rung, cells) for cells in (20, 40, 80, 160, 320)},
        **{
            f"cutest-{side}": partial(_rung, side - 1, 0.5, PrintedOptimum(value, 9, "CUTEst, OBSTCLAE.SIF"))
            for side, value in CUTEST.items()
        },
    }
}
