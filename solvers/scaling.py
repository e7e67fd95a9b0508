"""Contacts of unit length: what the solvers of this project are given, whatever the units of a problem.

With c_j = 2^round(log₂ max_i |a_ij|), a displacement of 1 mm at contact j changes its row of Aᵀx ≤ g by c_j.
The problem solved has A C⁻¹, C⁻¹g, C⁻¹QC⁻¹, C⁻¹p and the forces Cλ: a tolerance in mm then means the same at
every contact. The c_j are powers of two, so nothing is rounded; if all are one, nothing is copied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase, Vector
from problems.forms.problem import Problem, in_form

from .base import Answer, Batch, Solver, WarmStart


def contact_units(A: sp.csc_array) -> Vector:
    """c (m,), powers of two, with max_i |a_ij| / c_j between 1/√2 and √2."""
    return np.exp2(np.round(np.log2(abs(A).max(axis=0).toarray().ravel())))


@dataclass(frozen=True)
class _Scaled:
    """What the solver handed on, and c; None where every contact is of unit length already."""

    inner: Any
    c: Vector | None

    def load(self, load: LoadCase) -> LoadCase:
        if self.c is None:
            return load
        return LoadCase(load.f, load.g / self.c, load.p / self.c if load.p.size else load.p)

    def answer(self, answer: Answer) -> Answer:
        if self.c is None or answer.lam is None:
            return answer
        return replace(answer, lam=answer.lam / self.c)


class Scaled(Solver):
    """A solver that is given contacts of unit length; its answer comes back in the problem's own units."""

    def __init__(self, solver: Solver) -> None:
        self.solver = solver
        self.forms = solver.forms  # type: ignore[misc]  # of this solver alone

    def convert(self, problem: Problem) -> _Scaled:
        c = contact_units(problem.assembly.A)
        if (c == 1).all():
            return _Scaled(self.solver.convert(problem), None)
        return _Scaled(self.solver.convert(in_form(problem.prepared.in_contact_units(c), problem.form)), c)

    def prepare(self, data: _Scaled) -> _Scaled:
        return replace(data, inner=self.solver.prepare(data.inner))

    def setup(self, state: _Scaled, load: LoadCase, tolerance: float) -> _Scaled:
        return replace(state, inner=self.solver.setup(state.inner, state.load(load), tolerance))

    def update(
        self, state: _Scaled, ready: _Scaled, load: LoadCase, tolerance: float, start: WarmStart
    ) -> _Scaled:
        if state.c is not None:
            lam, gap = start.lam * state.c, start.gap / state.c
            start = WarmStart(state.load(start.load), lam, gap, start.x)
        inner = self.solver.update(state.inner, ready.inner, state.load(load), tolerance, start)
        return replace(state, inner=inner)

    def batched(self, state: _Scaled) -> Batch | None:
        batch = self.solver.batched(state.inner)
        if batch is None:
            return None

        def scaled(loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
            return [state.answer(found) for found in batch([state.load(load) for load in loads], tolerance)]

        return scaled

    def solve(self, ready: _Scaled, load: LoadCase, tolerance: float) -> Answer:
        return ready.answer(self.solver.solve(ready.inner, ready.load(load), tolerance))
