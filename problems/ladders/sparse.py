"""Sparse problems that others know, drawn at random: sparse/<family>/<n>-<k>, in suite `hard-sparse`.

A family is a function of the number of unknowns n, of a difficulty from 0 to 1 and of a seed. The SHA-256 of
"<version>/<family>/<n>/<k>" draws the last two, so that a version has other problems than the one before. On
grids, whose sides are drawn, n is a little less or more.

isotonic   min ½ Σ wᵢ(xᵢ − yᵢ)²,   x₁ ≤ x₂ ≤ … ≤ xₙ

Barlow, Bartholomew, Bremner and Brunk, Statistical Inference under Order Restrictions (1972).

convex     min ½ Σ (xᵢ − yᵢ)²,   2xᵢ ≤ xᵢ₋₁ + xᵢ₊₁

W. Li and J. Swetits, SIAM J. Optim. 3:466–488 (1993): problems LISWET of Maros and Mészáros, order 2.

monotone   min ½ Σ (xᵢⱼ − yᵢⱼ)²,   xᵢⱼ ≤ xᵢ₊₁,ⱼ,   xᵢⱼ ≤ xᵢ,ⱼ₊₁

R. Dykstra and T. Robertson, Ann. Statist. 10:708–716 (1982). Rows along a cycle of the grid are dependent.
In these three y is a trend that keeps the order, a wave that does not, and noise: the harder, the less trend.

rows       a chain of springs in random order, and n/2 rows of random unknowns with entries ±1 and one 2

Made from its exact answer; the harder, the softer is the chain, the longer are the rows, and the more
contacts touch without a force.
"""

from collections.abc import Callable
from functools import partial
from hashlib import sha256

import numpy as np
import scipy.sparse as sp

from problems import __version__
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.model.scene import ManufacturedProblem, ManufacturedScene
from problems.stiffness.operator import Stiffness

from . import Ladder, Scene

Family = Callable[[int, float, int], Scene]
DRAWS = 4  # problems of a family and size
GRID = 2.0**20  # data are multiples of 1/GRID, so that no product with a weight is rounded


def drawn(name: str, family: Family, *sizes: int) -> Ladder:
    """The rungs of a family, the smallest first."""
    return {f"{n}-{k}": partial(_rung, name, family, n, k) for n in sizes for k in range(DRAWS)}


def _rung(name: str, family: Family, n: int, k: int) -> Scene:
    digest = sha256(f"{__version__}/{name}/{n}/{k}".encode()).digest()
    difficulty = int.from_bytes(digest[:2], "big") / 2**16
    return family(n, difficulty, int.from_bytes(digest[2:10], "big"))


def sparse_scene(
    title: str, difficulty: float, n: int, m: int, make: Callable[[], ManufacturedProblem]
) -> Scene:
    """A rung with n unknowns and m contacts, made when needed."""
    return ManufacturedScene("", f"{title}, difficulty {difficulty:.2f}", make, (n,), m, sparse=True)


def problem(K: sp.sparray, A: sp.sparray, f: Vector, g: Vector) -> ManufacturedProblem:
    """The problem of these matrices, K as one block."""
    return ManufacturedProblem(Assembly(Stiffness.of(sp.csc_array(K)), sp.csc_array(A)), LoadCase(f, g))


def sides(n: int, seed: int) -> tuple[int, int]:
    """The sides of a grid of about n nodes, one up to three times as long as the other."""
    first = round(np.sqrt(n * np.random.default_rng(seed).uniform(1 / 3, 3)))
    return first, round(n / first)


def _observed(random: np.random.Generator, trend: Vector, phase: Vector, difficulty: float) -> Vector:
    """y: the trend, a wave along the phase, and noise of 0.01 to 1."""
    wave = np.sin(2 * np.pi * (random.uniform(1, 4) * phase + random.random()))
    noise = 10 ** (2 * difficulty - 2) * random.standard_normal(trend.size)
    return np.round(GRID * ((1 - difficulty) * trend + difficulty * wave + noise)) / GRID


