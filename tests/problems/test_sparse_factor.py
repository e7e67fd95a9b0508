"""Factors of a sparse K, each against the dense matrix, and what they say of a mechanism."""

import re
from functools import reduce
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
import threadpoolctl
from sample_size import seeds
from sparse_matrices import band_matrix, chain, graph_matrix, renumbered

from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms import FORMS
from problems.forms.assembly import Matrix
from problems.forms.sprung_stiffness import SprungStiffness
from problems.scene_files import read_scene
from problems.stiffness import band_factor
from problems.stiffness.band_factor import factor_norm, half_bandwidth, lower_band
from problems.stiffness.banded_block import BandedBlock
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.cholmod import Cholmod
from problems.stiffness.operator import Stiffness
from problems.stiffness.sparse_block import GeneralBlock, sparse_block
from problems.stiffness.superlu import SuperLU


@pytest.fixture(params=[Cholmod, SuperLU])
def library(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """That factors what has no narrow band."""
    monkeypatch.setattr(GeneralBlock, "make_factor", staticmethod(request.param))


def close(found: Matrix, expected: Matrix) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * abs(expected).max())


def scattered(random: np.random.Generator, n: int, half: int) -> tuple[sp.csc_array, Matrix]:
    """A band matrix in a random order, and where its unknowns lie along the model."""
    order = random.permutation(n)
    return renumbered(band_matrix(random, n, half), order), np.column_stack([order / 1.0, order % 2])


def test_a_band_is_factored_on_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit holds for the factorisation alone."""
    seen, dpbtrf = [], band_factor.lapack.dpbtrf

    def counted() -> set[int]:
        return {pool["num_threads"] for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"}

    def factor(band: Matrix, **how: int) -> tuple[Matrix, int]:
        seen.append(counted())
        return dpbtrf(band, **how)

    monkeypatch.setattr(band_factor, "lapack", SimpleNamespace(dpbtrf=factor))
    before = counted()
    L, info = band_factor.band_cholesky(np.array([[4.0, 5.0], [2.0, 0.0]], order="F"))
    assert (L.tolist(), info, seen, counted()) == ([[2.0, 2.0], [1.0, 0.0]], 0, [{1}], before)


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize("seed", seeds(3, 12))
def test_each_factor_solves_as_the_dense_matrix_does(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(300, 500))
    band, (far, nodes), graph = band_matrix(random, n, 3), scattered(random, n, 3), graph_matrix(random, 800)
    for K, where, kind in (
        (band, None, BandedBlock),
        (far, None, BandedBlock),
        (far, nodes, BandedBlock),
        (graph, None, GeneralBlock),
    ):
        factor = sparse_block(K, where)
        assert type(factor) is kind
        assert getattr(factor, "order", None) is None or K is far
        factor.factor()
        told = kind is not GeneralBlock or factor.general_factor.nonzeros is not None
        assert not told or factor.factor_nonzeros < K.shape[0] ** 2 / 2
        one, three = random.standard_normal(K.shape[0]), random.standard_normal((K.shape[0], 3))
        expected = np.linalg.solve(K.toarray(), np.column_stack([one, three]))
        close(factor.solve(one), expected[:, 0])
        close(factor.solve(three), expected[:, 1:])


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize("n", [1, 2, 5, 9])
@pytest.mark.parametrize("half", [0, 1, 4, 8])
@pytest.mark.parametrize("seed", seeds(1, 3))
def test_small_matrices_of_any_band(n: int, half: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    K = band_matrix(random, n, half)
    dense, b = K.toarray(), random.standard_normal(n)
    rows, columns = dense.nonzero()
    assert half_bandwidth(K) == max(rows - columns)
    band = lower_band(K, half_bandwidth(K))
    assert band.shape == (half_bandwidth(K) + 1, n)
    for d in range(len(band)):
        np.testing.assert_array_equal(band[d, : n - d], np.diag(dense, -d))
    backwards = BandedBlock(K, half_bandwidth(K), np.arange(n)[::-1])
    for factor in (sparse_block(K), GeneralBlock(K, n), backwards):
        close(factor.solve(b), np.linalg.solve(dense, b))


@pytest.mark.parametrize("half", [2, 70])
def test_a_factor_in_pieces_has_the_norm_of_the_dense_one(half: int) -> None:
    """Its last row, a piece of its own, has the largest entries; the least eigenvalue is that of no piece."""
    n = band_factor.WINDOW * max(half, band_factor.NARROW) + 1
    chains = sp.diags_array([-1.0, -1.0, 4.0, -1.0, -1.0], offsets=[-half, -1, 0, 1, half], shape=(n, n))
    D = sp.diags_array(np.append(np.ones(n - 1), 4.0))
    K = sp.csc_array(D @ chains @ D)
    dense = K.toarray()
    least = float(np.linalg.eigvalsh(dense)[0])
    L = abs(np.linalg.cholesky(dense - least / 2 * np.eye(n)))
    assert factor_norm(K, half, least / 2) == pytest.approx((L @ L.T).sum(axis=1).max(), rel=1e-10)
    assert factor_norm(K, half, least * (1 + 1e-6)) is None


def test_the_size_of_a_factor_is_known_before_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exactly for a band; within a factor of 2½ for a grid without one, in the plane and in space."""
    random = np.random.default_rng(0)
    far, nodes = scattered(random, 400, 3)
    for K, where in ((band_matrix(random, 400, 3), None), (far, None), (far, nodes)):
        block = sparse_block(K, where)
        assert block.factor_nonzeros == sum(array.size for array in block.factor())
    for shape in ((290, 280), (25, 24, 23)):
        n = int(np.prod(shape))
        differences = reduce(sp.kronsum, map(chain, reversed(shape)))  # of neighbours on the grid
        block = sparse_block(renumbered(differences + 0.01 * sp.eye_array(n), random.permutation(n)))
        assert isinstance(block, GeneralBlock)
        monkeypatch.setattr(GeneralBlock, "make_factor", staticmethod(SuperLU))  # the other does not tell
        expected = block.factor_nonzeros
        block.factor()
        assert expected / 2.5 < 1.5 * block.factor_nonzeros < 2.5 * expected


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize("seed", seeds(3, 12))
def test_a_mechanism_is_named_by_an_unknown_that_moves(seed: int) -> None:
    """A chain that nothing holds, among unknowns that are held, in each of the three kinds of factor."""
    random = np.random.default_rng(seed)
    n, loose = 800, int(random.integers(2, 6))
    for held, order in (
        (band_matrix(random, n, 2), np.arange(n + loose)),
        (band_matrix(random, n, 2), random.permutation(n + loose)),
        (graph_matrix(random, n), random.permutation(n + loose)),
    ):
        K = renumbered(sp.csc_array(sp.block_diag([held, 1e3 * chain(loose)])), order)
        with pytest.raises(NotPositiveDefinite) as caught:
            sparse_block(K).factor()
        assert order[caught.value.unknown] >= n


