"""Entries of K⁻¹ and Q, all or near the diagonal, by the factor of a sparse K, against a dense inverse; the
coarser model of a joint for them: the same junction, nearly the same compliance, no softer; and when K⁻¹ is
refined.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from sample_size import seeds
from small_joints import make_joint, make_scene
from small_problems import make_load, make_prepared
from sparse_matrices import band_matrix, graph_matrix, renumbered

from problems.forms.assembly import Assembly, LoadCase, Matrix
from problems.forms.prepared import Prepared
from problems.model.effect import Effect
from problems.model.effect_tables import effect_class
from problems.model.joint_model import JointModel
from problems.model.scene import JointScene
from problems.stiffness.band_factor import half_bandwidth
from problems.stiffness.banded_block import BandedBlock
from problems.stiffness.dense_block import DenseBlock
from problems.stiffness.operator import Stiffness
from problems.stiffness.selected_inverse import selected_inverse
from problems.stiffness.sparse_block import GeneralBlock, sparse_block

SINGLE = 2e-5  # of √(Z_ii Z_jj): float32, through a few dozen blocks


@pytest.mark.parametrize("half", [0, 1, 2, 3, 7, 15])
@pytest.mark.parametrize("seed", seeds(2, 6))
def test_the_inverse_near_the_diagonal(half: int, seed: int) -> None:
    """Sizes that the half-bandwidth divides, and others; any rows; from the diagonal alone to all of K⁻¹."""
    random = np.random.default_rng(100 * half + seed)
    n = int(random.integers(1, 60)) if seed else 4 * (half + 1)
    K = band_matrix(random, n, half)
    Z = np.linalg.inv(K.toarray())
    scale = np.sqrt(np.diag(Z))
    L = BandedBlock(K, half_bandwidth(K)).L
    for reach in {0, 1, half, 2 * half + 1, n - 1, n}:
        rows = np.flatnonzero(random.random(n) < random.choice([0.3, 1.0]))
        near = selected_inverse(L, rows, reach)
        for start in range(len(rows)):
            last = int(np.searchsorted(rows, rows[start] + reach, side="right"))
            for stop in {start + 1, (start + 1 + last) // 2, last}:
                here = rows[start:stop]
                error = near.submatrix(start, stop) - Z[np.ix_(here, here)]
                assert (abs(error) <= SINGLE * np.outer(scale[here], scale[here])).all()


def contacts(random: np.random.Generator, n: int, m: int) -> sp.csc_array:
    """Each contact on one to four unknowns within twelve of each other, with coefficients of any size."""
    A = np.zeros((n, m))
    for j in range(m):
        start = int(random.integers(0, n - 12))
        where = start + random.choice(12, int(random.integers(1, 5)), replace=False)
        A[where, j] = random.uniform(0.1, 3.0, len(where)) * random.choice([-1, 1], len(where))
    return sp.csc_array(A)


@pytest.mark.parametrize("seed", seeds(2, 8))
def test_the_compliance_of_windows_of_contacts(seed: int) -> None:
    """Several unknowns per contact, contacts on both blocks and on one, windows in any order of contacts."""
    random = np.random.default_rng(seed)
    n, m = 90, 30
    blocks = (band_matrix(random, n, 5), band_matrix(random, n, int(random.integers(0, 9))))
    parts = [contacts(random, n, m) @ sp.diags_array((random.random(m) < 0.7) * 1.0) for _ in range(2)]
    A = sp.csc_array(sp.vstack(parts))
    A.eliminate_zeros()
    Q = A.T @ np.linalg.solve(sp.block_diag(blocks).toarray(), A.toarray())
    scale = np.sqrt(np.diag(Q))
    windows = [random.choice(m, int(random.integers(1, 8)), replace=False) for _ in range(10)]
    near = Stiffness.of(*blocks).local_compliance(A, windows)
    for W in windows:
        window = near(W)
        assert window.flags.f_contiguous
        assert (abs(window - Q[np.ix_(W, W)]) <= 4 * SINGLE * np.outer(scale[W], scale[W])).all()
        part = W[: len(W) // 2 + 1]
        np.testing.assert_array_equal(near(part), window[: len(part), : len(part)])


@pytest.mark.parametrize(
    ("n", "half", "m"), [(200, 7, 30), (201, 7, 90), (50, 49, 9), (30, 1, 30), (9, 0, 4)]
)
@pytest.mark.parametrize("seed", seeds(1, 3))
def test_it_is_that_of_the_dense_matrices(n: int, half: int, m: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    K = band_matrix(random, n, half)
    A = sp.csc_array(sp.random_array((n, m), density=0.05, random_state=random))
    Q = A.T @ np.linalg.solve(K.toarray(), A.toarray())
    order = random.permutation(n)
    for block, columns in (
        (DenseBlock(K.toarray(order="F")), A),
        (sparse_block(K), A),
        (GeneralBlock(K, n), A),
        (sparse_block(renumbered(K, order)), sp.csc_array(A[order])),
    ):
        found = Stiffness([block]).compliance(columns)
        np.testing.assert_allclose(found, Q, rtol=0, atol=1e-13 * abs(Q).max(initial=1.0))


@pytest.mark.parametrize("kind", ["band", "renumbered", "general"])
def test_without_coordinates_windows_go_along_the_bands(kind: str) -> None:
    """Contacts between two unconnected bodies, whatever the numbering: M Q is nearly I, and the diagonal that
    of Q. Without a band there is no M.
    """
    random, m = np.random.default_rng(5), 290
    bodies = [graph_matrix(random, 800) if kind == "general" else band_matrix(random, 600, 30) for _ in "ab"]
    n = bodies[0].shape[0]
    unit = sp.eye_array(n, format="csc")[:, :m]
    A = sp.csc_array(sp.vstack([unit, -unit]))
    if kind == "renumbered":
        order = random.permutation(n)
        bodies, A = [renumbered(K, order) for K in bodies], A[np.concatenate([order, n + order])]
    found = Prepared(Assembly(Stiffness.of(*bodies), sp.csc_array(A))).approximate_inverse
    assert (found.M is None) == (kind == "general")
    if found.M is not None:
        sides = zip(bodies, np.split(A.toarray(), 2), strict=True)
        Q = np.sum([B.T @ np.linalg.solve(K.toarray(), B) for K, B in sides], axis=0)
        np.testing.assert_allclose(found.diagonal, Q.diagonal(), rtol=SINGLE)
        Q = Q[np.ix_(found.M.order, found.M.order)]
        product = np.column_stack([found.M.product(column) for column in Q])
        assert abs(np.linalg.eigvals(product) - 1).max() <= 0.1


# --- the coarser model ----------------------------------------------------------------------------------

LONG = {
    "thickness": 3.0,
    "south": {"length": 300.0, "elements": 12},
    "north": {"length": 600.0, "elements": 24},
    "clamped": ["north", "south"],
}


def effect(kind: str, **parameters: Any) -> Effect:
    return effect_class(kind).model_validate({"kind": kind, **parameters})


def joint_with(*effects: Effect) -> JointScene:
    return make_scene(make_joint(LONG, LONG | {"name": "b"}, contacts=[("a", "b")], nodes=(8, 6)), *effects)


SCENES = {
    "plain": joint_with(),
    "ribs": joint_with(effect("ribs", part="a", lines=[320.0, 520.0], I=2e4, J=1e3)),
    "stringers": joint_with(effect("stringers", part="b", pitch=100.0, start=0.0, stop=400.0, I=2e4)),
    "pad": joint_with(effect("local_thickness", part="a", thickness=9.0, x=[100.0, 300.0], y=[200.0, 400.0])),
    "support": joint_with(effect("supports", part="a", points=[[200.0, 450.0]], stiffness_per_point=1e6)),
    "springs": joint_with(effect("installed_fasteners", points=[[100.0, 60.0], [300.0, 60.0]])),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_compliance_is_nearly_the_same_and_no_larger(name: str) -> None:
    """K' = PᵀKP, so Q' ≤ Q; half of the unknowns are gone."""
    model = JointModel.of(SCENES[name])
    coarse = model.graded()
    assert model.sparse().coarser is not None
    assert coarse.numbering.size < 0.7 * model.numbering.size
    assert coarse.springs.groups == model.springs.groups
    Q, near = Prepared(model.assembly()).Q, Prepared(coarse.assembly()).Q
    ratio = sla.eigh(near, Q, eigvals_only=True)
    assert 1 - 2e-3 <= ratio[0] < 1 - 1e-6
    assert ratio[-1] <= 1 + 1e-9


# --- K⁻¹ by a factor, refined where the residual asks for it --------------------------------------------


class Counted(Stiffness):
    solves = 0

    def solve(self, b: Matrix) -> Matrix:
        self.solves += 1
        return super().solve(b)


@pytest.mark.parametrize(("error", "solves"), [(0.0, 1), (1e-7, 2)])
@pytest.mark.parametrize("columns", [1, 2])
def test_a_second_pass_only_where_the_first_leaves_a_residual(
    error: float, solves: int, columns: int
) -> None:
    made = make_prepared(4, 20)
    case, _ = make_load(4, made)
    lam: Any = np.random.default_rng(5).random(made.assembly.m)
    K = sp.block_diag(made.assembly.K.matrices).toarray()
    wanted = np.linalg.solve(K, case.f - made.assembly.A @ lam)
    if columns > 1:
        wanted, f, lam = (np.column_stack([v] * columns) for v in (wanted, case.f, lam))
        case = LoadCase(f, case.g)
    counted = Counted.of(*made.assembly.K.matrices)
    for block, U in zip(counted.blocks, made.assembly.K.factors, strict=True):
        block.U = U * (1 + error)  # type: ignore[attr-defined]
    found = Prepared(replace(made.assembly, K=counted)).recover(lam, case)
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-12 * abs(wanted).max())
    assert counted.solves == solves
