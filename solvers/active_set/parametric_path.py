"""The solutions of λ ≥ 0, y = Qλ − p(t) ≥ 0, λᵀy = 0 along p(t) = p − td, from t > 0 down to 0.

They are linear in t as long as the contact set C is the same. With b_C = Q_CC⁻¹ d_C, b = 0 off C, a step τ
down adds

    τ b to λ        τ (Qb − d) to y

until a force of C or a gap off C is zero: that contact then changes sides, which for positive definite Q lets
the path go on. Where several are near zero, the one with the largest rate changes sides, of those that reach
zero before the first of them reaches −δ (P. M. J. Harris, Math. Programming 5:1–28, 1973): ties cost no
accuracy, and no step is negative.
"""

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Indices, Matrix, Vector
from problems.forms.product import product
from solvers.kkt import EPS, rounding_of

from .growing_factor import GrowingFactor

REFRESHED = 100  # pivots after which the factor, λ and y are computed anew
ROUNDING_FACTOR = 100.0  # δ in units of the rounding of y


class ParametricPath:
    """A point on the path: λ (m,) N, y (m,) mm and t, with C in the order of the factor.

    products : with Q, one per pivot and one each time y is computed anew. Raises LinAlgError if Q_CC is not
    positive definite.
    """

    def __init__(self, Q: Matrix, p: Vector, d: Vector, t: float, C: Indices) -> None:
        self.Q, self.p, self.d, self.t, self.C = Q, p, d, t, C
        self.diagonal = np.diag(Q)
        self.factor = GrowingFactor(len(p))
        self.pivots = self.products = 0
        self.refresh()

    def refresh(self) -> None:
        """Factor Q_CC and solve Q_CC λ_C = p(t)_C anew, refined once."""
        C, target = self.C, self.p - self.t * self.d
        self.factor.size = 0
        if C.size:
            R = sla.cholesky(self.Q.T[np.ix_(C, C)].T, overwrite_a=True, check_finite=False)
            self.factor.extend(np.empty((0, C.size)), R)
        self.lam, self.y = np.zeros_like(target), -target
        for _ in range(2 if C.size else 0):
            self.lam[C] -= self._solve(self.y[C])
            self.y = self._times_Q(self.lam) - target

    def follow(self, max_pivots: int) -> bool:
        """To t = 0; False if the pivots were not enough."""
        while self.t > 0:
            if self.pivots >= max_pivots:
                return False
            self._pivot()
            if not self.pivots % REFRESHED:
                self.refresh()
        self.refresh()
        return True

    def _pivot(self) -> None:
        """Down to the next change of sides, or to t = 0."""
        b = np.zeros_like(self.lam)
        if self.C.size:
            b[self.C] = self._solve(self.d[self.C])
        closed = np.zeros(len(b), dtype=bool)
        closed[self.C] = True
        change = (self._times_Q(b) if self.C.size else b) - self.d
        values = np.where(closed, self.diagonal * self.lam, self.y)
        rates: Vector = np.where(closed, -self.diagonal * b, -change)
        falling = np.flatnonzero(rates > EPS * abs(rates).max())
        delta = ROUNDING_FACTOR * rounding_of(self.p, self.y)
        values, rates = np.maximum(values[falling], 0.0), rates[falling]
        furthest = float(((values + delta) / rates).min(initial=np.inf))
        among = np.flatnonzero(values <= furthest * rates)
        k = among[rates[among].argmax()] if among.size else -1
        step = min(float(values[k] / rates[k]), self.t) if among.size else self.t
        self.lam += step * b
        self.y += step * change
        self.t = 0.0 if step == self.t else self.t - step
        self.pivots += 1
        if self.t > 0:
            self._change_sides(int(falling[k]), bool(closed[falling[k]]))

    def _change_sides(self, k: int, closed: bool) -> None:
        if closed:
            self.factor.delete(int(np.flatnonzero(k == self.C)[0]))
            self.C, self.lam[k] = self.C[k != self.C], 0.0
            return
        z = self.factor.solve_transposed(self.Q[self.C, k])
        schur = max(float(self.diagonal[k] - z @ z), EPS * float(self.diagonal[k]))
        self.factor.append(z, float(np.sqrt(schur)))
        self.C, self.y[k] = np.append(self.C, k), 0.0

    def _solve(self, b: Vector) -> Vector:
        return self.factor.solve(self.factor.solve_transposed(b))

    def _times_Q(self, v: Vector) -> Vector:
        self.products += 1
        return product(self.Q, v)
