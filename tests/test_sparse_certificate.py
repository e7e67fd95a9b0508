"""The certificate of a sparse K: exact answers, any units of the unknowns, and the dense reference."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp
from lambda_min import proven_in_units
from sparse_matrices import band_matrix, chain, graph_matrix

from harness.verification import augmented
from harness.verification.certificate import certify
from harness.verification.exact_residual import DoubleDouble
from harness.verification.reference import refined_active_set
from harness.verification.refinement import units_of
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector
from problems.forms.prepared import Prepared
from problems.scene import read_scene, scene_names
from problems.stiffness.operator import Stiffness

GALLERY = [name for name in scene_names() if name.startswith("gallery/")]


def exact_problem(seed: int, n: int = 60, m: int = 14) -> tuple[Assembly, LoadCase, Vector, Vector]:
    """K, A, x, λ of integers, so that f = Kx + Aλ and g = Aᵀx + y are exact; contacts on the even unknowns.

    K is a chain with stiff and soft links, held softly: cond(K) is about 1e7. A third of the contacts are
    closed, a third are closed without a force.
    """
    random = np.random.default_rng(seed)
    link = np.exp2(random.integers(0, 16, n - 1))
    K = sp.diags_array([np.append(link, 0) + np.append(0, link) + 1.0, -link, -link], offsets=[0, 1, -1])
    A = np.zeros((n, m))
    A[2 * np.arange(m), np.arange(m)] = random.choice([-1.0, 1.0], m)
    x = random.integers(-(2**16), 2**16, n).astype(float)
    kind = np.arange(m) % 3
    lam = np.where(kind == 0, random.integers(1, 2**16, m), 0).astype(float)
    y = np.where(kind == 2, random.integers(1, 2**10, m), 0).astype(float)
    junction = 2 * np.arange(n // 2)
    assembly = Assembly(Stiffness.of(sp.csc_array(K)), sp.csc_array(A), junction=junction)
    return assembly, LoadCase(K @ x + A @ lam, A.T @ x + y), x, lam


def in_units(assembly: Assembly, load: LoadCase, s: Vector) -> tuple[Assembly, LoadCase]:
    """The same problem with x_i/s_i for x_i."""
    S = sp.diags_array(s)
    blocks = tuple(sp.csc_array(S @ K @ S) for K in assembly.K.matrices)
    changed = Assembly(Stiffness.of(*blocks), sp.csc_array(S @ assembly.A), junction=assembly.junction)
    return changed, LoadCase(s * load.f, load.g)


@pytest.mark.parametrize("seed", range(8))
def test_the_reference_is_within_its_bound_of_the_exact_answer(seed: int) -> None:
    assembly, load, x, lam = exact_problem(seed)
    found = refined_active_set(Prepared(assembly), load)
    assert abs(assembly.at_junction(found.x - x)).max() <= found.bound_mm <= 1e-12 * abs(x).max()
    assert (found.active[lam > 0]).all()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("size", [2.0**-30, 2.0**-12, 4.0])
def test_any_answer_is_within_the_bound(seed: int, size: float) -> None:
    """x moved anywhere, λ ≥ 0 changed anywhere, any set taken for closed; all on a grid, so exactly known."""
    assembly, load, x, lam = exact_problem(seed)
    random, D = np.random.default_rng(seed + 50), units_of(Prepared(assembly))
    kappa = proven_in_units(assembly.K, np.asarray(D))
    wrong_x = x + size * random.integers(-8, 9, len(x))
    wrong_lam = np.maximum(lam + size * random.integers(-8, 9, len(lam)), 0)
    for active in (lam > 0, random.random(len(lam)) < 0.5, np.zeros(len(lam), dtype=bool)):
        zero_x, zero_lam = np.zeros_like(x), np.zeros_like(lam)
        found = certify(
            assembly, load, DoubleDouble(wrong_x, zero_x), DoubleDouble(wrong_lam, zero_lam), active, kappa, D
        )
        assert abs(assembly.at_junction(found.x.hi - x)).max() <= found.bound_mm < np.inf
        assert not (found.closed & (lam == 0)).any()
        assert not (found.open & (load.g == assembly.A.T @ x)).any()


@pytest.mark.parametrize("seed", range(8))
def test_the_bound_does_not_depend_on_the_units_of_inner_unknowns(seed: int) -> None:
    """To the last bit: powers of two change no digit of K, its factor, the residuals and the bound."""
    assembly, load, *_ = exact_problem(seed)
    assert assembly.junction is not None
    s = np.exp2(np.random.default_rng(seed).integers(-30, 31, assembly.n))
    s[assembly.junction] = 1.0
    other, other_load = in_units(assembly, load, s)
    given, changed = Prepared(assembly), Prepared(other)
    D = other.K.units
    np.testing.assert_array_equal(D * s, assembly.K.units)
    assert proven_in_units(other.K, D) == proven_in_units(assembly.K, D * s) > 0
    one, two = refined_active_set(given, load), refined_active_set(changed, other_load)
    assert one.bound_mm == two.bound_mm > 0
    np.testing.assert_array_equal(one.x, two.x * s)
    np.testing.assert_array_equal(one.lam, two.lam)


def is_semidefinite(K: Matrix, D: Vector, kappa: float) -> bool:
    """Whether no eigenvalue of DKD − κI is negative, in rational arithmetic."""
    S = [
        [Fraction(k) * Fraction(a) * Fraction(b) for k, a in zip(row, D, strict=True)]
        for row, b in zip(K, D, strict=True)
    ]
    for i in range(len(S)):
        S[i][i] -= Fraction(kappa)
    for k in range(len(S)):
        if S[k][k] < 0 or (S[k][k] == 0 and any(S[k][k + 1 :])):
            return False
        if S[k][k]:
            for i in range(k + 1, len(S)):
                share = S[i][k] / S[k][k]
                for j in range(k + 1, len(S)):
                    S[i][j] -= share * S[k][j]
    return True


@pytest.mark.parametrize("seed", range(20))
def test_lambda_min_is_proven_for_matrices_that_are_nearly_singular(seed: int) -> None:
    """λmin from 1e-2 down to what rounding leaves, and below zero: κ is never above it."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 11))
    K = band_matrix(random, n, int(random.integers(0, 4)))
    D = Stiffness.of(K).units
    least = float(np.linalg.eigvalsh(D[:, None] * K.toarray() * D)[0])
    proven = []
    for left in (1e-2, 1e-5, 1e-8, 1e-12, 1e-15, 1e-16, 0.0, -1e-16):
        near = sp.csc_array(K - sp.diags_array((least - left) / D**2))
        held = Stiffness.of(near)
        units = held.units
        kappa = proven_in_units(held, units)
        if kappa > 0:
            assert is_semidefinite(near.toarray(), units, kappa)
            assert not is_semidefinite(near.toarray(), units, 16 * kappa)
        proven.append(kappa > 0)
    assert proven[:4] == [True] * 4


