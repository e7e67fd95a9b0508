"""Problems whose spectrum and answer are exact: nothing in them is rounded.

With the Hadamard matrix H (n, n), Hᵀ = H, HH = nI, entries ±1 and n a power of two,

    K = HDH/n,  D = diag(d) of whole numbers,    x = Hc, c whole,    Kx = H(Dc),

so K has the eigenvalues d, and all entries and partial sums are whole numbers. With λ ≥ 0 and y ≥ 0,
λᵢyᵢ = 0, on the same grid, f = Kx + Aλ and g = Aᵀx + y hold in float64 as they stand, as long as no sum
passes 2⁵³: x and λ are the answer, without an error. All is multiplied by powers of two at the end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector

from .ladder import Made

STIFFNESS = 64.0  # N/mm: the smallest eigenvalue of K

Random = np.random.Generator


@dataclass(frozen=True)
class Shares:
    """Of the contacts: those closed with a force, and those that touch without one (λᵢ = yᵢ = 0)."""

    closed: float = 0.4
    weak: float = 0.0


@dataclass(frozen=True)
class Frame:
    """K and A in whole numbers times a power of two, and the grid that answers are chosen on.

    d : the eigenvalues of each block of K, whole. A : (n, m). length : mm, force : N, of one step.
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
        return Assembly(blocks, self.A, None, tuple(f"part {k + 1}" for k in range(len(blocks))))


def spectrum(n: int, condition: float) -> Vector:
    """n whole numbers from 1 to about `condition`, evenly spread by their logarithms."""
    return np.round(np.geomspace(1.0, condition, n))


def frame(*d: Vector, A: sp.csc_array | None = None) -> Frame:
    """Parts with these eigenvalues; where no A is given, two equal parts in contact at every node.

    One step is so fine that a force of STIFFNESS · 1 mm moves the stiffest mode by one.
    """
    if A is None:
        one = sp.eye_array(len(d[0]))
        A = sp.csc_array(sp.vstack([one, -one]))
    length = 2.0 ** -np.ceil(np.log2(max(part.max() for part in d)))
    return Frame(d, A, length, STIFFNESS * length)


def solved(base: Frame, seed: int, shares: Shares | None = None) -> Made:
    """A load whose answer is chosen: forces of one size in all modes, gaps up to about 0.5 mm."""
    random = np.random.default_rng(seed)
    parts = [_modes(random, d, base.largest) for d in base.d]
    x, Kx = np.concatenate([x for x, _ in parts]), np.concatenate([Kx for _, Kx in parts])
    lam, y = _contacts(random, base, shares or Shares())
    return from_answer(base, x, Kx, lam, y)


def from_answer(base: Frame, x: Vector, Kx: Vector, lam: Vector, y: Vector) -> Made:
    """The problem that x, λ and the gaps y answer, all in steps of the grid."""
    f, g = Kx + base.A @ lam, base.A.T @ x + y
    load = LoadCase(f * base.force, g * base.length)
    return Made(base.assembly(), load, x * base.length, lam * base.force)


def _stiffness(d: Vector) -> Matrix:
    H = sla.hadamard(len(d), dtype=float)
    return np.asfortranarray((H * d) @ H / len(d))


def _modes(random: Random, d: Vector, force: float) -> tuple[Vector, Vector]:
    """x and Kx of a part with a force of half to all of `force`, either way, in each of its modes."""
    H = sla.hadamard(len(d), dtype=float)
    share = random.integers(128, 256, len(d)) / 256
    c = np.where(random.random(len(d)) < 0.5, -1.0, 1.0) * np.round(share * force / d)
    return H @ c, H @ (d * c)


def _contacts(random: Random, base: Frame, shares: Shares) -> tuple[Vector, Vector]:
    """λ up to STIFFNESS · 1 mm and gaps up to half a millimetre, in steps."""
    m, largest = base.A.shape[1], int(base.largest)
    kind = random.permutation(m)
    closed, weak = round(shares.closed * m), round(shares.weak * m)
    lam = random.integers(max(largest // 8, 1), largest + 1, m).astype(float)
    y = random.integers(max(largest // 64, 1), max(largest // 2, 1) + 1, m).astype(float)
    return np.where(kind < closed, lam, 0.0), np.where(kind < closed + weak, 0.0, y)
