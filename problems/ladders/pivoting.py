"""Pivoting: contact sets by the thousand for methods that exchange one contact at a time.

fathi, murty: single exchanges of signs visit exponentially many contact sets. Q = LLᵀ, L unit lower
triangular with 2 below the diagonal, and p = 1 (Fathi, Math. Programming 17:335–344, 1979) or pᵢ = 2 − 2⁻ⁱ,
i from 0 (the p of Murty, Math. Programming Study 7:61–73, 1978, divided by 2ᵐ). L = (I + S)(I − S)⁻¹ with S
the shift, so L⁻¹ has entries 1 and ±2, and K = Q⁻¹ = L⁻ᵀL⁻¹ is whole; cond(K) ≈ (4m/π)⁴. As
Qe₁ = (1, 2, …, 2)ᵀ, the solution is λ = e₁, x = −Qe₁: one closed contact of m. Murty's gaps shrink by half
from contact to contact, to 2¹⁻ᵐ.

chain: a dual active-set method that adds the most violated contact drops it again, and again.
K = B(2I + S + Sᵀ − eeᵀ)B with e the last unit vector, B = diag(2^−round(i/2)), and x = g, gᵢ ≈ −(3/4)ⁱ, i
from 0: all contacts close in the end, after m²/4 + 4 exchanges of Goldfarb and Idnani's method on the primal
problem (counted for m = 8, 16, 24, 32; found by search, no source).

vertex: as many contacts as unknowns, in random directions, all of them touch, and two thirds without a force.
"""

from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.model.scene import ManufacturedProblem
from problems.stiffness.operator import Stiffness

from . import Ladder, Scene, matrices
from .manufactured import manufacture, spectrum

GRID = 2.0**24  # the chain's gaps are multiples of 1/GRID


def _triangular(author: str, p: Vector) -> Scene:
    m = len(p)
    i, j = np.indices((m, m))
    inverse = np.where(i > j, 2.0 * (-1.0) ** (i - j), np.where(i == j, 1.0, 0.0))
    x, lam = np.full(m, -2.0), np.zeros(m)
    x[0], lam[0] = -1.0, 1.0
    title = f"{author}'s problem with {m} contacts, one closed"
    return _one_to_one(title, inverse.T @ inverse, np.zeros(m), -p, x, lam)


def _chain(m: int) -> Scene:
    i = np.arange(m)
    B = np.exp2(-np.round(i / 2))
    K = 2 * np.eye(m) + np.eye(m, k=1) + np.eye(m, k=-1)
    K[-1, -1] = 1.0
    K *= B * B[:, None]
    g = -np.round(GRID * 0.75**i) / GRID
    title = f"A chain of {m} springs: dual active-set methods add each contact again and again"
    return _one_to_one(title, K, np.zeros(m), g, g, -K @ g)


def _one_to_one(title: str, K: Matrix, f: Vector, g: Vector, x: Vector, lam: Vector) -> Scene:
    """One part, with a contact at each unknown."""
    A = sp.eye_array(len(K), format="csc")
    assembly = Assembly(Stiffness.of(np.asfortranarray(K)), A, None, ("part 1",))
    return matrices(title, ManufacturedProblem(assembly, LoadCase(f, g), x, lam))


def _vertex(n: int) -> Scene:
    """Contact j acts on unknown j and on up to two before it, so the columns of A are independent."""
    random = np.random.default_rng(17)
    A = np.eye(n)
    for j in range(1, n):
        A[random.integers(0, j, 2), j] = random.choice([-1.0, 1.0], 2)
    made = manufacture(spectrum(n, 1e4), A=sp.csc_array(A), seed=18, closed=1 / 3, weak=2 / 3)
    return matrices(f"A vertex of {n} contacts on {n} unknowns, a third with a force", made)


RUNGS: dict[str, Ladder] = {
    "pivoting": {
        **{
            f"fathi-{m:03d}": partial(_triangular, "Fathi", np.ones(m))
            for m in (8, 16, 32, 48, 64, 128, 256, 512)
        },
        **{
            f"murty-{m:02d}": partial(_triangular, "Murty", 2.0 - np.exp2(-np.arange(m)))
            for m in (8, 16, 32, 48)
        },
        **{f"chain-{m:02d}": partial(_chain, m) for m in (8, 16, 24, 32)},
        **{f"vertex-{n:03d}": partial(_vertex, n) for n in (16, 64, 256)},
    }
}
