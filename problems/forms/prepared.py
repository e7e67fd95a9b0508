"""Data preparation, done once per assembly and used by every load case: factors of K, Q, M ≈ Q⁻¹, p."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from problems.stiffness.block import scaled
from problems.stiffness.operator import ScaledStiffness, Stiffness

from . import Form
from .assembly import Assembly, DualLoadCase, LoadCase, Matrix, Vector, stacked
from .compliance import (
    SETS,
    ApproximateInverse,
    Compliance,
    ComplianceProducts,
    DenseCompliance,
    of_dense,
    of_products,
)

MIB = 2**20  # bytes
EPS = float(np.finfo(float).eps)
RESIDUAL_ROUNDING = 32  # of ε: five are usual, whatever the size


class Prepared:
    """An assembly with Q, M and p, which are made in memory when first needed; the factors belong to K.

    Parameters
    ----------
    assembly : Assembly
        K and A, of n unknowns and m contacts.
    Q : array (m, m), mm/N, optional
        AᵀK⁻¹A, where it is at hand.
    coarser : function, optional
        Makes an assembly of similar Q whose factors are cheaper, for M.
    """

    #: Seconds in which this process made K; None if it opened K.
    model_s: float | None = None

    def __init__(
        self,
        assembly: Assembly,
        Q: Matrix | None = None,
        coarser: Callable[[], Assembly] | None = None,
    ) -> None:
        self.assembly, self.coarser = assembly, coarser
        self.Q_if_made = Q

    @cached_property
    def key(self) -> str | None:
        """The key of the matrices in the cache; None if they are in memory only."""
        return None

    @property
    def form(self) -> Form:
        """The form in which the in-house methods solve it."""
        return "dual" if self.assembly.K.dense else "sparse"

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of each step of the preparation, as far as they are known."""
        return {} if self.model_s is None else {"model": self.model_s}

    @property
    def spectrum(self) -> dict[str, object]:
        """cond_K, lambda_min, … of a K whose factors are in the cache."""
        return {}

    @property
    def facts(self) -> dict[str, object]:
        """The sizes, the spectrum and the seconds of each step, by the names of a row."""
        assembly = self.assembly
        size: dict[str, object] = {"n": assembly.junction_size, "m": assembly.m, "parts": assembly.parts}
        if not assembly.K.dense:
            size["unknowns"] = assembly.n
        return size | self.spectrum | {"seconds": self.seconds}

    @property
    def condition(self) -> float:
        """cond(K) from the cache, else an estimate in balanced units."""
        cached = self.spectrum.get("cond_K")
        K = self.assembly.K
        return float(cached) if isinstance(cached, float) else K.condition(K.units)

    @property
    def stored_mib(self) -> dict[str, float]:
        """MiB of K, of its factors and of Q; for a dense K also of those not yet made."""
        K = self.assembly.K
        sizes = {"K": sum(array.nbytes for array in K.arrays) / MIB}
        if K.dense or K.factored:
            sizes["factors"] = 8 * K.factor_nonzeros / MIB
        return sizes | ({"Q": 8 * self.assembly.m**2 / MIB} if K.dense else {})

    @property
    def opened(self) -> tuple[str, ...]:
        """The matrices in memory, by name: K, and the dense factors and Q where they were needed."""
        K = self.assembly.K
        stages = {"factors": K.dense and K.factored, "Q": self.Q_if_made is not None}
        return ("K", *(stage for stage, made in stages.items() if made))

    @property
    def Q(self) -> Matrix:
        """Q = AᵀK⁻¹A, (m, m), mm/N, made when first needed."""
        if self.Q_if_made is None:
            self.Q_if_made = self.make_Q()
        return self.Q_if_made

    def make_Q(self) -> Matrix:
        """Compute Q; a subclass may take it from elsewhere."""
        return self.assembly.K.compliance(self.assembly.A)

    @property
    def Q_of_sets(self) -> Matrix | None:
        """Q, where contact sets without M are solved with it: for a dense K; and for a sparse one where Q, by
        m solutions, and a factor of it for each set take fewer operations than a factor of K for each set.
        """
        K, m = self.assembly.K, self.assembly.m
        few = 4.0 * K.factor_nonzeros * m + SETS * m**3 / 3 < SETS * K.factorisation_flops
        return self.Q if K.dense or (few and not self.assembly.dependent) else None

    @property
    def compliance(self) -> Compliance:
        """Q: the matrix for a dense K, else its products."""
        K, A = self.assembly.K, self.assembly.A
        return DenseCompliance(self.Q) if K.dense else ComplianceProducts(K, A)

    @cached_property
    def approximate_inverse(self) -> ApproximateInverse:
        """M ≈ Q⁻¹, and an estimate of the diagonal of Q. Raises LinAlgError if Q is not positive definite."""
        if self.assembly.K.dense:
            return of_dense(DenseCompliance(self.Q), self.assembly.contact_nodes)
        near = of_products(self.assembly, self.coarser() if self.coarser else self.assembly)
        if near.M is None and (Q := self.Q_of_sets) is not None:
            return replace(near, diagonal=np.diag(Q).copy())
        return near

    def scaled(self, D: Vector, R: Vector) -> "Prepared":
        """The same problem with DKD, solved by K's factors, and DAR, for powers of two D (n,) and R (m,)."""
        return _Scaled(self, D, R)

    def overlap(self, load: LoadCase) -> Vector:
        """p = AᵀK⁻¹f − g, (m,), mm: the overlap of the parts if contact is ignored."""
        return self.assembly.A.T @ self.assembly.K.solve(load.f) - load.g

    def with_p(self, loads: Sequence[LoadCase]) -> list[DualLoadCase]:
        """The load cases with p, unless all have it already; K⁻¹f is computed once if they share their f."""
        dual = [load for load in loads if isinstance(load, DualLoadCase)]
        if len(dual) == len(loads):
            return dual
        columns = self.overlap(stacked(loads)).T
        pairs = zip(loads, columns, strict=True)
        return [DualLoadCase(**vars(load) | {"p": np.ascontiguousarray(p)}) for load, p in pairs]

    def gaps(self, lam: Matrix, loads: Sequence[DualLoadCase]) -> Matrix:
        """y = g − Aᵀx of x = K⁻¹(f − Aλ), (m, k) mm for λ (m, k).

        Qλ − p with a matrix Q; else by one solution with K, as Qλ and p can be large, and cancel.
        """
        if self.assembly.K.dense:
            return self.compliance @ lam - np.column_stack([load.p for load in loads])
        A, cases = self.assembly.A, stacked(loads)
        y: Matrix = cases.g - A.T @ self.assembly.K.solve(cases.f - A @ lam)
        return y

    def recover(self, lam: Vector, load: LoadCase) -> Vector:
        """x = K⁻¹(f − Aλ), (n,) mm, refined once if the residual r = f − Aλ − Kx is beyond rounding.

        With s_i = √k_ii, |k_ij| ≤ s_i s_j, rounding leaves max |r_i| / s_i at a few ε max s_j |x_j|.
        """
        K, b = self.assembly.K, load.f - self.assembly.A @ lam
        x = K.solve(b)
        r = b - K.multiply(x)
        s = np.sqrt(K.diagonal)
        if (abs(r.T) / s).max() <= RESIDUAL_ROUNDING * EPS * (abs(x.T) * s).max():
            return x
        return x + K.solve(r)


class _Scaled(Prepared):
    def __init__(self, base: Prepared, D: Vector, R: Vector) -> None:
        K = base.assembly.K if (D == 1).all() else ScaledStiffness(base.assembly.K, D)
        assembly = replace(base.assembly, K=K, A=scaled(base.assembly.A, D, R))
        super().__init__(assembly)
        self.base, self.R = base, R

    def make_Q(self) -> Matrix:
        return np.asfortranarray(self.base.Q * self.R * self.R[:, None])

    @cached_property
    def approximate_inverse(self) -> ApproximateInverse:
        return self.base.approximate_inverse.scaled(self.R)


def dual_alone(Q: Matrix) -> Prepared:
    """Q (m, m) mm/N without a joint: the dual program of K = Q⁻¹ and A = I, for loads with p = −g."""
    one = sp.eye_array(len(Q), format="csc")
    return Prepared(Assembly(Stiffness.of(Stiffness.of(Q).compliance(one)), one), Q)
