"""The dual form: min ½λᵀQλ − pᵀλ, λ ≥ 0, m unknowns, with Q = AᵀK⁻¹A and p = AᵀK⁻¹f − g.

Needs the factors of K, for p and for x = K⁻¹(f − Aλ), and Q.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from .assembly import LoadCase, Matrix, Vector, stacked
from .names import Form
from .problem import Problem, read_only


class Dual(Problem):
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
        return -load.p

    def h(self, load: LoadCase) -> None:
        return None

    def loads(self, cases: Sequence[LoadCase]) -> list[LoadCase]:
        """With p; K⁻¹f is computed once if they share their f."""
        p = self.prepared.dual_load(stacked(cases)).T
        pairs = zip(cases, p, strict=True)
        return [read_only(LoadCase(case.f, case.g, np.ascontiguousarray(mine))) for case, mine in pairs]

    def answer(self, z: Vector, multipliers: Vector | None) -> tuple[Vector | None, Vector | None]:
        return z, None

    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector | None, Vector]:
        return lam, gap

    def gap(self, load: LoadCase, lam: Vector, x: Vector | None) -> Vector:
        return self.Q @ lam - load.p

    def distance(self, one: LoadCase, other: LoadCase) -> float:
        """‖p − p'‖₂, mm."""
        return float(np.linalg.norm(one.p - other.p))

    @property
    def arrays(self) -> list[Matrix]:
        K = self.assembly.K
        return [*K.arrays, *K.factors, self.Q]
