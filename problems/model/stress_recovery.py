"""The stresses of a superelement from its unknowns, σ = S x, by a recovery matrix of the user.

S has a column per row of K, in their order, and three rows per point, point after point: σ_xx, σ_yy, τ_xy.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.formats import read_stiffness
from problems.forms.assembly import Indices, Matrix, Vector
from problems.input.tables import read_columns

from .stress import PartStress

SIDES = {"top": 1, "bottom": -1}


@dataclass(frozen=True)
class StressRecovery:
    """A recovery matrix and its points.

    places (k, 2) : x and y, mm. side (k,) : 1 or -1. S (3k, n) : N/mm² per mm or rad.
    """

    places: Matrix
    side: Indices
    S: sp.csr_array

    @classmethod
    def of(cls, files: Sequence[Path], n: int) -> "StressRecovery":
        """Read the files of S and of its points; without files there are none. Raises InputError."""
        if not files:
            return cls(np.zeros((0, 2)), np.zeros(0, dtype=np.intp), sp.csr_array((0, n)))
        matrix, points = files
        read = read_columns(points, ("x", "y"))
        words = [word.strip().lower() for word in read.words["side"] or [""] * len(read.rows)]
        wrong = [(line, word) for line, word in zip(read.lines, words, strict=True) if word not in SIDES]
        faults = [Fault(str(points), f"line {line}, side", word, "top or bottom") for line, word in wrong[:1]]
        if read.faults + faults:
            raise InputError(read.faults + faults)
        M, labels, _ = read_stiffness(matrix, name="S")
        if labels is not None or M.shape != (3 * len(words), n):
            shape = list(M.shape) if labels is None else "rows with labels of nodes"
            allowed = f"{[3 * len(words), n]}: three per point of {points.name}; one per row of K, unlabelled"
            raise InputError.one(matrix, "S.shape", shape, allowed)
        S = sp.csr_array(M)
        if np.iscomplexobj(S.data) or not np.isfinite(S.data).all():
            raise InputError.one(matrix, "S", "NaN, infinity or complex", "finite real numbers")
        return cls(np.array(read.rows), np.array([SIDES[word] for word in words]), S.astype(float))

    def stress(self, part: str, x: Vector) -> PartStress:
        """The stresses of a part with the unknowns x (n,); K of the joint bounds their sensitivity."""
        components, nowhere = (self.S @ x).reshape(-1, 3), np.zeros(len(self.side), dtype=bool)
        return PartStress(part, self.places, components, np.full(len(nowhere), np.inf), nowhere, self.side)
