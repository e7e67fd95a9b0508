"""Small contact problems with an independent answer: non-negative least squares by Lawson and Hanson.

min ½λᵀQλ − pᵀλ, λ ≥ 0 is min ‖Uλ − U⁻ᵀp‖, λ ≥ 0 with Q = UᵀU.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.optimize
import scipy.sparse as sp

from harness.conformance.known_problems import contact_rows, stiffness
from problems.forms import Form
from problems.forms.assembly import Assembly, DualLoadCase, LoadCase, Matrix, Vector
from problems.forms.prepared import Prepared, dual_alone
from problems.forms.problem import Problem, in_form
from problems.stiffness.operator import Stiffness


def make_prepared(seed: int, pairs: int, tools: int = 0) -> Prepared:
    """Two parts in contact at `pairs` nodes, the first one also with `tools` rigid supports."""
    random = np.random.default_rng(seed)
    blocks = (stiffness(random, pairs + tools), stiffness(random, pairs))
    return Prepared(Assembly(Stiffness.of(*blocks), contact_rows(pairs, tools)))


def problem_in(prepared: Prepared, form: Form) -> Problem:
    """The problem in a form, K with the blocks of that form."""
    if form == "sparse":
        assembly = prepared.assembly
        prepared = Prepared(replace(assembly, K=assembly.K.as_sparse(assembly.nodes)))
    return in_form(prepared, form)


@cache
def make_strips(elements: int) -> Prepared:
    """Two strings under tension on elastic beds (N/mm), a contact at each node: condition number ≈ 1e3."""
    main, side = np.full(elements, 2e3 + 2.0), np.full(elements - 1, -1e3)
    K = np.diag(main) + np.diag(side, 1) + np.diag(side, -1)
    return Prepared(Assembly(Stiffness.of(K, 0.5 * K), contact_rows(elements, 0)))


@cache
def make_beam(size: int) -> Prepared:
    """A beam on a soft bed with a contact at each unknown: Q decays along it, and edges of contact creep."""
    D = np.diff(np.eye(size), 2, axis=0)
    Q = np.linalg.inv(1e4 * D.T @ D + 1e-2 * np.eye(size))
    return dual_alone(np.asfortranarray((Q + Q.T) / 2))


def make_load(seed: int, prepared: Prepared, force: float = 500.0) -> tuple[LoadCase, DualLoadCase]:
    """Random forces (N) and gaps (mm)."""
    random = np.random.default_rng(seed)
    f = random.normal(0, force, prepared.assembly.n)
    g = random.uniform(0.01, 0.5, prepared.assembly.m)
    case = LoadCase(f, g)
    return case, prepared.with_p([case])[0]


def own_arrays(seed: int = 3, pairs: int = 6) -> tuple[Prepared, LoadCase, tuple[Any, ...]]:
    """Two parts and two rigid supports, a load case, and both as the arguments of `own_matrices`."""
    data = make_prepared(seed, pairs, tools=2)
    load = make_load(seed, data)[1]
    return data, load, (sp.block_diag(data.assembly.K.matrices), data.assembly.A, load.f, load.g)


def solve_by_nnls(prepared: Prepared, case: LoadCase) -> tuple[Vector, Vector]:
    """x and λ, polished once on the active set that NNLS found."""
    p = prepared.overlap(case)
    lam = by_nnls(prepared.Q, p)
    closed = lam > 0
    lam[closed] = np.linalg.solve(prepared.Q[np.ix_(closed, closed)], p[closed])
    # Not Prepared.recover, so that the expectation has nothing in common with it.
    K = sla.block_diag(*prepared.assembly.K.matrices)
    return np.linalg.solve(K, case.f - sp.csr_array(prepared.assembly.A) @ lam), lam


def definite(size: int, seed: int, condition: float = 1e4) -> Matrix:
    """Q of any contacts: each acts on all others alike, whatever their distance."""
    W, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((size, size)))
    Q = (W * np.geomspace(1.0, condition, size)) @ W.T
    return np.asfortranarray((Q + Q.T) / 2)


def by_nnls(Q: Matrix, p: Vector) -> Vector:
    """λ ≥ 0 with y = Qλ − p ≥ 0 and λᵀy = 0."""
    U = sla.cholesky(Q)
    return scipy.optimize.nnls(U, sla.solve_triangular(U, p, trans="T"), maxiter=10_000)[0]
