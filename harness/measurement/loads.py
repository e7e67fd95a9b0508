"""Load cases side by side: what the dual form needs of them and gives back, with one pass over K for all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.forms.assembly import LoadCase, Prepared, Vector
from solvers.base import Load


def side_by_side(cases: Sequence[LoadCase]) -> LoadCase:
    """f (n, k), or (n, 1) where all have the same, and g (m, k)."""
    shared = all(case.f is cases[0].f for case in cases)
    f = cases[0].f[:, None] if shared else np.column_stack([case.f for case in cases])
    return LoadCase(f, np.column_stack([case.g for case in cases]))


def loads_of(cases: Sequence[LoadCase], prepared: Prepared) -> list[Load]:
    """The cases with p = AᵀK⁻¹f − g, read-only; K⁻¹f once where they share their f."""
    p = prepared.dual_load(side_by_side(cases)).T
    loads = [Load(case.f, case.g, np.ascontiguousarray(mine)) for case, mine in zip(cases, p, strict=True)]
    for load in loads:
        for array in (load.f, load.g, load.p):
            array.flags.writeable = False
    return loads


def recovered(
    lams: Sequence[Vector | None], cases: Sequence[LoadCase], prepared: Prepared
) -> list[Vector | None]:
    """x = K⁻¹(f − Aλ), (n,) mm, of each case that has its λ (m,)."""
    known = [k for k, lam in enumerate(lams) if lam is not None]
    found: list[Vector | None] = [None] * len(lams)
    if known:
        lam = np.column_stack([np.asarray(lams[k], dtype=float) for k in known])
        x = prepared.recover(lam, side_by_side([cases[k] for k in known])).T
        for k, mine in zip(known, x, strict=True):
            found[k] = np.ascontiguousarray(mine)
    return found
