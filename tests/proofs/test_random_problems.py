"""Every solver on random small problems whose answer is known in rational numbers.

All but ours are tried on every fifth. RIVETBENCH_LONG=1 takes thousands of them, and tries all on each.
"""

import numpy as np
from exact_answer import exact_optimum
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sample_size import ASKED as LONG
from solver_forms import CASES, IN_HOUSE, allowed, solve

from harness.conformance.known_problems import contact_rows, stiffness
from harness.verification.reference import best_of_candidates
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness


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


@example(seed=504, pairs=0, tools=1)
@settings(max_examples=7000 if LONG else 20, deadline=None, database=None, derandomize=not LONG)
@given(seed=st.integers(0, 2**32 - 1), pairs=st.integers(0, 5), tools=st.integers(0, 3))
def test_every_solver_finds_the_rational_answer(seed: int, pairs: int, tools: int) -> None:
    prepared, case = problem(seed, pairs, tools if pairs else tools + 1)
    exact, active, forces = exact_optimum(prepared.assembly, case, best_of_candidates(prepared, case).active)
    x = np.array(exact, dtype=float)
    lam = np.zeros(prepared.assembly.m)
    lam[active] = forces
    for name, form in CASES if LONG or seed % 5 == 0 else IN_HOUSE:
        answer, found = solve(name, form, prepared, case)
        assert answer.status == "solved" or (name, form) not in IN_HOUSE
        if answer.status == "solved":
            assert abs(found - x).max() <= allowed(name, prepared, case, x, lam), (name, form)
