"""A quadratic program in one form: what a solver is given, and the only place that knows its form.

    min ½zᵀPz + qᵀz   subject to   Gz ≤ h,   z ≥ 0 if the form is bounded

P and G belong to the assembly, q and h to a load case. From the solution z and the multipliers of Gz ≤ h come
the contact forces λ and the displacements x, in every form the same.
"""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from .assembly import Assembly, LoadCase, Matrix, Vector
from .names import Form
from .prepared import Prepared


class Problem(ABC):
    """An assembly in one of its forms. The arrays may be memory-mapped and are read-only."""

    form: ClassVar[Form]
    #: Whether z ≥ 0 stands in the place of the rows Gz ≤ h.
    bounded: ClassVar[bool]
    #: What an answer must hold; x is recovered from λ where it is not among them.
    needs: ClassVar[tuple[str, ...]]

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared

    @property
    def assembly(self) -> Assembly:
        return self.prepared.assembly

    @property
    def Q(self) -> Matrix:
        """Q = AᵀK⁻¹A, (m, m), mm/N; made when first asked for."""
        return self.prepared.Q

    @property
    @abstractmethod
    def blocks(self) -> tuple[Matrix, ...]:
        """The diagonal blocks of P."""

    @property
    @abstractmethod
    def G(self) -> sp.csr_array | None:
        """The rows of Gz ≤ h; None where there are bounds in their place."""

    @abstractmethod
    def q(self, load: LoadCase) -> Vector:
        """The linear term."""

    @abstractmethod
    def h(self, load: LoadCase) -> Vector | None:
        """The right-hand side of Gz ≤ h; None where there are bounds in its place."""

    @abstractmethod
    def loads(self, cases: Sequence[LoadCase]) -> list[LoadCase]:
        """The load cases with what this form needs of them, read-only."""

    @abstractmethod
    def answer(self, z: Vector, multipliers: Vector | None) -> tuple[Vector | None, Vector | None]:
        """(λ, x) of a solution z and the multipliers of its rows; x is None where it is to be recovered."""

    @abstractmethod
    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector | None, Vector]:
        """(z, multipliers) of forces λ, gaps g − Aᵀx and displacements x: where a warm start begins."""

    @abstractmethod
    def gap(self, load: LoadCase, lam: Vector, x: Vector | None) -> Vector:
        """The gaps that an answer leaves, g − Aᵀx = Qλ − p, (m,) mm."""

    @abstractmethod
    def distance(self, one: LoadCase, other: LoadCase) -> float:
        """How far two load cases are from each other, to choose the answer to start from."""

    @property
    @abstractmethod
    def arrays(self) -> list[Matrix]:
        """The matrices that a solver of this form reads."""

    @property
    def yardstick(self) -> Matrix | None:
        """The matrix whose Cholesky factorisation times are compared with; None in a form without one."""
        return None

    def recover(
        self, lams: Sequence[Vector | None], xs: Sequence[Vector | None], cases: Sequence[LoadCase]
    ) -> list[Vector | None]:
        """x (n,) mm of each answer: the solver's own, else K⁻¹(f − Aλ), with one pass over K for all."""
        found = list(xs)
        if "x" in self.needs:
            return found
        known = [k for k, lam in enumerate(lams) if lam is not None]
        if known:
            lam = np.column_stack([np.asarray(lams[k], dtype=float) for k in known])
            x = self.prepared.recover(lam, side_by_side([cases[k] for k in known])).T
            for k, mine in zip(known, x, strict=True):
                found[k] = np.ascontiguousarray(mine)
        return found


def in_form(prepared: Prepared, form: Form) -> Problem:
    """The problem in the form of that name: the subclass of Problem in the file of the same name."""
    module = importlib.import_module(f"problems.forms.{form}")
    problem: Problem = getattr(module, form.title())(prepared)
    return problem


def side_by_side(cases: Sequence[LoadCase]) -> LoadCase:
    """f (n, k), or (n, 1) where all have the same, and g (m, k)."""
    shared = all(case.f is cases[0].f for case in cases)
    f = cases[0].f[:, None] if shared else np.column_stack([case.f for case in cases])
    return LoadCase(f, np.column_stack([case.g for case in cases]))


def read_only(load: LoadCase) -> LoadCase:
    """The load case, its arrays protected against a solver that writes."""
    for array in (load.f, load.g, load.p):
        array.flags.writeable = False
    return load
