"""Manufactured problems with an exact spectrum and an exact solution: nothing in them is rounded.

With the Hadamard matrix H (n, n), Hᵀ = H, HH = nI, entries ±1 and n a power of two,

    K = HDH/n,  D = diag(d) of integers,    x = Hc, c integer,    Kx = H(Dc),

so K has the eigenvalues d, and all entries and partial sums are integers. (Any other n is a sum of
powers of two; H is then block diagonal, of the Hadamard matrices of these orders.) With λ ≥ 0 and y ≥ 0,
λᵢyᵢ = 0, on the same grid, f = Kx + Aλ and g = Aᵀx + y hold exactly in float64 as long as no sum exceeds 2⁵³:
x and λ are the exact solution. Finally everything is scaled by powers of two.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.stiffness.operator import Stiffness

from .ladder import ManufacturedProblem

STIFFNESS = 64.0  # N/mm: the smallest eigenvalue of K

Random = np.random.Generator


@dataclass(frozen=True)
class Shares:
    """Fractions of the contacts: closed with a force, and weakly active (λᵢ = yᵢ = 0)."""

    closed: float = 0.4
    weak: float = 0.0


@dataclass(frozen=True)
class ExactModel:
    """K and A as integers times a power of two, and the grid of the solutions.

    d : the eigenvalues of each block of K, integers. A : (n, m). length : mm, force : N, of one grid step.
    """

    d: tuple[Vector, ...]
    A: sp.csc_array
    length: float
    force: float

    @property
    def largest(self) -> float:
        return float(max(d.max() for d in self.d))

    def assembly(self) -> Assembly:
        """K in N/mm; its smallest eigenvalue is force/length times that of d."""
        blocks = tuple(_stiffness(d) * (self.force / self.length) for d in self.d)
        names = tuple(f"part {k + 1}" for k in range(len(blocks)))
        return Assembly(Stiffness.of(*blocks), self.A, None, names)


def spectrum(n: int, condition: float) -> Vector:
    """n integers from 1 to about `condition`, evenly spaced on a logarithmic scale."""
    return np.round(np.geomspace(1.0, condition, n))


def exact_model(*d: Vector, A: sp.csc_array | None = None) -> ExactModel:
    """Parts with these eigenvalues; by default A is for two equal parts in contact at every node.

    A grid step is so fine that a force of STIFFNESS · 1 mm moves the stiffest mode by one step.
    """
    if A is None:
        one = sp.eye_array(len(d[0]))
        A = sp.csc_array(sp.vstack([one, -one]))
    length = 2.0 ** -np.ceil(np.log2(max(part.max() for part in d)))
    return ExactModel(d, A, length, STIFFNESS * length)


def manufacture(model: ExactModel, seed: int, shares: Shares | None = None) -> ManufacturedProblem:
    """A problem with a prescribed solution: forces of similar size in all modes, gaps up to about 0.5 mm."""
    random = np.random.default_rng(seed)
    parts = [_modes(random, d, model.largest) for d in model.d]
    x, Kx = np.concatenate([x for x, _ in parts]), np.concatenate([Kx for _, Kx in parts])
    lam, y = _contacts(random, model, shares or Shares())
    return from_solution(model, x, Kx, lam, y)


def from_solution(model: ExactModel, x: Vector, Kx: Vector, lam: Vector, y: Vector) -> ManufacturedProblem:
    """The problem with the solution x, λ and the gaps y, all in grid steps."""
    f, g = Kx + model.A @ lam, model.A.T @ x + y
    load = LoadCase(f * model.force, g * model.length)
    return ManufacturedProblem(model.assembly(), load, x * model.length, lam * model.force)


def _stiffness(d: Vector) -> Matrix:
    """K_ij = (Hd)_{i xor j}/n, as h_ik h_kj = h_{k, i xor j} for Sylvester's H."""
    blocks = []
    for rows in _blocks(len(d)):
        i = np.arange(rows.stop - rows.start)
        blocks.append((_hadamard(d[rows]) / len(i))[i ^ i[:, None]])
    return np.asfortranarray(blocks[0] if len(blocks) == 1 else sla.block_diag(*blocks))


def _blocks(n: int) -> list[slice]:
    """The blocks of H: the powers of two in n, the largest first."""
    orders = [1 << bit for bit in reversed(range(n.bit_length())) if n >> bit & 1]
    ends = np.cumsum([0, *orders]).tolist()
    return [slice(a, b) for a, b in itertools.pairwise(ends)]


def _hadamard(v: Vector) -> Vector:
    """H v, block by block, by the fast Walsh–Hadamard transform."""
    v = v.astype(float)
    for rows in _blocks(len(v)):
        n, half = rows.stop - rows.start, 1
        while half < n:
            pairs = v[rows].reshape(-1, 2, half)
            v[rows] = np.stack([pairs[:, 0] + pairs[:, 1], pairs[:, 0] - pairs[:, 1]], axis=1).ravel()
            half *= 2
    return v


def _modes(random: Random, d: Vector, force: float) -> tuple[Vector, Vector]:
    """x and Kx of a part with a force of ±½ to ±1 times `force` in each of its modes."""
    share = random.integers(128, 256, len(d)) / 256
    c = np.where(random.random(len(d)) < 0.5, -1.0, 1.0) * np.round(share * force / d)
    return _hadamard(c), _hadamard(d * c)


def _contacts(random: Random, model: ExactModel, shares: Shares) -> tuple[Vector, Vector]:
    """λ up to STIFFNESS · 1 mm and gaps up to half a millimetre, in grid steps."""
    m, largest = model.A.shape[1], int(model.largest)
    kind = random.permutation(m)
    closed, weak = round(shares.closed * m), round(shares.weak * m)
    lam = random.integers(max(largest // 8, 1), largest + 1, m).astype(float)
    y = random.integers(max(largest // 64, 1), max(largest // 2, 1) + 1, m).astype(float)
    return np.where(kind < closed, lam, 0.0), np.where(kind < closed + weak, 0.0, y)
