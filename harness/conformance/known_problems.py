"""Small contact problems whose answers are known without a solver.

Choose x, λ ≥ 0 and gaps y ≥ 0 with λᵢyᵢ = 0, put f = Kx + Aλ and g = Aᵀx + y: the optimality conditions
then hold by construction, and the answer is unique because K is positive definite.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms import Form
from problems.forms.assembly import Assembly, DualLoadCase, LoadCase, Matrix, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import read_only
from problems.stiffness.operator import Stiffness

DOMINANT = 2e5  # N/mm, added to the diagonal of a banded K, which makes it positive definite

Random = np.random.Generator

#: The cases of a problem: the probability that a contact is closed.
CLOSED = {"some contacts closed": 0.4, "others closed": 0.6, "all open": 0.0, "all closed": 1.0}


@dataclass(frozen=True)
class KnownCase:
    """A load case with its answer: x (n,) in mm, lam (m,) in N."""

    name: str
    load: DualLoadCase
    x: Vector
    lam: Vector


@dataclass(frozen=True)
class KnownProblem:
    """Matrices, and load cases with their answers."""

    name: str
    prepared: Prepared
    cases: tuple[KnownCase, ...]


def contact_rows(pairs: int, tools: int) -> sp.csc_array:
    """A of two parts that face each other at `pairs` nodes, the first one also at `tools` rigid supports."""
    first = sp.eye_array(pairs + tools)
    second = -sp.eye_array(pairs, pairs + tools)
    return sp.csc_array(sp.vstack([first, second]))


def stiffness(random: Random, size: int) -> Matrix:
    """Symmetric positive definite, N/mm, condition number 1e3."""
    basis = np.linalg.qr(random.standard_normal((size, size)))[0]
    K = (basis * np.logspace(2, 5, size)) @ basis.T
    return (K + K.T) / 2


def known_case(random: Random, prepared: Prepared, closed: float, name: str) -> KnownCase:
    """A load case in which each contact is closed with the probability `closed`."""
    n, m = prepared.assembly.n, prepared.assembly.m
    A = prepared.assembly.A
    shut = random.random(m) < closed
    lam = np.where(shut, random.uniform(1, 100, m), 0.0)
    opening = np.where(shut, 0.0, random.uniform(0.05, 1, m))
    x = random.normal(0, 0.3, n)
    f = prepared.assembly.K.multiply(x) + A @ lam
    g = A.T @ x + opening
    (load,) = prepared.with_p([LoadCase(f, g)])
    return KnownCase(name, read_only(load), x, lam)


def known_problems(form: Form = "dual") -> list[KnownProblem]:
    """One contact; two parts and a rigid tool."""
    random = np.random.default_rng(0)
    made = []
    for name, pairs, tools in (("one contact", 1, 0), ("two parts and a tool", 30, 10)):
        blocks = [stiffness(random, pairs + tools), stiffness(random, pairs)]
        if form == "sparse":
            near = (np.triu(np.tril(K, 3), -3) + DOMINANT * np.eye(len(K)) for K in blocks)
            blocks = [sp.csc_array(K) for K in near]
        prepared = Prepared(Assembly(Stiffness.of(*blocks), contact_rows(pairs, tools)))
        cases = tuple(known_case(random, prepared, closed, title) for title, closed in CLOSED.items())
        made.append(KnownProblem(name, prepared, cases))
    return made
