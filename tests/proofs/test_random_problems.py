"""Every solver on random small problems whose answer is exact: rational, chosen, or proven.

RIVETBENCH_LONG=1 takes thousands of them instead of a few hundred.
"""

from itertools import product

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from long import ASKED as LONG
from solving import CASES, IN_HOUSE, allowed, solve
from test_reference import exact_solution

from harness.conformance.known_problems import contact_rows, stiffness
from harness.verification.judge import conditioned_limit
from harness.verification.reference import best_of_candidates
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.ladders.exact import rescaled
from problems.manufactured.exact import manufacture, spectrum
from problems.stiffness.operator import Stiffness

SEEDS = st.integers(0, 2**32 - 1)


def examples(few: int, many: int) -> settings:
    return settings(max_examples=many if LONG else few, deadline=None, database=None, derandomize=not LONG)


def rounded(values: Vector, steps: int) -> Vector:
    """To whole multiples of 1/steps, so that rational numbers stay short."""
    return np.round(values * steps) / steps


def problem(seed: int, pairs: int, tools: int) -> tuple[Prepared, LoadCase]:
    """Two parts, or one on rigid stops, with random loads; every second problem has contacts that close
    without a force."""
    random = np.random.default_rng(seed)
    sizes = [pairs + tools, *([pairs] if pairs else [])]
    blocks = tuple(rounded(stiffness(random, size), 64) for size in sizes)
    prepared = Prepared(Assembly(Stiffness.of(*blocks), contact_rows(pairs, tools)[: sum(sizes)]))
    n, m = prepared.assembly.n, prepared.assembly.m
    if seed % 2:
        f, g = random.normal(0, 500, n), random.uniform(0, 0.5, m)
        return prepared, LoadCase(rounded(f, 16), rounded(g, 256))
    x = rounded(random.normal(0, 0.3, n), 256)
    lam = rounded(random.uniform(0, 100, m) * (random.random(m) < 0.5), 16)
    y = np.where(lam > 0, 0.0, rounded(random.uniform(0, 0.5, m) * (random.random(m) < 0.6), 256))
    A = prepared.assembly.A
    return prepared, LoadCase(prepared.assembly.K.multiply(x) + A @ lam, A.T @ x + y)


def exact(prepared: Prepared, case: LoadCase) -> tuple[Vector, Vector]:
    """x and λ from rational arithmetic: of the contact set at hand, or of the first that is optimal."""
    m = prepared.assembly.m
    guess = best_of_candidates(prepared, case).active
    for active in (guess, *(np.array(choice) for choice in product((False, True), repeat=m))):
        x, forces, gaps = exact_solution(prepared, case, active)
        if min([*forces, *gaps], default=0) >= 0:
            lam = np.zeros(m)
            lam[active] = [float(force) for force in forces]
            return np.array([float(value) for value in x]), lam
    raise AssertionError("a strictly convex problem has an answer")


@example(seed=504, pairs=0, tools=1)
@examples(80, 7000)
@given(seed=SEEDS, pairs=st.integers(0, 5), tools=st.integers(0, 3))
def test_every_solver_finds_the_rational_answer(seed: int, pairs: int, tools: int) -> None:
    prepared, case = problem(seed, pairs, tools if pairs else tools + 1)
    x, lam = exact(prepared, case)
    check(prepared, case, x, lam)


@examples(10, 1000)
@given(seed=SEEDS, pairs=st.integers(9, 30), tools=st.integers(0, 10))
def test_every_solver_finds_the_proven_answer(seed: int, pairs: int, tools: int) -> None:
    prepared, case = problem(seed, pairs, tools)
    found = best_of_candidates(prepared, case)
    assert found.bound_mm < 1e-12
    check(prepared, case, found.x, found.lam)


def check(prepared: Prepared, case: LoadCase, x: Vector, lam: Vector) -> None:
    for name, form in CASES:
        answer, found = solve(name, form, prepared, case)
        assert answer.status == "solved" or (name, form) not in IN_HOUSE
        if answer.status == "solved":
            assert abs(found - x).max() <= allowed(name, prepared, case, x, lam), (name, form)


# A gap written in a sixteenth of a mm: what ipm leaves of it has to be measured as a displacement.
@example(seed=1655, bits=4, exponents=(0.0, 0.0), closed=0.5, weak=0.125, contact_bits=4, force_bits=4)
@examples(150, 4000)
@given(
    seed=SEEDS,
    bits=st.integers(0, 5),
    exponents=st.tuples(st.floats(0, 12), st.floats(0, 12)),
    closed=st.floats(0, 1),
    weak=st.floats(0, 1),
    contact_bits=st.integers(0, 6),
    force_bits=st.integers(-10, 10),
)
def test_in_house_solvers_hold_or_say_so(
    seed: int,
    bits: int,
    exponents: tuple[float, float],
    closed: float,
    weak: float,
    contact_bits: int,
    force_bits: int,
) -> None:
    """cond(K) up to 1e12, contacts without a force, contacts and forces in any unit."""
    d = [spectrum(2**bits, 10.0**exponent) for exponent in exponents]
    made = manufacture(*d, seed=seed, closed=closed, weak=weak * (1 - closed))
    C = np.exp2(np.random.default_rng(seed).integers(-contact_bits, contact_bits + 1, 2**bits))
    made = rescaled(made, 1.0, C, 2.0**force_bits)
    prepared = Prepared(Assembly(made.assembly.K, made.assembly.A))
    condition = max(part.max() for part in d)
    limit = conditioned_limit(1e-7, condition, abs(made.x).max())
    for name, form in IN_HOUSE:
        answer, x = solve(name, form, prepared, made.load)
        if answer.status == "solved":
            assert abs(x - made.x).max() <= limit, (name, form)
        else:
            assert answer.details["cause"], (name, form)
            assert x is None or np.isfinite(x).all()
