"""Contact problems drawn with their exact answer: integers, then scaled by powers of two.

For integers K = LLᵀ, A, x, λ ≥ 0 and y ≥ 0 with λᵢyᵢ = 0, f = Kx + Aλ and g = Aᵀx + y are integers; below 2⁵³
they are float64. In other units, K' = SKS/v, A' = SAC, f' = aSf/v, g' = aCg with powers of two S, C, v and a,
the answer is x' = aS⁻¹x, λ' = aC⁻¹λ/v: nothing is ever rounded.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from harness.conformance.known_problems import contact_rows
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.stiffness.operator import Stiffness

Random = np.random.Generator
Integers = NDArray[np.int64]

EXACT = 2**53
LOADS = 3  # per assembly


@dataclass(frozen=True)
class ExactLoad:
    """A load case with its exact answer: x (n,) in mm, λ (m,) in N."""

    load: LoadCase
    x: Vector
    lam: Vector


@dataclass(frozen=True)
class ExactProblem:
    """kind : how it was drawn. ordinary : whether no number is so small that the commands refuse it."""

    kind: str
    assembly: Assembly
    loads: tuple[ExactLoad, ...]
    ordinary: bool


def exact_problem(seed: int, index: int) -> ExactProblem:
    """The problem with this number: the same at every call."""
    random = np.random.default_rng([seed, index])
    while True:
        stiff = STIFFNESS[random.integers(len(STIFFNESS))]
        touch = CONTACTS[random.integers(len(CONTACTS))]
        blocks, A = touch(random, stiff)
        loads = [_answer(random, blocks, A) for _ in range(LOADS)]
        if all(found is not None for found in loads) and np.linalg.matrix_rank(A.astype(float)) == A.shape[1]:
            kind = f"{stiff.__name__} {touch.__name__}".replace("_", " ").strip()
            return _in_units(random, kind, blocks, A, loads)


# --- K: an integer block, positive definite ------------------------------------------------------------


def _factor(random: Random, n: int) -> Integers:
    L = np.tril(random.integers(-3, 4, (n, n)), -1)
    np.fill_diagonal(L, random.integers(1, 5, n))
    return L @ L.T


def _contrast(random: Random, n: int) -> Integers:
    """Stiff and soft parts: cond(K) up to 1e12."""
    L = np.tril(random.integers(-3, 4, (n, n)), -1)
    np.fill_diagonal(L, 2 ** random.integers(0, 10, n))
    return L @ L.T


def _beam(random: Random, n: int) -> Integers:
    """Second differences of a clamped beam."""
    D = np.eye(n, dtype=np.int64) - 2 * np.eye(n, k=-1, dtype=np.int64) + np.eye(n, k=-2, dtype=np.int64)
    return D.T @ D


def _fathi(random: Random, n: int) -> Integers:
    """K⁻¹ = LLᵀ with 1 on the diagonal of L and 2 below: single exchanges visit 2ⁿ sets."""
    i, j = np.indices((n, n))
    inverse = np.where(i > j, 2 * (-1) ** abs(i - j), np.where(i == j, 1, 0))
    return inverse.T @ inverse


def _springs(random: Random, n: int) -> Integers:
    return np.diag(random.integers(1, 100, n))


# --- A: contacts ----------------------------------------------------------------------------------------


def _two_parts(random: Random, stiff: Any) -> tuple[list[Integers], Integers]:
    pairs, tools = int(random.integers(1, 7)), int(random.integers(0, 3))
    blocks = [stiff(random, pairs + tools), stiff(random, pairs)]
    return blocks, contact_rows(pairs, tools).toarray().astype(np.int64)


def _rigid_tool(random: Random, stiff: Any) -> tuple[list[Integers], Integers]:
    n = int(random.integers(1, 13))
    return [stiff(random, n)], np.eye(n, dtype=np.int64)[:, : random.integers(1, n + 1)]


def _any_normals(random: Random, stiff: Any) -> tuple[list[Integers], Integers]:
    """Contacts that share unknowns."""
    n = int(random.integers(2, 10))
    return [stiff(random, n)], random.integers(-2, 3, (n, random.integers(1, n + 1)))


def _nearly_equal(random: Random, stiff: Any) -> tuple[list[Integers], Integers]:
    """Contacts in pairs that differ by 2⁻¹ to 2⁻¹² of a neighbour's displacement."""
    n = int(random.integers(2, 9))
    A = np.eye(n, dtype=np.int64)
    for j in range(1, n, 2):
        A[:, j] += A[:, j - 1] * 2 ** random.integers(1, 13)
    return [stiff(random, n)], A


