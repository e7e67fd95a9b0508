"""Makes the gaps of closed contacts zero: Q_CC dλ = −y_C by M ≈ Q⁻¹, or by a factor of Q_CC."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Mask, Matrix, Vector
from problems.forms.banded_inverse import BandedInverse, BandFactor
from problems.forms.closed_factor import ClosedFactor
from problems.forms.prepared import Prepared
from problems.stiffness.dense_block import product

MAX_SETS = 10  # contact sets tried with M for one load case


@dataclass(frozen=True)
class ScaledInverse:
    """M ≈ Q⁻¹, None if it cannot be made, and estimates of the diagonal of Q (m,), in units R (m,).

    Q : (m, m) where sets are solved with it.
    """

    M: BandedInverse | None
    diagonal: Vector
    R: Vector
    Q: Matrix | None = None

    @classmethod
    def of(cls, prepared: Prepared, R: Vector) -> "ScaledInverse":
        with suppress(np.linalg.LinAlgError):  # Q is not positive definite, but for rounding
            if len(R):
                plain = prepared.approximate_inverse
                Q = prepared.Q_of_sets if plain.M is None else None
                return cls(plain.M, plain.diagonal * R**2, R, Q)
        return cls(None, np.ones(len(R)), R)

    def forces(self, v: Vector, C: Mask) -> Vector:
        """u (m,) with about (Qu)_C = v_C: M v, or Q_CC⁻¹v_C; zero if rounding makes Q_CC indefinite.

        There is M or Q.
        """
        if self.Q is None:
            return self.product(v)
        with suppress(np.linalg.LinAlgError):
            return ClosedFactor(self.Q).solve(C, v / self.R) / self.R
        return np.zeros_like(v)

    def product(self, v: Vector) -> Vector:
        """M v."""
        assert self.M is not None
        u = np.empty_like(v)
        u[self.M.order] = self.M.product((v / self.R)[self.M.order])
        return u / self.R

    def factor(self, N: Mask) -> BandFactor | ClosedFactor | None:
        """The factor of M_NN or Q_CC; None without both, or if rounding makes it indefinite."""
        if self.Q is not None:
            with suppress(np.linalg.LinAlgError):
                factor = ClosedFactor(self.Q)
                factor.solve(~N, np.zeros(len(N)))
                return factor
        if self.M is not None:
            with suppress(np.linalg.LinAlgError):
                return self.M.factor(N[self.M.order])
        return None


class ClosedContacts:
    """The closed contacts C (m,) of a load case, and a first dλ (m,) ≥ −λ.

    C = {λ_i q_ii > y_i} (semismooth Newton; Hintermüller, Ito and Kunisch, SIAM J. Optim. 13:865–888, 2002)
    without those whose force would become negative. y (m,) : the gaps that dλ is to close. lam : λ (m,).
    """

    def __init__(self, inverse: ScaledInverse, y: Vector, lam: Vector) -> None:
        self.inverse, C = inverse, lam * inverse.diagonal > y
        for _ in range(MAX_SETS):
            self.C, self.factor = C, inverse.factor(~C)
            if self.factor is None:
                self.dlam = np.where(C, 0.0, -lam)
                return
            dlam = np.where(C, -self._solved(self.factor, np.where(C, y, 0.0), lam), -lam)
            self.dlam = np.maximum(dlam, -lam)
            negative = C & (lam + dlam < 0)
            if not negative.any():
                return
            C = C & ~negative

    def precondition(self, v: Vector) -> Vector:
        """About Q_CC⁻¹ v, for v (m,) zero outside C; v itself without M."""
        return v if self.factor is None else np.where(self.C, self._solved(self.factor, v, 0.0), 0.0)

    def _solved(self, factor: BandFactor | ClosedFactor, v: Vector, lam: Vector | float) -> Vector:
        """u with (M⁻¹u)_C = v_C and u_N = λ_N: u = M(v − t), M_NN t_N = (M v)_N − λ_N.

        With Q, Q_CC u_C = v_C − Q_CN λ_N; u_N counts for nothing.
        """
        inverse = self.inverse
        if isinstance(factor, ClosedFactor):
            others = np.where(self.C, 0.0, lam * inverse.R)
            carried = product(factor.Q, others) if others.any() else 0.0
            return factor.solve(self.C, v / inverse.R - carried) / inverse.R
        assert inverse.M is not None
        u, t = inverse.product(v), np.empty_like(v)
        t[inverse.M.order] = factor.solve((np.where(self.C, 0.0, u - lam) * inverse.R)[inverse.M.order])
        return u - inverse.product(t * inverse.R)
