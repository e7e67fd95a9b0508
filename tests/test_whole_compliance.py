"""Q of few contacts from the factor of a large K is that of the dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from sparse_matrices import band_matrix, graph_matrix, renumbered

from problems.forms.assembly import Assembly
from problems.forms.sparse_factor import BandFactor, GeneralFactor, Renumbered, factored
from problems.forms.sparse_prepared import SparsePrepared
from problems.forms.whole_compliance import whole_compliance


@pytest.mark.parametrize(
    ("n", "half", "m"), [(200, 7, 30), (201, 7, 90), (50, 49, 9), (30, 1, 30), (9, 0, 4)]
)
@pytest.mark.parametrize("seed", range(3))
def test_it_is_that_of_the_dense_matrices(n: int, half: int, m: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    K, A = (
        band_matrix(random, n, half),
        sp.csc_array(sp.random_array((n, m), density=0.05, random_state=random)),
    )
    Q = A.T @ np.linalg.solve(K.toarray(), A.toarray())
    order = random.permutation(n)
    for factor, columns in (
        (factored(K), A),
        (GeneralFactor(K), A),
        (factored(renumbered(K, order)), sp.csc_array(A[order])),
    ):
        found = whole_compliance(factor, columns)
        np.testing.assert_allclose(found, Q, rtol=0, atol=1e-13 * abs(Q).max(initial=1.0))


@pytest.mark.parametrize("kind", [BandFactor, Renumbered, GeneralFactor])
def test_of_few_contacts_without_coordinates_the_approximate_inverse_is_exact(kind: type) -> None:
    """Contacts between two unconnected bodies in one K, whatever the numbering: M Q = I."""
    random, m = np.random.default_rng(5), 40
    parts = [graph_matrix(random, 800) if kind is GeneralFactor else band_matrix(random, 300, 4)] * 2
    K = sp.csc_array(sp.block_diag(parts))
    n = K.shape[0]
    unit = sp.eye_array(n, format="csc")
    A = sp.csc_array(unit[:, :m] - unit[:, n // 2 : n // 2 + m])
    if kind is Renumbered:
        order = random.permutation(n)
        K, A = renumbered(K, order), sp.csc_array(A[order])
    prepared = SparsePrepared(Assembly((K,), A))
    assert [type(factor) for factor in prepared.sparse_factors] == [kind]
    approximate = prepared.approximate_inverse
    assert approximate is not None
    Q = A.T @ np.linalg.solve(K.toarray(), A.toarray())
    product = np.column_stack([approximate.M.product(column) for column in Q[approximate.M.order].T])
    np.testing.assert_allclose(product[:, approximate.M.order], np.eye(m), atol=1e-10)
    np.testing.assert_allclose(approximate.diagonal, Q.diagonal(), rtol=1e-12)