def _steps(n: int) -> sp.csc_array:
    """(n, n − 1): xᵢ − xᵢ₊₁."""
    return sp.csc_array(sp.diags_array([1.0, -1.0], offsets=[0, -1], shape=(n, n - 1)))


def isotonic(n: int, difficulty: float, seed: int) -> Scene:
    def make() -> ManufacturedProblem:
        random, t = np.random.default_rng(seed), np.linspace(0.0, 1.0, n)
        y = _observed(random, 2 * t, t, difficulty)
        w = np.exp2(random.integers(-2, 3, n))
        return problem(sp.diags_array(w), _steps(n), w * y, np.zeros(n - 1))

    return sparse_scene("Isotonic regression", difficulty, n, n - 1, make)


def convex(n: int, difficulty: float, seed: int) -> Scene:
    def make() -> ManufacturedProblem:
        t: Vector = np.linspace(0.0, 1.0, n)
        y = _observed(np.random.default_rng(seed), (2 * t - 1) ** 2, t, difficulty)
        bends = sp.diags_array([-1.0, 2.0, -1.0], offsets=[0, -1, -2], shape=(n, n - 2))
        return problem(sp.eye_array(n), bends, y, np.zeros(n - 2))

    return sparse_scene("Convex regression", difficulty, n, n - 2, make)


def monotone(n: int, difficulty: float, seed: int) -> Scene:
    a, b = sides(n, seed)

    def make() -> ManufacturedProblem:
        s, t = (
            line.ravel() for line in np.meshgrid(np.linspace(0, 1, a), np.linspace(0, 1, b), indexing="ij")
        )
        random = np.random.default_rng(seed)
        y = _observed(random, s + t, s * random.uniform(-1, 1) + t, difficulty)
        A = sp.hstack([sp.kron(_steps(a), sp.eye_array(b)), sp.kron(sp.eye_array(a), _steps(b))])
        return problem(sp.eye_array(a * b), A, y, np.zeros(A.shape[1]))

    return sparse_scene(f"Monotone regression on {a} × {b} nodes", difficulty, a * b, 2 * a * b - a - b, make)


def rows(n: int, difficulty: float, seed: int) -> Scene:
    m = n // 2

    def make() -> ManufacturedProblem:
        random = np.random.default_rng(seed)
        order, softness = random.permutation(n), round(10 ** (3 * difficulty))
        K = sp.eye_array(n) + softness * _steps(n) @ _steps(n).T
        others = 1 + round(3 * difficulty)
        at = np.concatenate([random.permutation(n)[:m], random.integers(0, n, others * m)])
        entries = np.concatenate([np.full(m, 2.0), random.choice([-1.0, 1.0], others * m)])
        A = sp.coo_array((entries, (at, np.tile(np.arange(m), 1 + others))), shape=(n, m)).tocsc()
        K = sp.csc_array(K)[order][:, order]
        x, lam, y = (random.integers(1, int(GRID), size) for size in (n, m, m))
        kind = random.random(m)
        lam = np.where(kind < 0.5, lam, 0.0)
        y = np.where(kind > 0.5 + 0.3 * difficulty, y, 0.0)
        made = problem(K, A, (K @ x + A @ lam) / GRID, (A.T @ x + y) / GRID)
        return ManufacturedProblem(made.assembly, made.load, x / GRID, lam / GRID)

    return sparse_scene("Random sparse rows", difficulty, n, m, make)


SPARSE: dict[str, Ladder] = {
    "isotonic": drawn("isotonic", isotonic, 500, 4000, 25000),
    "convex": drawn("convex", convex, 500, 2500, 10000),
    "monotone": drawn("monotone", monotone, 500, 4000, 25000),
    "rows": drawn("rows", rows, 500, 1500, 4000),
}
