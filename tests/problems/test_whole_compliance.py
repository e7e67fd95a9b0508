"""Q of few contacts from the factor of a large K is that of the dense matrices."""

import numpy as np
import pytest
import scipy.sparse as sp
from long import seeds
from sparse_matrices import band_matrix, graph_matrix, renumbered

from problems.forms.assembly import Assembly
from problems.forms.prepared import Prepared
from problems.stiffness.banded import BandedBlock
from problems.stiffness.dense import DenseBlock
from problems.stiffness.general import GeneralBlock
from problems.stiffness.operator import Stiffness
from problems.stiffness.sparse import sparse_block


@pytest.mark.parametrize(
    ("n", "half", "m"), [(200, 7, 30), (201, 7, 90), (50, 49, 9), (30, 1, 30), (9, 0, 4)]
)
@pytest.mark.parametrize("seed", seeds(1, 3))
def test_it_is_that_of_the_dense_matrices(n: int, half: int, m: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    K, A = (
        band_matrix(random, n, half),
        sp.csc_array(sp.random_array((n, m), density=0.05, random_state=random)),
    )
    Q = A.T @ np.linalg.solve(K.toarray(), A.toarray())
    order = random.permutation(n)
    for block, columns in (
        (DenseBlock(K.toarray(order="F")), A),
        (sparse_block(K), A),
        (GeneralBlock(K, n), A),
        (sparse_block(renumbered(K, order)), sp.csc_array(A[order])),
    ):
        found = block.compliance(columns)
        np.testing.assert_allclose(found, Q, rtol=0, atol=1e-13 * abs(Q).max(initial=1.0))


@pytest.mark.parametrize("kind", ["band", "renumbered", "general"])
def test_of_few_contacts_without_coordinates_the_approximate_inverse_is_exact(kind: str) -> None:
    """Contacts between two unconnected bodies in one K, whatever the numbering: M Q = I."""
    random, m = np.random.default_rng(5), 40
    parts = [graph_matrix(random, 800) if kind == "general" else band_matrix(random, 300, 4)] * 2
    K = sp.csc_array(sp.block_diag(parts))
    n = K.shape[0]
    unit = sp.eye_array(n, format="csc")
    A = sp.csc_array(unit[:, :m] - unit[:, n // 2 : n // 2 + m])
    if kind == "renumbered":
        order = random.permutation(n)
        K, A = renumbered(K, order), sp.csc_array(A[order])
    prepared = Prepared(Assembly(Stiffness.of(K), A))
    (block,) = prepared.assembly.K.blocks
    assert isinstance(block, GeneralBlock if kind == "general" else BandedBlock)
    approximate = prepared.approximate_inverse
    Q = A.T @ np.linalg.solve(K.toarray(), A.toarray())
    product = np.column_stack([approximate.M.product(column) for column in Q[approximate.M.order].T])
    np.testing.assert_allclose(product[:, approximate.M.order], np.eye(m), atol=1e-10)
    np.testing.assert_allclose(approximate.diagonal, Q.diagonal(), rtol=1e-12)
