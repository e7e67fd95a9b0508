"""Bounds on the displacement errors of answers in the sparse form, by a proven answer beside each.

Each answer is refined to twice the working precision, with a proven bound (see `sparse_bound`); its own bound
is the distance to that, and this bound. Some answers at a time share their solutions with K; one that is not
proven so gets the reference of a single load case.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from harness.verification.reference import (
    Reference,
    certified_active_set,
    of_refined,
    sparse_bound,
)
from harness.verification.sparse_bound import PROVEN_ENOUGH_MM, SparseBound
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared

from .assess import Assessment


class SparseAssessor:
    """Of answers to load cases of an assembly, whose common part of the proofs is made once.

    enough_mm : a wider bound is tried to be improved by a factorisation for the contact set.
    """

    def __init__(self, prepared: Prepared, enough_mm: float = PROVEN_ENOUGH_MM) -> None:
        self.prepared, self.enough_mm = prepared, enough_mm

    def __call__(
        self, loads: Sequence[LoadCase], lams: Sequence[Vector], xs: Sequence[Vector | None]
    ) -> list[Assessment]:
        """An assessment per load of its finite λ (m,) and x (n,), all unknowns of the model."""
        given = [x for x in xs if x is not None]
        known = given if len(given) == len(xs) else None
        answers = known or [self.prepared.recover(lam, load) for lam, load in zip(lams, loads, strict=True)]
        references = self._references(loads, lams, known)
        return [_of(self.prepared, *each) for each in zip(references, loads, lams, answers, strict=True)]

    def _references(
        self, loads: Sequence[LoadCase], lams: Sequence[Vector], xs: Sequence[Vector] | None
    ) -> list[Reference]:
        if self.bound is None:
            pairs = zip(loads, lams, strict=True)
            return [certified_active_set(self.prepared, load, guess=lam) for load, lam in pairs]
        refined = self.bound.proven(loads, lams, xs)
        return [
            of_refined(found)
            if found.bound_mm <= self.enough_mm
            else certified_active_set(self.prepared, load, guess=lam)
            for found, load, lam in zip(refined, loads, lams, strict=True)
        ]

    @cached_property
    def bound(self) -> SparseBound | None:
        return sparse_bound(self.prepared)


def _of(prepared: Prepared, known: Reference, load: LoadCase, lam: Vector, x: Vector) -> Assessment:
    assembly = prepared.assembly
    away = float(abs(assembly.at_junction(x - known.x)).max(initial=0.0))
    gap = load.g - assembly.A.T @ x
    r = load.f - assembly.K.multiply(x) - assembly.A @ lam
    return Assessment(
        x=x,
        gap=gap,
        active=int(known.active.sum()),
        bound_mm=(1 + 2 * np.finfo(float).eps) * (away + known.bound_mm),
        primal_residual=float(max(-gap.min(initial=0.0), 0.0)),
        dual_residual=float(max(abs(r).max(initial=0.0), -lam.min(initial=0.0))),
        duality_gap=float(abs(lam @ gap - x @ r)),
    )
