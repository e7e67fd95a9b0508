"""Matrices and a load that were made in memory, with their exact answer if it is known."""

from __future__ import annotations

from dataclasses import dataclass

from .assembly import Assembly, LoadCase, Vector


@dataclass(frozen=True, eq=False)
class Made:
    """Matrices and load of a rung that no plates make, with their exact answer where it is known.

    x (n,), lam (m,) : K x + A λ = f, Aᵀx ≤ g, λ ≥ 0, λᵀ(g − Aᵀx) = 0 hold for these very numbers
        without any rounding; None where no answer is known.
    unit_mm (n,), gap_unit_mm (m,) : the lengths that 1 stands for in x and in g, mm.
    """

    assembly: Assembly
    load: LoadCase
    x: Vector | None = None
    lam: Vector | None = None
    unit_mm: Vector | float = 1.0
    gap_unit_mm: Vector | float = 1.0
