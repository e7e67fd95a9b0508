"""A quadratic program in one form, as solvers are given it; no other code depends on the form.

    min ½zᵀPz + qᵀz   subject to   Gz ≤ h,   z ≥ 0 if the form is bounded

P and G belong to the assembly, q and h to a load case. The solution z and the multipliers of Gz ≤ h give the
contact forces λ and the displacements x, the same in every form.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, TypeVar

import numpy as np
import scipy.sparse as sp

from . import Form
from .assembly import Assembly, DualLoadCase, LoadCase, Matrix, Vector, stacked
from .prepared import Prepared

AnyLoadCase = TypeVar("AnyLoadCase", bound=LoadCase)


class Problem:
    """An assembly in the primal form, min ½xᵀKx − fᵀx, Aᵀx ≤ g, n unknowns; a subclass has another form.

    The primal form reads K and A, and no factor. The arrays may be memory-mapped and are read-only.

    Parameters
    ----------
    prepared : Prepared
        The assembly, with factors of K and Q, which are made when a form first needs them.
    """

    form: ClassVar[Form] = "primal"
    #: Whether bounds z ≥ 0 replace the rows Gz ≤ h.
    bounded: ClassVar[bool] = False
    #: The fields that an answer must have; x, where it is none of these, is recovered from λ.
    needs: ClassVar[tuple[str, ...]] = ("lam", "x")

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared

    @property
    def assembly(self) -> Assembly:
        return self.prepared.assembly

    @property
    def Q(self) -> Matrix:
        """Q = AᵀK⁻¹A, (m, m) mm/N, by columns; computed when first needed."""
        return self.prepared.Q

    @property
    def blocks(self) -> tuple[Any, ...]:
        """The diagonal blocks of P: those of K, N/mm, dense or csc_arrays; in the dual form Q, mm/N."""
        return self.assembly.K.matrices

    @property
    def G(self) -> sp.csr_array | None:
        """The matrix of Gz ≤ h, Aᵀ (m, n); None if bounds replace it."""
        return sp.csr_array(self.assembly.A.T)

    def q(self, load: LoadCase) -> Vector:
        """The linear term: −f (n,) in N; in the dual form −p (m,) in mm."""
        return -load.f

    def h(self, load: LoadCase) -> Vector | None:
        """The right-hand side of Gz ≤ h, g (m,) in mm; None if bounds replace it."""
        return load.g

    def loads(self, cases: Sequence[LoadCase]) -> Sequence[LoadCase]:
        """The load cases as a solver gets them: read-only, in the dual form with p."""
        return [read_only(case) for case in cases]

    def answer(self, z: Vector, multipliers: Vector | None) -> tuple[Vector | None, Vector | None]:
        """(λ, x) of a solution z and the multipliers of its rows; x is None if it must be recovered."""
        return multipliers, z

    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector | None, Vector]:
        """(z, multipliers) to start from, of an answer's forces λ, gaps g − Aᵀx and displacements x."""
        return x, lam

    def gap(self, load: LoadCase, lam: Vector, x: Vector | None) -> Vector:
        """The gaps of an answer, g − Aᵀx = Qλ − p, (m,) mm."""
        assert x is not None
        return load.g - self.assembly.A.T @ x

    def distance(self, one: LoadCase, other: LoadCase) -> float:
        """The distance between load cases, by which the answer to start from is chosen: the larger of the
        relative changes of f and g, in their 2-norms.
        """
        pairs = ((one.f, other.f), (one.g, other.g))
        return max(float(np.linalg.norm(a - b) / (np.linalg.norm(b) or 1.0)) for a, b in pairs)

    @property
    def arrays(self) -> list[Matrix]:
        """The matrices that a solver of this form reads."""
        return self.assembly.K.arrays

    @property
    def yardstick(self) -> Matrix | None:
        """Q, whose Cholesky factorisation is a yardstick of times; None for a sparse K."""
        return self.Q if self.assembly.K.dense else None

    def recover(
        self, lams: Sequence[Vector | None], xs: Sequence[Vector | None], cases: Sequence[LoadCase]
    ) -> list[Vector | None]:
        """x (n,) mm of each answer: the solver's, or K⁻¹(f − Aλ) in the dual form, in one pass over K."""
        recovered = list(xs)
        solved = [k for k, lam in enumerate(lams) if lam is not None]
        if solved and "x" not in self.needs:
            lam = np.column_stack([np.asarray(lams[k], dtype=float) for k in solved])
            x = self.prepared.recover(lam, stacked([cases[k] for k in solved])).T
            for k, column in zip(solved, x, strict=True):
                recovered[k] = np.ascontiguousarray(column)
        return recovered


class Dual(Problem):
    """min ½λᵀQλ − pᵀλ, λ ≥ 0, m unknowns, with Q = AᵀK⁻¹A and p = AᵀK⁻¹f − g.

    It reads Q, and the factors of K for p and x = K⁻¹(f − Aλ).
    """

    form: ClassVar[Form] = "dual"
    bounded: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("lam",)

    @property
    def blocks(self) -> tuple[Matrix, ...]:
        return (self.Q,)

    @property
    def G(self) -> None:
        return None

    def q(self, load: LoadCase) -> Vector:
        return -self._p(load)

    def h(self, load: LoadCase) -> None:
        return None

    def _p(self, load: LoadCase) -> Vector:
        return self.prepared.with_p([load])[0].p

    def loads(self, cases: Sequence[LoadCase]) -> Sequence[DualLoadCase]:
        return [read_only(case) for case in self.prepared.with_p(cases)]

    def answer(self, z: Vector, multipliers: Vector | None) -> tuple[Vector | None, Vector | None]:
        return z, None

    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector | None, Vector]:
        return lam, gap

    def gap(self, load: LoadCase, lam: Vector, x: Vector | None) -> Vector:
        return self.Q @ lam - self._p(load)

    def distance(self, one: LoadCase, other: LoadCase) -> float:
        """‖p − p'‖₂, mm."""
        return float(np.linalg.norm(self._p(one) - self._p(other)))

    @property
    def arrays(self) -> list[Matrix]:
        K = self.assembly.K
        return [*K.arrays, *K.factors, self.Q]


class Sparse(Problem):
    """min ½ûᵀK̂û − f̂ᵀû, Bᵀû ≤ g over all N unknowns of the model, K̂ and B sparse.

    Nothing is condensed: x is û at the junction, and λ is the same as in the other forms. It reads K̂ and B,
    and no factor.
    """

    form: ClassVar[Form] = "sparse"


def in_form(prepared: Prepared, form: Form) -> Problem:
    """The problem in the form of that name."""
    classes: dict[Form, type[Problem]] = {"primal": Problem, "dual": Dual, "sparse": Sparse}
    return classes[form](prepared)


def read_only(load: AnyLoadCase) -> AnyLoadCase:
    """The load case as read-only views: a solver cannot write, and the caller's own arrays stay writable."""
    views: dict[str, Any] = {
        name: value.view() for name, value in vars(load).items() if isinstance(value, np.ndarray)
    }
    for view in views.values():
        view.flags.writeable = False
    return replace(load, **views)
