"""Matrices and a load that were made in memory, with their exact answer if it is known."""

from __future__ import annotations

from dataclasses import dataclass

from .assembly import Assembly, LoadCase, Vector


@dataclass(frozen=True, eq=False)
class ManufacturedProblem:
    """Matrices and load case of a rung without plates, with the exact solution if it is known.

    x (n,), lam (m,) : K x + A λ = f, Aᵀx ≤ g, λ ≥ 0, λᵀ(g − Aᵀx) = 0 hold exactly for these numbers, without
        any rounding; None if the solution is unknown.
    unit_mm (n,), gap_unit_mm (m,) : the length of one unit of x and of g, mm.
    """

    assembly: Assembly
    load: LoadCase
    x: Vector | None = None
    lam: Vector | None = None
    unit_mm: Vector | float = 1.0
    gap_unit_mm: Vector | float = 1.0
