"""What the methods share that need nothing of a problem but its Q: they start from λ = 0 or a warm start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from problems.forms.assembly import Matrix, Vector

from .base import Form, LoadCase, Problem, Solver, WarmStart


@dataclass(frozen=True)
class DenseDual:
    """Q (m, m) mm/N, and the solved load case from which to start, if there is one."""

    Q: Matrix
    start: WarmStart | None = None


class DenseDualSolver(Solver):
    """Base of these methods."""

    forms: ClassVar[tuple[Form, ...]] = ("dual",)

    def prepare(self, data: Problem) -> DenseDual:
        return DenseDual(data.Q)

    def update(
        self, state: DenseDual, ready: object, load: LoadCase, tolerance: float, start: WarmStart
    ) -> DenseDual:
        return replace(state, start=start)


def first_point(start: WarmStart | None, load: LoadCase) -> tuple[Vector, Vector]:
    """λ (m,) N and y = Qλ − p (m,) mm from which a load case starts, without a product with Q."""
    if start is None:
        return np.zeros_like(load.p), -load.p
    return np.maximum(start.lam, 0.0), start.gap + start.load.p - load.p
