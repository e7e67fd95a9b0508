"""Factors of Q_CC that follow the contact set, and `newton` where Q does not decay."""

from collections.abc import Iterator

import numpy as np
import pytest
import scipy.sparse as sp
from small_problems import by_nnls, definite, make_beam

from harness.solving.solver_session import answer_of
from harness.verification.reference import proof_of
from problems.forms import compliance
from problems.forms.assembly import Assembly, DualLoadCase, LoadCase
from problems.forms.closed_factor import ClosedFactor
from problems.forms.prepared import Prepared, dual_alone
from problems.forms.problem import in_form
from problems.forms.sprung_stiffness import SprungStiffness
from problems.ladders.rough import brick_stiffness
from problems.stiffness.operator import Stiffness
from solvers.algorithms.newton_sweeps import Sweeps
from solvers.base import WarmStart
from solvers.registry import make_solver

TOLERANCE = 1e-10
SIZE = 200


def changing_sets(random: np.random.Generator) -> Iterator[np.ndarray]:
    """From none closed to all, and sets of which few contacts change, some back again."""
    yield from (np.zeros(SIZE, dtype=bool), np.ones(SIZE, dtype=bool))
    C = random.random(SIZE) < 0.6
    for _ in range(12):
        yield C
        some = random.integers(0, SIZE, 5)
        yield C ^ np.isin(np.arange(SIZE), some)
        C = C ^ np.isin(np.arange(SIZE), random.integers(0, SIZE, 7))


def test_a_factor_follows_the_contact_set() -> None:
    """Against a solution of Q_CC alone; the border serves most of the sets."""
    Q, random = definite(SIZE, 0), np.random.default_rng(1)
    factor, factored = ClosedFactor(Q), 0
    for C in changing_sets(random):
        b, rows, base = random.standard_normal(SIZE), np.flatnonzero(C), factor.B
        u = factor.solve(C, b)
        factored += factor.B is not base
        assert not u[~C].any()
        np.testing.assert_allclose(
            u[rows], np.linalg.solve(Q[np.ix_(rows, rows)], b[rows]), rtol=1e-9, atol=1e-9
        )
    assert 3 <= factored <= 13


def test_a_border_of_one_contact_twice_is_refused_as_such_a_set_is() -> None:
    Q, C = np.eye(20), np.arange(20) < 18
    Q[18, 19] = Q[19, 18] = 1.0
    factor = ClosedFactor(Q)
    np.testing.assert_array_equal(factor.solve(C, np.ones(20)), C)
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        factor.solve(~C | C, np.ones(20))