def _exponential(random: Random, _: Any) -> tuple[list[Integers], Integers]:
    """Fathi's problem whole, its one closed contact among up to 24."""
    n = int(random.integers(8, 25))
    return [_fathi(random, n)], np.eye(n, dtype=np.int64)


STIFFNESS = (_factor, _contrast, _beam, _fathi, _springs)
CONTACTS = (_two_parts, _two_parts, _rigid_tool, _any_normals, _nearly_equal, _exponential)


# --- the answer, and the units --------------------------------------------------------------------------


def _answer(random: Random, blocks: list[Integers], A: Integers) -> tuple[Integers, ...] | None:
    """x, λ, f, g with any share of closed and weakly active contacts; None if a number is too large."""
    n, m = A.shape
    x = random.integers(-100, 101, n) * random.integers(0, 2)
    kind = random.random(m)
    closed, weak = random.choice([0.0, 0.3, 1.0]), random.choice([0.0, 0.3, 1.0])
    lam = np.where(kind < closed, random.integers(1, 100, m), 0)
    y = np.where((lam > 0) | (random.random(m) < weak), 0, random.integers(1, 100, m))
    K = np.asarray(sp.block_diag(blocks).toarray(), dtype=np.int64)
    if m == n > 7 and random.random() < 0.5:  # Fathi's own load, where K and A are his: f = 0, g = −1
        first = np.eye(n, dtype=np.int64)[0]
        x, lam, y = first - 2, first, 1 - first
    f, g = K @ x + A @ lam, A.T @ x + y
    largest = max((abs(K) @ abs(x) + abs(A) @ lam).max(), (abs(A).T @ abs(x) + y).max(initial=0))
    return (x, lam, f, g) if largest < EXACT else None


def _powers(random: Random, bits: int, size: int) -> Vector:
    return np.exp2(random.integers(-bits, bits + 1, size))


def _in_units(
    random: Random, kind: str, blocks: list[Integers], A: Integers, loads: list[Any]
) -> ExactProblem:
    n, m = A.shape
    contact_bits, unknown_bits = random.choice([0, 0, 3, 20, 40]), random.choice([0, 0, 0, 4])
    S, C = _powers(random, unknown_bits, n), _powers(random, contact_bits, m)
    v = np.exp2(random.integers(-10, 11))
    a = np.exp2(random.integers(-12, -4))
    extreme = random.random()
    if extreme < 0.05:  # K ~ 1e-290: products underflow
        v, C = np.exp2(random.integers(900, 970)), np.ones(m)
    elif extreme < 0.1:
        a = np.exp2(random.choice([-300, -100, 100, 300]))
    slices = np.split(np.arange(n), np.cumsum([len(K) for K in blocks])[:-1])
    scaled = tuple(
        np.asfortranarray(S[rows, None] * K * S[rows] / v) for rows, K in zip(slices, blocks, strict=True)
    )
    contacts = sp.csc_array(S[:, None] * A * C)
    names = tuple(f"part {k + 1}" for k in range(len(blocks)))
    made = tuple(
        ExactLoad(LoadCase(a * S * f / v, a * C * g), a * x / S, a * lam / (C * v)) for x, lam, f, g in loads
    )
    units = f"C 2^±{contact_bits}, S 2^±{unknown_bits}, v {v:.0e}, a {a:.0e}"
    assembly = Assembly(Stiffness.of(*scaled), contacts, None, names)
    return ExactProblem(f"{kind}; {units}", assembly, made, v < 2.0**800)