@pytest.mark.parametrize("n", [5, 60, 300])
def test_lambda_min_of_a_chain_held_softly(n: int) -> None:
    """3 (chain + cI): λmin(DKD) = 3c/4 exactly, the largest ones 3."""
    for c in 2.0 ** -np.arange(2, 60, 4):
        K = sp.csc_array(3 * (chain(n) + c * sp.eye_array(n)))
        if K.diagonal()[1] == 6.0:  # c is lost in rounding
            break
        for order in (np.arange(n), np.random.default_rng(1).permutation(n)):
            held = Stiffness.of(sp.csc_array(K[order][:, order]))
            assert (held.units == 0.5).all()
            kappa = proven_in_units(held, held.units)
            assert kappa <= 0.75 * c
            assert c < 1e-11 or kappa >= 0.3 * c


def test_the_softest_block_counts_and_a_general_one_too() -> None:
    random = np.random.default_rng(2)
    blocks = (sp.csc_array(3 * (chain(40) + 2.0**-12 * sp.eye_array(40))), graph_matrix(random, 400))
    for order in (blocks, blocks[::-1]):
        held = Stiffness.of(*order)
        assert 0.3 * 2.0**-12 <= proven_in_units(held, held.units) <= 0.75 * 2.0**-12


@pytest.mark.parametrize("name", GALLERY)
def test_both_references_of_a_scene_agree(name: str) -> None:
    """Within both bounds and what condensing in float64 loses, cond(K) 2⁻⁵³ max|x| and more."""
    scene = read_scene(name)
    dense, whole = prepared(scene), prepared(scene, form="sparse")
    case, load = load_case(scene), load_case(scene, "sparse")
    one, two = refined_active_set(dense, case), refined_active_set(whole, load)
    assert max(one.bound_mm, two.bound_mm) <= 1e-11
    condensing = 10 * float(str(dense.facts["cond_K"])) * 2.0**-53 * abs(one.x).max()
    x = whole.assembly.at_junction(two.x)
    assert abs(one.x - x).max() <= one.bound_mm + two.bound_mm + min(condensing, 1e-8)
    assert (one.active ^ two.active).sum() <= 2


@pytest.mark.parametrize("seed", range(4))
def test_the_equations_of_a_contact_set(seed: int) -> None:
    """λ and y of any set, against the dense equations; nothing closed needs no factor of its own."""
    assembly, load, *_ = exact_problem(seed)
    prepared = Prepared(assembly)
    K, A = assembly.K.matrices[0].toarray(), assembly.A.toarray()
    for share in (0.0, 0.4, 1.0):
        active = np.random.default_rng(seed).random(assembly.m) < share
        lam, y, slack_lam, slack_y = augmented.solution(prepared, load, active)
        C = A[:, active]
        zero = np.zeros((C.shape[1], C.shape[1]))
        both = np.linalg.solve(np.block([[K, C], [C.T, zero]]), np.concatenate([load.f, load.g[active]]))
        np.testing.assert_allclose(lam[active], both[assembly.n :], rtol=0, atol=1e-7 * abs(both).max())
        np.testing.assert_allclose(y[~active], (load.g - A.T @ both[: assembly.n])[~active], atol=1e-6)
        assert not lam[~active].any()
        assert not y[active].any()
        assert 0 <= slack_lam <= 1e-6 * abs(both).max()
        assert 0 <= slack_y <= 1e-6