def test_a_border_that_has_lost_its_digits_gives_way_to_a_new_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on contacts that almost depend on one another: only the first answer of a factor is right."""
    exact, random, used = ClosedFactor.solve, np.random.default_rng(7), list[ClosedFactor]()

    def solve(self: ClosedFactor, C: np.ndarray, b: np.ndarray) -> np.ndarray:
        u = exact(self, C, b)
        if not any(self is one for one in used):
            used.append(self)
            return u
        return u * random.uniform(0.1, 1.9, len(u))

    monkeypatch.setattr(ClosedFactor, "solve", solve)
    Q, p = definite(SIZE, 5, 1e3), 30 * random.standard_normal(SIZE)
    sweeps = Sweeps(dual_alone(Q))
    case = sweeps.solved(DualLoadCase(0 * p, -p, p), TOLERANCE)
    assert sweeps.answer(case, TOLERANCE).status == "solved"
    assert case.residual <= 1e-11


@pytest.mark.parametrize(
    ("size", "mean"),
    [*((40, mean) for mean in (-3.0, -1.0, 0.0, 1.0, 3.0)), *((300, mean) for mean in (-3.0, 0.0, 3.0))],
)
def test_where_q_does_not_decay_answers_are_exact_from_few_to_all_closed(size: int, mean: float) -> None:
    """Alone, from another case, and several together; y on the contacts that NNLS closes is zero."""
    Q, random = definite(size, 5, 1e3), np.random.default_rng(size)
    level = Q @ np.full(size, mean)
    sweeps = Sweeps(dual_alone(Q))
    assert sweeps.M is None
    loads = [DualLoadCase(0 * p, -p, p) for p in level + 30 * random.standard_normal((4, size))]
    first = sweeps.solved(loads[0], TOLERANCE)
    alone = [sweeps.answer(sweeps.solved(load, TOLERANCE), TOLERANCE) for load in loads]
    together = [sweeps.answer(case, TOLERANCE) for case in sweeps.together(loads, TOLERANCE)]
    warm = [
        sweeps.answer(case, TOLERANCE) for case in sweeps.together(loads, TOLERANCE, [first] * len(loads))
    ]
    for load, *answers in zip(loads, alone, together, warm, strict=True):
        wanted = by_nnls(Q, load.p)
        for answer in answers:
            assert answer.status == "solved"
            assert answer.details["closed"] == (wanted > 0).sum()
            np.testing.assert_allclose(answer.lam, wanted, atol=1e-9 * max(1.0, wanted.max()))


def test_an_answer_does_not_depend_on_those_before() -> None:
    """To the last bit: the factor of another load case is not taken over."""
    Q, random = definite(SIZE, 6, 1e3), np.random.default_rng(7)
    loads = [DualLoadCase(0 * p, -p, p) for p in 10 + 30 * random.standard_normal((3, SIZE))]
    sweeps = Sweeps(dual_alone(Q))
    for load in loads:
        sweeps.solved(load, TOLERANCE)
    again = sweeps.solved(loads[0], TOLERANCE).trial.lam
    np.testing.assert_array_equal(again, Sweeps(dual_alone(Q)).solved(loads[0], TOLERANCE).trial.lam)


def solid_blocks(side: int, thickness: int) -> Assembly:
    """Two blocks of side² × thickness nodes, held at their backs, that meet on one face; K in one piece."""
    layer, free = side**2, np.arange(3 * side**2 * (thickness + 1)).reshape(3, -1)[:, side**2 :].T.ravel()
    K = sp.block_diag([brick_stiffness(thickness + 1, side, side)[free][:, free]] * 2, format="csc")
    faces = 3 * np.arange((thickness - 1) * layer, thickness * layer) + np.array(
        [[0], [3 * thickness * layer]]
    )
    meeting = sp.csc_array(
        (np.ones(2 * layer), (faces.ravel(), np.tile(np.arange(layer), 2))), shape=(K.shape[0], layer)
    )
    return Assembly(Stiffness.of(K), meeting)


def test_solids_that_meet_on_a_face_are_solved_and_proven_with_q(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their K has a band, K with springs between them has none: it is never factored."""
    monkeypatch.delattr(SprungStiffness, "factor")
    assembly, random = solid_blocks(8, 4), np.random.default_rng(4)
    data = Prepared(assembly)
    load = LoadCase(assembly.A @ random.uniform(0, 1, assembly.m), random.uniform(-0.3, 1.5, assembly.m))
    answer = answer_of("newton", make_solver("newton", {}), data, "sparse", load, TOLERANCE)
    exact = by_nnls(data.Q, data.with_p([load])[0].p)
    assert answer.lam is not None
    assert 10 < np.count_nonzero(exact) < 54
    np.testing.assert_allclose(answer.lam, exact, atol=1e-9)
    assert proof_of(data).proven([load], [answer.lam], [answer.x], 1e-12)[0].bound_mm < 1e-12


@pytest.mark.parametrize("decays", [True, False], ids=["with M", "without"])
def test_the_products_that_are_told_are_those_made(decays: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of sweeps, sets, starts and checks, not of parts of Q; alone, from a solved case and together."""
    size, made, original = 600, [], compliance.product
    data = make_beam(size) if decays else dual_alone(definite(size, 5, 1e3))
    x, noise = np.linspace(0, 1, size), np.random.default_rng(5).standard_normal(size)
    p = 0.2 + np.cos(4 * np.pi * x) if decays else 30 * noise
    solver = make_solver("newton", {})
    state = solver.prepare(in_form(data, "dual"))
    assert (state.sweeps.M is not None) is decays

    def counted(Q: np.ndarray, lam: np.ndarray) -> np.ndarray:
        if len(Q) == size:
            made.append(1 if lam.ndim == 1 else lam.shape[1])
        return original(Q, lam)

    monkeypatch.setattr(compliance, "product", counted)
    loads = [DualLoadCase(0 * q, -q, q) for q in (p, np.roll(p, 80), np.roll(p, 160))]
    answer = solver.solve(state, loads[0], TOLERANCE)
    assert answer.details["products"] == sum(made) >= answer.iterations
    made.clear()
    start = WarmStart(loads[0], answer.lam, original(data.Q, answer.lam) - p)
    warm = solver.solve(solver.update(state, state, loads[1], TOLERANCE, start), loads[1], TOLERANCE)
    assert warm.details["products"] == sum(made) >= warm.iterations
    made.clear()
    together = solver.batched(state)(loads, TOLERANCE)
    assert sum(one.details["products"] for one in together) == sum(made)
