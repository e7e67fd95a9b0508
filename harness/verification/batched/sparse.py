"""Bounds on the displacement errors of answers in the sparse form, by a proven answer beside each.

Each answer is refined to twice the working precision, with a proven bound (see `sparse_bound`); its own bound
is the distance to that, and this bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from harness.verification.reference import refined_active_set, sparse_bound
from harness.verification.sparse_bound import SparseBound
from problems.forms.assembly import LoadCase, Vector
from problems.forms.sparse_prepared import SparsePrepared

from .assess import Assessment


class SparseAssessor:
    """Of answers to load cases of an assembly, whose common part of the proofs is made once."""

    def __init__(self, prepared: SparsePrepared) -> None:
        self.prepared = prepared

    def __call__(
        self, loads: Sequence[LoadCase], lams: Sequence[Vector], xs: Sequence[Vector | None]
    ) -> list[Assessment]:
        """An assessment per load of its finite λ (m,) and x (n,), all unknowns of the model."""
        return [_of(self.prepared, self.bound, *answer) for answer in zip(loads, lams, xs, strict=True)]

    @cached_property
    def bound(self) -> SparseBound | None:
        return sparse_bound(self.prepared)


def _of(
    prepared: SparsePrepared, bound: SparseBound | None, load: LoadCase, lam: Vector, x: Vector | None
) -> Assessment:
    assembly = prepared.assembly
    x = prepared.recover(lam, load) if x is None else x
    known = refined_active_set(prepared, load, guess=lam, bound=bound)
    away = float(abs(assembly.at_junction(x - known.x)).max(initial=0.0))
    gap = load.g - assembly.A.T @ x
    r = load.f - assembly.multiply_K(x) - assembly.A @ lam
    return Assessment(
        x=x,
        gap=gap,
        active=int(known.active.sum()),
        bound_mm=(1 + 2 * np.finfo(float).eps) * (away + known.bound_mm),
        primal_residual=float(max(-gap.min(initial=0.0), 0.0)),
        dual_residual=float(max(abs(r).max(initial=0.0), -lam.min(initial=0.0))),
        duality_gap=float(abs(lam @ gap - x @ r)),
    )
