"""Bounds on the displacement errors of answers in the sparse form, by a certified answer beside each.

From the contact set of the answer the optimality conditions are solved to twice the working precision and
certified (see `reference`); the bound is the distance to that answer plus its own bound. Whatever set the
answer has, the bound holds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from harness.verification.reference import refined_active_set
from problems.forms.assembly import LoadCase, Vector
from problems.forms.sparse_prepared import SparsePrepared

from .assess import Assessment


def assess(
    prepared: SparsePrepared, loads: Sequence[LoadCase], lams: Sequence[Vector], xs: Sequence[Vector | None]
) -> list[Assessment]:
    """An assessment per load of its finite λ (m,) and x (n,), all unknowns of the model."""
    return [_of(prepared, *answer) for answer in zip(loads, lams, xs, strict=True)]


def _of(prepared: SparsePrepared, load: LoadCase, lam: Vector, x: Vector | None) -> Assessment:
    assembly = prepared.assembly
    x = prepared.recover(lam, load) if x is None else x
    known = refined_active_set(prepared, load, start=lam > 0)
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
