"""A quadratic program in one form, as solvers are given it; no other code depends on the form.

    min ½zᵀPz + qᵀz   subject to   Gz ≤ h,   z ≥ 0 if the form is bounded

P and G belong to the assembly, q and h to a load case. The solution z and the multipliers of Gz ≤ h give the
contact forces λ and the displacements x, the same in every form.
"""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

from .assembly import Assembly, LoadCase, Matrix, Vector, stacked
from .names import Form
from .prepared import Prepared

#: Called with what is being made, and the fraction done.
Progress = Callable[[str, float], None]


class Problem(ABC):
    """An assembly in one of its forms. The arrays may be memory-mapped and are read-only."""

    form: ClassVar[Form]
    #: Whether bounds z ≥ 0 replace the rows Gz ≤ h.
    bounded: ClassVar[bool]
    #: What an answer must contain; x, if not among these, is recovered from λ.
    needs: ClassVar[tuple[str, ...]]

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared

    @property
    def assembly(self) -> Assembly:
        return self.prepared.assembly

    @property
    def Q(self) -> Matrix:
        """Q = AᵀK⁻¹A, (m, m), mm/N; computed when first needed."""
        return self.prepared.Q

    @property
    @abstractmethod
    def blocks(self) -> tuple[Any, ...]:
        """The diagonal blocks of P, dense or sparse."""

    @property
    @abstractmethod
    def G(self) -> sp.csr_array | None:
        """The matrix of Gz ≤ h; None if bounds replace it."""

    @abstractmethod
    def q(self, load: LoadCase) -> Vector:
        """The linear term."""

    @abstractmethod
    def h(self, load: LoadCase) -> Vector | None:
        """The right-hand side of Gz ≤ h; None if bounds replace it."""

    @abstractmethod
    def loads(self, cases: Sequence[LoadCase]) -> list[LoadCase]:
        """The load cases with what this form adds to them, read-only."""

    @abstractmethod
    def answer(self, z: Vector, multipliers: Vector | None) -> tuple[Vector | None, Vector | None]:
        """(λ, x) of a solution z and the multipliers of its rows; x is None if it must be recovered."""

    @abstractmethod
    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector | None, Vector]:
        """(z, multipliers) of a warm start from forces λ, gaps g − Aᵀx and displacements x."""

    @abstractmethod
    def gap(self, load: LoadCase, lam: Vector, x: Vector | None) -> Vector:
        """The gaps of an answer, g − Aᵀx = Qλ − p, (m,) mm."""

    @abstractmethod
    def distance(self, one: LoadCase, other: LoadCase) -> float:
        """A distance between load cases, to choose the answer to start from."""

    @property
    @abstractmethod
    def arrays(self) -> list[Matrix]:
        """The matrices that a solver of this form reads."""

    @property
    def model_s(self) -> float | None:
        """Seconds in which this process made the matrices; None if it opened them."""
        return None

    @property
    def yardstick(self) -> Matrix | None:
        """The matrix whose Cholesky factorisation times are compared with; None in a form without one."""
        return self.Q

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
            x = self.prepared.recover(lam, stacked([cases[k] for k in known])).T
            for k, mine in zip(known, x, strict=True):
                found[k] = np.ascontiguousarray(mine)
        return found


def in_form(prepared: Prepared, form: Form) -> Problem:
    """The problem in the form of that name: the subclass of Problem in the file of the same name."""
    module = importlib.import_module(f"problems.forms.{form}")
    problem: Problem = getattr(module, form.title())(prepared)
    return problem


def read_only(load: LoadCase) -> LoadCase:
    """The load case as read-only views: a solver cannot write, and the caller's own arrays stay writable."""
    f, g, p = load.f.view(), load.g.view(), load.p.view()
    for view in (f, g, p):
        view.flags.writeable = False
    return replace(load, f=f, g=g, p=p)
