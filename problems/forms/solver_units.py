"""The units in which every solver is given its problem; the session makes and undoes the change.

With x = U D v and λ = U R μ, min ½xᵀKx − fᵀx, Aᵀx ≤ g becomes, divided by U²,

    min ½vᵀ(DKD)v − (Df/U)ᵀv   subject to   (RAᵀD)v ≤ Rg/U,

and the dual form's Q and p become RQR and Rp/U. All are powers of two, so nothing is rounded.

    D   1 for a dense K, whose unknowns are displacements. Those of a sparse K are in mm, 1 and 1/mm:
        D_i √k_ii is between 1/√2 and √2 (`balanced_units`), but D is the same, the median, for all that a
        model says to be displacements in mm. In the dual form, which has no x, D = 1
    R   contacts of unit length: max_i D_i|a_ij| R_j between 1/√2 and √2
    U   ℓ/δ, with δ the median of D at the contacts. ℓ, the length of a scaled displacement there, is 1 mm
        if max |g|, or the larger of it and max |f_i|/k_ii, is between 2⁻⁸ and 2⁸ mm; else about the latter.
        A gap of 2³⁰ times what loads and overlaps move does not count: nothing reaches it

So a joint in mm is passed on untouched in a dense form, and its gaps are in mm in every form, where a
tolerance of τ/ℓ on them means τ mm. D and R belong to the assembly, U to a load case, and to those that are
solved from its answer.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from problems.stiffness import power_of_two

from .assembly import DualLoadCase, LoadCase, Vector
from .problem import Problem, in_form, read_only

USUAL = 2.0**8  # mm: displacements between this and its inverse need no unit of their own
FAR = 2.0**30  # times max |f_i|/k_ii and the largest overlap: beyond all displacements


@dataclass(frozen=True)
class Units:
    """The units of a problem, D (n,), R (m,) and δ, and ℓ, that of the load cases solved in them."""

    problem: Problem
    D: Vector
    R: Vector
    delta: float
    length: float = 1.0

    @classmethod
    def of(cls, problem: Problem) -> "Units":
        K, A, in_mm = problem.assembly.K, problem.assembly.A, problem.assembly.junction
        D = np.ones(A.shape[0])
        if not (problem.bounded or K.dense):
            D = K.units.copy()
            if in_mm is not None:
                D[in_mm] = _median(D[in_mm])
        columns = np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
        lengths = np.zeros(A.shape[1])
        np.maximum.at(lengths, columns, abs(A.data) * D[A.indices])
        return cls(problem, D, 1 / power_of_two(lengths), _median(D[A.indices] if A.nnz else D))

    def scaled(self) -> Problem:
        """The problem in these units; itself, if D and R are 1."""
        if (self.D == 1).all() and (self.R == 1).all():
            return self.problem
        return in_form(self.problem.prepared.scaled(self.D, self.R), self.problem.form)

    def of_loads(self, loads: Sequence[LoadCase]) -> "Units":
        """The units with the ℓ of these load cases; 1 if there are neither loads nor gaps."""
        size = self._size(loads)
        return replace(self, length=1.0 if size == 0 or _usual(size) else float(power_of_two(size)))

    def followed_by(self, load: LoadCase) -> "Units":
        """The same units, in which earlier answers stay valid; new ones for a load case of another size."""
        size = self._size([load])
        return self if _usual(size / self.length) else self.of_loads([load])

    def _size(self, loads: Sequence[LoadCase]) -> float:
        """An estimate of the displacements, mm."""
        gaps = self.delta * self.R * np.array([load.g for load in loads])
        size = float(abs(gaps).max(initial=0.0))
        if _usual(size):
            return size
        moved = max(map(self._moved, loads))
        reach = FAR * max(moved, float(-gaps.min(initial=0.0))) or np.inf
        return max(moved, float(abs(gaps[abs(gaps) <= reach]).max(initial=0.0)))

    def _moved(self, load: LoadCase) -> float:
        """max |f_i|/k_ii in the unit of displacements at contacts, mm."""
        if not load.f.any():
            return 0.0
        return float(abs(self.delta * load.f / (self.D * self.problem.assembly.K.diagonal)).max())

    @property
    def U(self) -> float:
        return self.length / self.delta

    @property
    def unchanged(self) -> bool:
        """Whether these are the units of the problem itself."""
        return bool(self.U == 1 and (self.D == 1).all() and (self.R == 1).all())

    def load(self, load: LoadCase) -> LoadCase:
        """The load case in these units."""
        if self.unchanged:
            return load
        scaled = {"f": self.D * load.f / self.U, "g": self.R * load.g / self.U}
        if isinstance(load, DualLoadCase):
            scaled["p"] = self.R * load.p / self.U
        return read_only(replace(load, **scaled, energy=self.U * self.U, length=self.length))

    def start(self, lam: Vector, gap: Vector, x: Vector | None) -> tuple[Vector, Vector, Vector | None]:
        """λ, gaps and x of a warm start, in these units."""
        x = None if x is None else x / (self.U * self.D)
        return lam / (self.U * self.R), gap * self.R / self.U, x

    def answer(self, lam: Any, x: Any) -> tuple[Any, Any]:
        """λ and x in the problem's units; anything but a vector of their length stays, to be refused."""
        return _times(self.U * self.R, lam), _times(self.U * self.D, x)


def _usual(size: float) -> bool:
    return 1 / USUAL <= size <= USUAL


def _median(values: Vector) -> float:
    """The upper median, which is one of the values."""
    return float(np.sort(values)[len(values) // 2])


def _times(units: Vector, answer: Any) -> Any:
    try:  # also of a list, or an array of JAX or PyTorch
        vector = answer if isinstance(answer, np.ndarray) else np.asarray(answer)
    except Exception:  # of a class of the user's
        return answer
    real = vector.dtype.kind in "fiu" and vector.shape == units.shape
    return units * vector if real else answer
