"""What must come of an answer when the problem is changed in a known way: no reference is needed.

Two answers, each within its bound of the truth, are at most the sum of the bounds apart.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from long import ASKED
from small import make_load, make_prepared
from solving import CASES, IN_HOUSE, allowed, eigenvalues, solve

from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.scene import read_scene
from problems.stiffness.operator import Stiffness
from solvers.base import Form
from solvers.sparse_dual import ROUNDING_MM


@dataclass(frozen=True)
class Changed:
    """A problem, and how its x and λ give those of the problem that it was made from."""

    prepared: Prepared
    case: LoadCase
    x: Callable[[Vector], Vector] = lambda x: x
    lam: Callable[[Vector], Vector] = lambda lam: lam
    length: float = 1.0  # mm that 1 stands for in its x


def permuted(prepared: Prepared, case: LoadCase) -> Changed:
    """The nodes of each part and the contacts in another order."""
    random, assembly = np.random.default_rng(1), prepared.assembly
    orders = [random.permutation(len(K)) for K in assembly.K.matrices]
    blocks = tuple(K[np.ix_(order, order)] for K, order in zip(assembly.K.matrices, orders, strict=True))
    rows = np.concatenate([s.start + order for s, order in zip(assembly.K.slices, orders, strict=True)])
    columns = random.permutation(assembly.m)
    made = Prepared(
        Assembly(Stiffness.of(*blocks), sp.csc_array(assembly.A.toarray()[np.ix_(rows, columns)]))
    )
    x_back, lam_back = np.argsort(rows), np.argsort(columns)
    load = LoadCase(case.f[rows], case.g[columns])
    return Changed(made, load, lambda x: x[x_back], lambda lam: lam[lam_back])


def in_other_units(prepared: Prepared, case: LoadCase) -> Changed:
    """Lengths in units of 4 mm, forces in units of 1/2 N."""
    length, force = 4.0, 0.5
    blocks = tuple(K * length / force for K in prepared.assembly.K.matrices)
    load = LoadCase(case.f / force, case.g / length)
    made = Prepared(Assembly(Stiffness.of(*blocks), prepared.assembly.A))
    return Changed(made, load, lambda x: x * length, lambda lam: lam * force, length)


def with_a_redundant_contact(prepared: Prepared, case: LoadCase) -> Changed:
    """A rigid stop at 100 mm, which no node reaches."""
    assembly = prepared.assembly
    normal = np.zeros((assembly.n, 1))
    normal[-1] = 1.0
    made = Prepared(Assembly(assembly.K, sp.csc_array(sp.hstack([assembly.A, normal]))))
    return Changed(made, LoadCase(case.f, np.append(case.g, 100.0)), lam=lambda lam: lam[:-1])


def with_the_parts_swapped(prepared: Prepared, case: LoadCase) -> Changed:
    """The second part first, and all displacements counted the other way."""
    assembly, size = prepared.assembly, len(prepared.assembly.K.matrices[0])
    order = np.roll(np.arange(assembly.n), -size)
    made = Prepared(
        Assembly(Stiffness.of(*assembly.K.matrices[::-1]), sp.csc_array(-assembly.A.toarray()[order]))
    )
    return Changed(made, LoadCase(-case.f[order], case.g), lambda x: -np.roll(x, size))


def shifted(prepared: Prepared, case: LoadCase) -> Changed:
    """Everything a quarter of a millimetre further: the supports' springs take up the force of it."""
    shift = np.full(prepared.assembly.n, 0.25)
    f = case.f + prepared.assembly.K.multiply(shift)
    return Changed(prepared, LoadCase(f, case.g + prepared.assembly.A.T @ shift), lambda x: x - shift)


def doubled(prepared: Prepared, case: LoadCase) -> Changed:
    """K and f twice as large: the same displacements under twice the forces."""
    made = Prepared(
        Assembly(Stiffness.of(*(2 * K for K in prepared.assembly.K.matrices)), prepared.assembly.A)
    )
    return Changed(made, LoadCase(2 * case.f, case.g), lam=lambda lam: lam / 2)


CHANGES = [permuted, in_other_units, with_a_redundant_contact, with_the_parts_swapped, shifted, doubled]


@cache
def problem(kind: str) -> tuple[Prepared, LoadCase]:
    """A plain one, cond(K) = 1e3, or that of a ladder's rung."""
    if kind == "plain":
        prepared = make_prepared(21, pairs=12, tools=4)
        return prepared, make_load(22, prepared)[0]
    made = read_scene(kind).made
    return Prepared(Assembly(made.assembly.K, made.assembly.A)), made.load


TRIED = [("plain", *case) for case in CASES if case[0] != "l-bfgs-b"]
TRIED += [(f"hard/{rung}", *case) for rung in ("conditioning/1e+10", "degeneracy/025") for case in IN_HOUSE]


def solved(name: str, form: Form, prepared: Prepared, case: LoadCase) -> tuple[Vector, Vector, float]:
    """x, λ and the bound on x; where that is large, rounding may keep the method from "solved"."""
    answer, x = solve(name, form, prepared, case)
    bound = allowed(name, prepared, case, x, answer.lam)
    assert answer.status == "solved" or (answer.status == "inaccurate" and bound > ROUNDING_MM)
    return x, answer.lam, bound


#: Two changes of the six for each method on each problem, others for the next; all with RIVETBENCH_LONG.
CHANGED = [
    (change, *tried)
    for i, tried in enumerate(TRIED)
    for j, change in enumerate(CHANGES)
    if ASKED or (i + j) % 3 == 0
]


@pytest.mark.parametrize(
    ("change", "kind", "name", "form"), CHANGED, ids=lambda value: getattr(value, "__name__", str(value))
)
def test_the_answer_changes_as_the_problem_does(
    change: Callable[[Prepared, LoadCase], Changed], kind: str, name: str, form: Form
) -> None:
    x, lam, bound = solved(name, form, *problem(kind))
    assert 3 < np.count_nonzero(lam > 1e-6) < len(lam) - 3  # a problem with a real choice
    made = change(*problem(kind))
    other_x, other_lam, other_bound = solved(name, form, made.prepared, made.case)
    bound += made.length * other_bound
    assert abs(made.x(other_x) - x).max() <= bound
    # From A(λ' − λ) = K(x − x') up to the residual, where each row of A has one entry, ±1.
    force = eigenvalues(problem(kind)[0])[1] * bound * np.sqrt(len(x))
    assert abs(made.lam(other_lam) - lam).max() <= force


@pytest.mark.parametrize(
    ("kind", "name", "form"), TRIED, ids=lambda value: getattr(value, "__name__", str(value))
)
def test_a_load_in_two_steps_leads_to_the_same_place(kind: str, name: str, form: Form) -> None:
    """The second step starts from the first one's displacements, under the forces that they call up."""
    prepared, case = problem(kind)
    x, _, bound = solved(name, form, prepared, case)
    first, _, _ = solved(name, form, prepared, LoadCase(case.f / 2, case.g))
    left = LoadCase(case.f - prepared.assembly.K.multiply(first), case.g - prepared.assembly.A.T @ first)
    second, _, second_bound = solved(name, form, prepared, left)
    assert abs(first - x).max() > 0.01
    # What the first step is off by stands in the second one's load, and is made good by it.
    assert abs(first + second - x).max() <= bound + second_bound
