"""Block principal pivoting ends where full exchanges cycle."""

import numpy as np
import pytest
from small_problems import by_nnls, definite

from solvers.algorithms.block_pivoting import MAX_STALE_PASSES, block_pivoting, forces_on


@pytest.mark.parametrize("stale", [0, MAX_STALE_PASSES])
def test_pivoting_ends_where_full_exchanges_cycle(stale: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A beam pressed on a rigid floor, Q its stiffness by second differences: many starts circle there."""
    monkeypatch.setattr("solvers.algorithms.block_pivoting.MAX_STALE_PASSES", stale)
    size, descended = 20, 0
    bending = np.diff(np.eye(size + 4), 2, axis=0)[:, 2:-2]
    Q = np.asfortranarray(bending.T @ bending)
    for seed in range(60):
        p = np.random.default_rng(seed).standard_normal(size)
        result = block_pivoting(lambda C, p=p: forces_on(C, Q, p), p > 0, np.diag(Q), 1e-12, 10_000)
        assert result.converged
        wanted = by_nnls(Q, p)
        np.testing.assert_allclose(result.trial.lam, wanted, atol=1e-8 * max(1.0, wanted.max()))
        descended += result.descents > 0
    assert descended > 3


@pytest.mark.parametrize(("stale", "seed"), [(0, 0), (0, 5), (MAX_STALE_PASSES, 5)])
def test_no_set_comes_back(stale: int, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Q without locality, loads of many sizes: exchanges circle, descent ends within a few times m sets."""
    monkeypatch.setattr("solvers.algorithms.block_pivoting.MAX_STALE_PASSES", stale)
    rng = np.random.default_rng(seed)
    Q, p = definite(100, seed, 1e8), 10 ** rng.uniform(-6, 0, 100) * rng.choice([-1, 1], 100)
    found = block_pivoting(lambda C: forces_on(C, Q, p), p > 0, np.diag(Q), 0.0, 400)
    assert found.converged
    assert found.descents > 10
