"""Matrices and a load that are made in memory, with their exact answer if it is known."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

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


@dataclass(frozen=True, eq=False)
class DeferredProblem:
    """A manufactured problem so large that it is made when needed only, and not kept beside another.

    sizes : the unknowns of each block of K. m : the contacts. make : the same problem at every call.
    sparse : whether the blocks are.
    """

    sizes: tuple[int, ...]
    m: int
    make: Callable[[], ManufacturedProblem]
    sparse: bool = False


@lru_cache(maxsize=1)
def made(problem: DeferredProblem) -> ManufacturedProblem:
    """The problem itself; of several, only the last one stays in memory."""
    return problem.make()
