"""Special problems: unusual loads, gaps and assemblies, and contact sets by the thousand.

loads      unusual loads and gaps on two ordinary parts, cond(K) = 1e6
parts      stiff parts, stacks, a rigid tool, and the smallest possible problems
floating   parts held by contact alone: K is singular, and the model refuses it
pivoting   methods that exchange one contact at a time visit contact sets by the thousand

The rungs of `pivoting`:

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

from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.model.scene import ManufacturedProblem
from problems.stiffness.operator import Stiffness

from . import Ladder, Scene, matrices
from .manufactured import exact_assembly, manufacture, spectrum, two_parts
from .plates import CLAMPED, FREE, Tables, plates

SIZES = (8, 16, 32, 48, 64, 128, 256, 512)  # contacts of Fathi's problem; the first four of Murty's
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


N, CONDITION = 64, 1e6  # contacts, cond(K)
PERTURBATION = 2.0**-40  # about 1e-12

_parts = partial(two_parts, N, CONDITION)


def _random(title: str, gap: float, more: float = 0.0, force: float = 1000.0) -> Scene:
    """Random forces up to `force`, N, and gaps from `gap` to `more` beyond, mm; the solution is unknown."""
    random, d = np.random.default_rng(7), spectrum(N, CONDITION)
    assembly = exact_assembly(d, d)
    f = random.uniform(-force, force, assembly.n)
    load = LoadCase(f, gap + more * random.random(assembly.m))
    return matrices(title, ManufacturedProblem(assembly, load))


def _perturbed(title: str, lam: float, gap: float) -> Scene:
    """A third of the contacts are weakly active; a tiny force `lam`, N, or `gap`, mm, is added to each."""
    made = _parts(seed=9, closed=0.3, weak=0.3)
    assert made.x is not None
    assert made.lam is not None
    A, y = made.assembly.A, made.load.g - made.assembly.A.T @ made.x
    weak = (made.lam == 0) & (y == 0)
    load = LoadCase(made.load.f + A @ np.where(weak, lam, 0.0), made.load.g + np.where(weak, gap, 0.0))
    return matrices(title, replace(made, load=load, lam=made.lam + np.where(weak, lam, 0.0)))


def _stack(count: int) -> Tables:
    return {f"part {k + 1}": CLAMPED for k in range(count)}


def _singular() -> Scene:
    d = spectrum(16, 1e4)
    free = np.concatenate([[0.0], d[1:]])
    problem = ManufacturedProblem(exact_assembly(d, free), two_parts(16, 1e4, seed=13).load)
    return matrices("A part that can move without strain", problem, refused=INDEFINITE)


def _one_node() -> Scene:
    assembly = exact_assembly(np.ones(1), A=sp.csc_array([[1.0]]))
    problem = ManufacturedProblem(assembly, LoadCase(np.ones(1), np.zeros(1)))
    return matrices("One node against a rigid tool", problem)


def _one_contact() -> Scene:
    d, normal = spectrum(64, 1e6), np.zeros((128, 1))
    normal[[0, 64]] = [[1.0], [-1.0]]
    problem = manufacture(d, d, A=sp.csc_array(normal), seed=11, closed=1.0)
    return matrices("Two parts of 64 nodes, one contact", problem)


def _many_contacts() -> Scene:
    """Twelve contacts on eight unknowns: x is unique, the forces are not, and Q is singular."""
    random = np.random.default_rng(12)
    A = sp.csc_array(np.hstack([np.eye(8), random.choice([-1.0, 1.0], (8, 4))]))
    problem = ManufacturedProblem(exact_assembly(spectrum(8, 1e3), A=A), LoadCase(np.ones(8), np.zeros(12)))
    refused = "must not depend on the columns before it"
    return matrices("More contacts than unknowns", problem, refused=refused)


INDEFINITE = "K must be positive definite"
TOOL, ON_TOOL = ("part 1", "tool"), ("floating", "tool")
LOOSE = {"floating": FREE}
BETWEEN = (("part 1", "part 2"), ("part 2", "tool"))
STIFF = _stack(1) | {"part 2": CLAMPED | {"young": 70e6}}

_floating = partial(plates, refused=INDEFINITE)

RUNGS: dict[str, Ladder] = {
    "pivoting": {
        **{f"fathi-{m:03d}": partial(_triangular, "Fathi", np.ones(m)) for m in SIZES},
        **{f"murty-{m:02d}": partial(_triangular, "Murty", 2 - np.exp2(-np.arange(m))) for m in SIZES[:4]},
        **{f"chain-{m:02d}": partial(_chain, m) for m in (8, 16, 24, 32)},
        **{f"vertex-{n:03d}": partial(_vertex, n) for n in (16, 64, 256)},
    },
    "loads": {
        "random-gap": partial(_random, "Gaps of 0 to 0.5 mm", 0.0, 0.5),
        "no-contact": partial(_random, "Gaps of 1000 mm: no contact closes", 1000.0),
        "everywhere": lambda: matrices("Every contact closed", _parts(seed=8, closed=1.0)),
        "zero-gap": partial(_random, "No gap", 0.0),
        "gap-1e-09": partial(_random, "Gaps of 1e-9 mm", 1e-9),
        "overclosure": partial(_random, "Overlaps of 0 to 0.5 mm", 0.0, -0.5),
        "huge-force": partial(_random, "Forces of 1e9 N", 0.1, force=1e9),
        "tiny-force": partial(_random, "Forces of 1e-9 N, no gap", 0.0, force=1e-9),
        "no-load": partial(_random, "Gaps of 0.1 mm, no load", 0.1, force=0.0),
        "nothing": partial(_random, "No gap, no load", 0.0, force=0.0),
        "flip-open": partial(_perturbed, "A third of the contacts open by 1e-12 mm", 0.0, PERTURBATION),
        "flip-closed": partial(_perturbed, "A third of the contacts closed by 1e-12 N", PERTURBATION, 0.0),
    },
    "parts": {
        "one-node": _one_node,
        "two-nodes": lambda: matrices("Two parts of one node", two_parts(1, 1.0, seed=10, closed=1.0)),
        "one-contact": _one_contact,
        "tool": partial(plates, "A part against a rigid tool", _stack(1), contacts=(TOOL,)),
        "two-and-tool": partial(plates, "Two parts on a rigid tool", _stack(2), contacts=BETWEEN),
        "three": partial(plates, "A stack of 3 parts", _stack(3)),
        "five": partial(plates, "A stack of 5 parts", _stack(5)),
        "stiff": partial(plates, "A part a thousand times as stiff as the other", STIFF),
        "more-contacts-than-unknowns": _many_contacts,
    },
    "floating": {
        "on-a-part": partial(_floating, "A free plate against a clamped one", {"clamped": CLAMPED} | LOOSE),
        "on-a-tool": partial(_floating, "A free plate against a rigid tool", LOOSE, contacts=(ON_TOOL,)),
        "matrix": _singular,
    },
}