def test_the_block_of_a_mechanism_counts() -> None:
    blocks = (band_matrix(np.random.default_rng(1), 7, 2), chain(3))
    with pytest.raises(NotPositiveDefinite) as caught:
        Stiffness.of(*blocks).ensure_factored()
    assert 7 <= caught.value.unknown < 10
    assert str(caught.value.unknown) in str(caught.value)


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize(
    ("K", "moving"),
    [
        ([[0.0, 1.0], [1.0, 0.0]], {0, 1}),  # another row's pivot is positive
        ([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]], {0, 1, 2}),
        ([[4.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 2.0]], {1}),
        ([[1e-3, 0.0, 0.0], [0.0, 1.0, -1.0], [0.0, -1.0, 1.0]], {1, 2}),  # the softest one is held
        ([[2.0, 2.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1e-3]], {0, 1}),
        ([[5.0, 0.0], [0.0, 0.0]], {1}),
    ],
)
def test_what_is_indefinite_or_singular_has_no_factor(K: list[list[float]], moving: set[int]) -> None:
    matrix = sp.csc_array(np.array(K))
    for block in (sparse_block(matrix), GeneralBlock(matrix, len(K))):
        with pytest.raises(NotPositiveDefinite) as caught:
            block.factor()
        assert caught.value.unknown in moving


@pytest.mark.parametrize("with_nodes", [False, True])
def test_a_scene_with_a_mechanism_is_bad_input_that_says_where_it_moves(
    with_nodes: bool, tmp_path: Path
) -> None:
    """A user's own matrices: of parts, supports are checked before. Both roads refuse in the same words."""
    n, loose = 60, 4
    K = sp.block_diag([band_matrix(np.random.default_rng(1), n, 2), chain(loose)]).toarray()
    nodes = np.column_stack([np.arange(n + loose), np.zeros(n + loose)])
    given = {"K": K, "A": np.eye(n + loose)[:, :9], "f": np.ones(n + loose), "g": np.zeros(9)}
    np.savez(tmp_path / "own.npz", **given, **({"nodes": nodes} if with_nodes else {}))
    scene = read_scene(str(tmp_path / "own.npz"))
    allowed = []
    for form in FORMS:
        with pytest.raises(InputError) as caught:
            prepared(scene, form=form).overlap(load_case(scene, form))
        (fault,) = caught.value.faults
        assert str(tmp_path / "own.npz") in str(caught.value)
        allowed.append(fault.allowed)
    assert set(allowed) == {allowed[0]}
    assert re.fullmatch(r"x\[6[0-3]\]" + (r" at \(6[0-3], 0\) mm" if with_nodes else ""), fault.key)


@pytest.mark.parametrize("n", [8, 60])
def test_springs_of_any_stiffness_share_a_numbering(n: int) -> None:
    """Also where springs of stiffness 1 cancel entries of K."""
    random = np.random.default_rng(n)
    K = sp.csc_array(2 * np.eye(n) + np.eye(n)[::-1])
    A = sp.csc_array(np.eye(n, n // 2) - np.eye(n)[::-1][:, : n // 2])
    sprung = SprungStiffness(K, A, None)
    for rho in (np.ones(n // 2), 7.0 * (random.random(n // 2) < 0.5)):
        full = K.toarray() + (A.toarray() * rho) @ A.toarray().T
        close(sprung.factor(rho)(np.eye(n)), np.linalg.inv(full))
