"""Manufactured problems with an exact spectrum and an exact solution: nothing in them is rounded.

With the Hadamard matrix H (n, n), Hᵀ = H, HH = nI, entries ±1 and n a power of two,

    K = HDH/n,  D = diag(d) of integers,    x = Hc, c integer,    Kx = H(Dc),

so K has the eigenvalues d, and all entries and partial sums are integers. (Any other n is a sum of
powers of two; H is then block diagonal, of the Hadamard matrices of these orders.) With λ ≥ 0 and y ≥ 0,
λᵢyᵢ = 0, on the same grid, f = Kx + Aλ and g = Aᵀx + y hold exactly in float64 as long as no sum exceeds 2⁵³:
x and λ are the exact solution. Finally everything is scaled by powers of two.
"""

import itertools
from functools import partial
from typing import TypeAlias

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.model.scene import ManufacturedProblem, ManufacturedScene
from problems.stiffness.operator import Stiffness

STIFFNESS = 64.0  # N/mm: the smallest eigenvalue of K

Random = np.random.Generator
Contacts: TypeAlias = sp.csc_array | None  # A


def spectrum(n: int, condition: float) -> Vector:
    """n integers from 1 to about `condition`, evenly spaced on a logarithmic scale."""
    return np.round(np.geomspace(1.0, condition, n))


def contacts(n: int, duplicated: int = 0, tilt: float = 0.0) -> sp.csc_array:
    """A (2n, n + duplicated) of two parts of n unknowns, in contact at each, and at the first ones once more.

    A duplicate touches the second part beside the node of the original, `tilt` of the way to another node. If
    n is no power of two, the unknowns of the second part are in reverse order: so the blocks of H in one part
    overlap those in the other, and no contact stands alone.
    """
    one = sp.eye_array(n, format="csc")
    beside = one[:, :duplicated] + tilt * one[:, duplicated : 2 * duplicated]
    A = sp.csc_array(sp.block_array([[one, one[:, :duplicated]], [-one, -beside]]))
    return A if n & (n - 1) == 0 else sp.csc_array(A[np.r_[:n, 2 * n - 1 : n - 1 : -1]])


def exact_assembly(*d: Vector, A: Contacts = None) -> Assembly:
    """Parts with the eigenvalues STIFFNESS · d; by default two equal parts, in contact at every node."""
    K = Stiffness.of(*(STIFFNESS * _stiffness(part) for part in d))
    names = tuple(f"part {k + 1}" for k in range(len(d)))
    return Assembly(K, contacts(len(d[0])) if A is None else A, None, names)


def manufacture(
    *d: Vector, seed: int, A: Contacts = None, closed: float = 0.4, weak: float = 0.0
) -> ManufacturedProblem:
    """`exact_assembly` with a prescribed solution: similar forces in all modes, gaps up to about 0.5 mm.

    closed, weak : fractions of the contacts: closed with a force, and weakly active (λᵢ = yᵢ = 0).
    A grid step is so fine that a force of STIFFNESS · 1 mm moves the stiffest mode by one step.
    """
    assembly, random, largest = exact_assembly(*d, A=A), np.random.default_rng(seed), max(map(np.max, d))
    x, Kx = np.hstack([_modes(random, part, largest) for part in d])
    lam, y = _contacts(random, assembly.m, int(largest), closed, weak)
    length = 2.0 ** -np.ceil(np.log2(largest))  # mm, of one grid step
    force = STIFFNESS * length  # N
    load = LoadCase((Kx + assembly.A @ lam) * force, (assembly.A.T @ x + y) * length)
    return ManufacturedProblem(assembly, load, x * length, lam * force)


def two_parts(
    n: int, condition: float, seed: int, A: Contacts = None, **shares: float
) -> ManufacturedProblem:
    """`manufacture` of two parts of n unknowns with the same spectrum."""
    d = spectrum(n, condition)
    return manufacture(d, d, seed=seed, A=A, **shares)


def deferred(
    title: str, n: int, condition: float, seed: int, A: Contacts = None, refused: str = "", **shares: float
) -> ManufacturedScene:
    """The rung of `two_parts` with n unknowns together, made when needed."""
    size = n // 2
    make, m = partial(two_parts, size, condition, seed, A, **shares), size if A is None else A.shape[1]
    return ManufacturedScene("", title, make, (size, size), m, refused=refused)


def _stiffness(d: Vector) -> Matrix:
    """K_ij = (Hd)_{i xor j}/n, as h_ik h_kj = h_{k, i xor j} for Sylvester's H."""
    blocks = []
    for rows in _blocks(len(d)):
        i = np.arange(rows.stop - rows.start)
        blocks.append((_hadamard(d[rows]) / len(i))[i ^ i[:, None]])
    return np.asfortranarray(sla.block_diag(*blocks))


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


def _contacts(random: Random, m: int, largest: int, closed: float, weak: float) -> tuple[Vector, Vector]:
    """λ up to STIFFNESS · 1 mm and gaps up to half a millimetre, in grid steps."""
    kind = random.permutation(m)
    with_force, touching = round(closed * m), round(closed * m) + round(weak * m)
    lam = random.integers(max(largest // 8, 1), largest + 1, m).astype(float)
    y = random.integers(max(largest // 64, 1), max(largest // 2, 1) + 1, m).astype(float)
    return np.where(kind < with_force, lam, 0.0), np.where(kind < touching, 0.0, y)
