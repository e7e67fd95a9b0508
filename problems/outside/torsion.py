"""Elastic–plastic torsion of a square bar: the stress potential may not be steeper than the yield stress.

    min ∫ ½|∇v|² − c v,   |v(x)| ≤ dist(x, ∂Ω),   v = 0 on ∂Ω,   Ω = (0, 1)²,  c = 5

Averick, Carter, Moré and Xue, The MINPACK-2 Test Problem Collection, ANL/MCS-P153-0692 (1992); R. Glowinski,
Numerical Methods for Nonlinear Variational Problems (1984). Linear triangles. Only v ≤ dist is stated: K is
an M-matrix and c > 0, so that v is nowhere negative, and v ≥ −dist holds of itself.

COPS (Dolan, Moré and Munson, ANL/MCS-TM-273, 2004) is the same on 51 × 51 cells. CUTEst's TORSION1 sums over
the four differences of each inner node, so that those to the edge count half.
"""

from functools import partial

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.manufactured.ladder import Ladder
from problems.manufactured.membrane import unit_square
from problems.model.scene import PrintedOptimum

COUPLE = 5.0  # c: twice the angle of twist per length, in units of the yield stress
COPS = "COPS 3.0, torsion, nx = ny = 50 (as MadNLP/COPSBenchmark.jl quotes it)"
CUTEST = {4: -5.1851852e-1, 10: -4.9234185e-1, 22: -4.5608771e-1}  # nodes a side, edges included


def _distance(line: Vector) -> Matrix:
    """To the nearest edge."""
    to_edge = np.minimum(line, 1 - line)
    return np.minimum.outer(to_edge, to_edge)


_rung = partial(unit_square, "Elastic–plastic torsion", COUPLE, 1.0, _distance)

RUNGS: dict[str, Ladder] = {
    "torsion": {
        **{f"{cells}": partial(_rung, cells) for cells in (20, 40, 80, 160, 320)},
        "cops-50x50": partial(_rung, 51, printed=PrintedOptimum(-4.18087e-1, 6, COPS)),
        **{
            f"cutest-{side}": partial(_rung, side - 1, 0.5, PrintedOptimum(value, 8, "CUTEst, TORSION1.SIF"))
            for side, value in CUTEST.items()
        },
    }
}
