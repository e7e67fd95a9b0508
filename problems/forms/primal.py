"""The primal form: min ½xᵀKx − fᵀx, Aᵀx ≤ g, n unknowns. Needs K and A, no factor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

from .assembly import LoadCase, Matrix, Vector
from .names import Form
from .problem import Problem, read_only


class Primal(Problem):
    form: ClassVar[Form] = "primal"
    bounded: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("lam", "x")

    @property
    def blocks(self) -> tuple[Any, ...]:
        return self.assembly.K.matrices

    @property
    def G(self) -> sp.csr_array:
        return sp.csr_array(self.assembly.A.T)

    def q(self, load: LoadCase) -> Vector:
        return -load.f

    def h(self, load: LoadCase) -> Vector:
        return load.g

    def loads(self, cases: Sequence[LoadCase]) -> list[LoadCase]:
        return [read_only(case) for case in cases]

    def answer(self, z: Vector, multipliers: Vector | None) -> tuple[Vector | None, Vector | None]:
        return multipliers, z

    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector | None, Vector]:
        return x, lam

    def gap(self, load: LoadCase, lam: Vector, x: Vector | None) -> Vector:
        assert x is not None
        return load.g - self.assembly.A.T @ x

    def distance(self, one: LoadCase, other: LoadCase) -> float:
        """The larger of the relative changes of f and g, in their 2-norms."""
        pairs = ((one.f, other.f), (one.g, other.g))
        return max(float(np.linalg.norm(a - b) / (np.linalg.norm(b) or 1.0)) for a, b in pairs)

    @property
    def arrays(self) -> list[Matrix]:
        return self.assembly.K.arrays
