"""Solutions of contact sets with factors of Q_CC: for a Q that has no banded inverse.

From a point (λ, y) with y exact, a set C has λ⁺ = λ + dλ with

    dλ_N = −λ_N,    Q_CC dλ_C = Q_CN λ_N − y_C,    y⁺ = y + Q dλ.

The first set is found from few contacts to many: that of every 64th contact along the joint without the
others, then of every 16th and every 4th, each from the last. A contact that carries a force there carries
one among more contacts as a rule, or a neighbour does. So no set is much larger than the last, while those
from all contacts that overlap without forces begin with most of them. Where sets creep for long, an interior
point finds one (interior_set.py).
"""

import numpy as np

from problems.forms.assembly import Mask, Matrix, Vector
from problems.forms.banded_inverse import Windows
from problems.forms.closed_factor import ClosedFactor
from problems.forms.compliance import CountedProducts, DenseCompliance
from solvers.base import DualLoadCase

from .block_pivoting import TrialSolution, block_pivoting
from .interior_set import interior_set
from .newton_system import Direct

STRIDES = 64, 16, 4
FEWEST = 12  # contacts of a first set that is worth while
MOST_SETS = 30  # among some of the contacts
YIELDING = 2.0**-30  # of diag(Q), at glued contacts: Q may be nearly singular
UNCERTAINTY = 1e-9  # of |y_C| where a change starts: rounding


class ClosedSets:
    """Q (m, m) mm/N by columns. nodes : (m, 2) coordinates of the contacts, mm, if they are known.

    products : with Q.
    """

    def __init__(self, Q: Matrix, nodes: Matrix | None = None) -> None:
        self.Q, self.nodes, self.products = Q, nodes, CountedProducts(DenseCompliance(Q))
        self.begin()

    def begin(self) -> None:
        """Forget the last factor, so that no answer depends on those before."""
        self.factor = ClosedFactor(self.Q)

    def set(self, start: TrialSolution, C: Mask) -> TrialSolution:
        """λ⁺ and y⁺ of the set C, vectors in the order of Q. start : the point (λ, y), its rounding |y_C|."""
        change, y = np.where(C, 0.0, -start.lam), start.y
        if change.any():
            y = y + self.products @ change
        closing = self.factor.solve(C, -y)
        lam = np.where(C, start.lam + closing, 0.0)
        y = np.where(C, 0.0, y + self.products @ closing)
        return TrialSolution(lam, y, UNCERTAINTY * start.rounding)

    def first_set(self, load: DualLoadCase) -> Mask:
        """The closed contacts (m,) among every fourth one; where contacts are few, those that overlap."""
        p, C = load.p, load.p > 0
        order = Windows.of(self.nodes, len(p)).order
        for some in (order[::stride] for stride in STRIDES if len(p) >= FEWEST * stride):
            Q = np.asfortranarray(self.Q[np.ix_(some, some)])
            closed = _solved(Q, p[some], C[some])
            C = np.zeros(len(p), dtype=bool)
            C[some] = closed
        return C

    def interior_set(self, load: DualLoadCase) -> tuple[Mask, Vector, int]:
        """The closed contacts of an interior point, (m,), its λ (m,), and the factorisations that it took."""
        system, diagonal = Direct(self.Q), np.diag(self.Q)
        glued = system.solve(YIELDING * diagonal, load.p, 0.0, 0).v
        return interior_set(self.products, system, diagonal, load.p, glued)


def _solved(Q: Matrix, p: Vector, C: Mask) -> Mask:
    """The closed contacts of the dual program of Q and p, about; C : the first set."""
    sets, nothing = ClosedSets(Q), TrialSolution(np.zeros_like(p), -p, 0.0)
    return block_pivoting(lambda C: sets.set(nothing, C), C, np.diag(Q), 0.0, MOST_SETS).C
