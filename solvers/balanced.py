"""Balanced units: in which the libraries are given the sparse form.

With û = uDv, λ = uRμ, the problem min ½ûᵀK̂û − f̂ᵀû, Bᵀû ≤ g becomes, divided by u²,

    min ½vᵀ(DK̂D)v − (Df̂/u)ᵀv   subject to   (RBᵀD)v ≤ Rg/u

    D   the diagonal of DK̂D between 1/2 and 2: the unknowns of the model are in mm, 1 and 1/mm
    R   the rows of RBᵀD of a length between 1/2 and 1
    u   the loads Df̂/u and the gaps Rg/u at most one in size, (N·mm)^½, for each load case

All are powers of two, so nothing is rounded. D and R belong to the assembly, so do DK̂D and RBᵀD; u belongs to
the load case.

A tolerance τ on the residuals is meant in these units: it allows uτ/Dᵢ in row i of K̂û − f̂ + Bλ and uτ/Rⱼ mm
in row j of Bᵀû − g. The duality gap, which bounds the error ½(û − û*)ᵀK̂(û − û*), may be τ N·mm as in the
other forms, τ/u² in these units (but no more than τ, and 1e-13 for rounding), if the library has a tolerance
of its own for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import Problem, in_form
from problems.stiffness.block import scaled

from .base import Answer, WarmStart

GAP_ROUNDING = 1e-13  # PIQP comes down to 3e-14 on some scenes, and waits for 1.5e-14 in vain on others


@dataclass(frozen=True)
class Units:
    """D (N,) and R (m,) of an assembly."""

    D: Vector
    R: Vector

    @classmethod
    def of(cls, assembly: Assembly) -> Units:
        D = assembly.K.units
        lengths = np.sqrt((sp.diags_array(D) @ assembly.A).power(2).sum(axis=0))
        return cls(D, np.ldexp(1.0, -np.frexp(lengths)[1]))

    def problem(self, given: Problem) -> Problem:
        """With DK̂D for K̂ and DBR for B."""
        assembly = given.assembly
        A = scaled(assembly.A, self.D, self.R)
        K = assembly.K.scaled(self.D)
        return in_form(Prepared(Assembly(K, A, parts=assembly.parts)), given.form)

    def unit(self, load: LoadCase) -> float:
        """u; 1 if there are neither loads nor gaps."""
        largest = max(float(abs(v).max(initial=0.0)) for v in (self.D * load.f, self.R * load.g))
        return float(np.ldexp(1.0, np.frexp(largest)[1])) if largest else 1.0

    def load(self, load: LoadCase) -> LoadCase:
        """Df̂/u and Rg/u."""
        return self._divided(load, self.unit(load))

    def _divided(self, load: LoadCase, u: float) -> LoadCase:
        return LoadCase(self.D * load.f / u, self.R * load.g / u)

    def start(self, start: WarmStart, load: LoadCase) -> WarmStart:
        """A warm start in the units of the load case that is to be solved."""
        u = self.unit(load)
        x = None if start.x is None else start.x / (u * self.D)
        return WarmStart(self._divided(start.load, u), start.lam / (u * self.R), start.gap * self.R / u, x)

    def gap_tolerance(self, tolerance: float, load: LoadCase) -> float:
        """For the duality gap in these units."""
        return min(tolerance, max(tolerance / self.unit(load) ** 2, GAP_ROUNDING))

    def answer(self, answer: Answer, load: LoadCase) -> Answer:
        """In the units of the scene; its details say that it was solved in others, and u."""
        u = self.unit(load)
        details = {**answer.details, "balanced": True, "unit": u}
        lam = None if answer.lam is None else u * self.R * answer.lam
        x = None if answer.x is None else u * self.D * answer.x
        return replace(answer, lam=lam, x=x, details=details)


def balanced(problem: Problem) -> tuple[Problem, Units | None]:
    """A problem in the sparse form in balanced units, with these; any other as it is."""
    if problem.form != "sparse":
        return problem, None
    units = Units.of(problem.assembly)
    return units.problem(problem), units
