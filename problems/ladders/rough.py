"""Elastic bodies on rough obstacles: sparse problems drawn at random, as those of sparse.py.

membrane   −Δu = q on a rectangle, u = 0 on its edge, u ≥ ψ at every node: the five-point stencil
plate      ΔΔu = q, simply supported, u ≥ ψ at every node: the square of that stencil

R. Glowinski, Numerical Methods for Nonlinear Variational Problems (1984).

block      a block of cubes, held below, whose upper face is pressed against a rough rigid surface

N. Kikuchi and J. T. Oden, Contact Problems in Elasticity (1988). The harder the problem, the finer the relief
of its obstacle. Loads and approaches are drawn, so that few contacts close, or almost all.

Trilinear elements on a product grid have a stiffness of products of ∫φφ, ∫φ'φ and ∫φ'φ' of one direction:

    K_ab = λ G_ab + μ G_ba + δ_ab μ Σ_c G_cc,   (G_ab)_ij = ∫ ∂_a φ_i ∂_b φ_j,   λ = 1.5 μ for ν = 0.3.
"""

from functools import partial, reduce

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.model.scene import ManufacturedProblem

from . import Ladder, Scene
from .outside import second_difference
from .sparse import drawn, problem, sides, sparse_scene

WAVES = 64  # of a relief
POINTS_PER_WAVE = 4  # of the finest


def relief(random: np.random.Generator, a: int, b: int, difficulty: float) -> Vector:
    """(a·b,) heights from −1 to 1 on a grid of a × b points: waves of equal slopes in all directions."""
    number = (max(a, b) / POINTS_PER_WAVE) ** (difficulty * random.random(WAVES))
    angle, phase = 2 * np.pi * random.random((2, WAVES))
    x, y = np.indices((a, b)).reshape(2, -1, 1) / max(a, b)
    along = 2 * np.pi * number * (x * np.cos(angle) + y * np.sin(angle))
    height: Vector = (np.cos(along + phase) / number).sum(axis=1)
    return height / abs(height).max()


def _covered(title: str, order: int, n: int, difficulty: float, seed: int) -> Scene:
    """A membrane, order 1, or a plate, order 2."""
    a, b = sides(n, seed)

    def make() -> ManufacturedProblem:
        random = np.random.default_rng(seed)
        membrane = sp.kron(second_difference(a), sp.eye_array(b))
        membrane = sp.csc_array(membrane + sp.kron(sp.eye_array(a), second_difference(b)))
        depth = np.exp2(random.uniform(0, 5))  # mm, of a strip of the shorter side without an obstacle
        load = depth * {1: 8, 2: 384 / 5}[order] / min(a, b) ** (2 * order)
        obstacle = 0.3 * relief(random, a, b, difficulty) - 0.5
        K = membrane if order == 1 else membrane @ membrane
        return problem(K, -sp.eye_array(a * b), np.full(a * b, -load), -obstacle)

    return sparse_scene(f"{title} of {a} × {b} nodes on an obstacle", difficulty, a * b, a * b, make)


def brick_stiffness(*nodes: int) -> sp.csc_array:
    """K of unit cubes with μ = 1: by direction of the displacement, then by node, line by line."""
    lines = [sp.diags_array([1.0, 1.0], offsets=[0, 1], shape=(k - 1, k)) / 2 for k in nodes]  # at the middle
    slopes = [sp.diags_array([-1.0, 1.0], offsets=[0, 1], shape=(k - 1, k)) for k in nodes]
    of_line = [
        {(0, 0): mean.T @ mean + slope.T @ slope / 12, (1, 0): slope.T @ mean, (1, 1): slope.T @ slope}
        for mean, slope in zip(lines, slopes, strict=True)
    ]
    for matrices in of_line:
        matrices[0, 1] = matrices[1, 0].T

    def product(a: int, b: int) -> sp.csc_array:
        return reduce(sp.kron, (matrices[a == d, b == d] for d, matrices in enumerate(of_line)))

    axes = range(len(nodes))
    shear = sum(product(c, c) for c in axes)
    blocks = [[1.5 * product(a, b) + product(b, a) + (a == b) * shear for b in axes] for a in axes]
    return sp.csc_array(sp.block_array(blocks))


def block(n: int, difficulty: float, seed: int) -> Scene:
    thickness = 2 + seed % 5
    a, b = sides(n // (3 * thickness), seed)
    n = 3 * a * b * thickness

    def make() -> ManufacturedProblem:
        random = np.random.default_rng(seed)
        free = np.flatnonzero(np.arange(3 * a * b * (thickness + 1)) % (thickness + 1))
        K = brick_stiffness(a, b, thickness + 1)[free][:, free]
        above = np.arange(a * b)
        top = 2 * a * b * thickness + thickness * (above + 1) - 1
        A = sp.csc_array((np.ones(a * b), (top, above)), shape=(n, a * b))
        gap = 0.05 * relief(random, a, b, difficulty) + 0.05 - random.uniform(0.03, 0.13)
        return problem(K, A, np.zeros(n), gap)

    return sparse_scene(f"A block of {a} × {b} × {thickness} nodes", difficulty, n, a * b, make)


SPARSE: dict[str, Ladder] = {
    "membrane": drawn("membrane", partial(_covered, "A membrane", 1), 500, 4000, 25000),
    "plate": drawn("plate", partial(_covered, "A plate", 2), 500, 4000, 25000),
    "block": drawn("block", block, 500, 4000, 25000),
}
