"""An x that came from elsewhere, judged: a penalty method lets the parts overlap.

Instead of Aᵀx ≤ g it minimises

    ½ xᵀK x − fᵀx + ½ ρ ‖max(Aᵀx − g, 0)‖²,

whose contact forces are λ = ρ max(Aᵀx − g, 0): a stiff spring in each closed contact. Newton's method solves
(K + ρ A_C A_Cᵀ) x = f + ρ A_C g_C, with C the contacts that overlap, until C stays the same. The error is
proportional to 1/ρ, until K + ρ A_C A_Cᵀ is too ill-conditioned.

Prints the largest error of x, mm, that the judge finds for ρ = 1e6 N/mm.
"""

import numpy as np

from rivetbench import judge, own_matrices


def joint(n: int = 40) -> tuple[np.ndarray, ...]:
    """K, A, f, g: a string on an elastic bed, 20 N on each of n nodes, over a parabola 0.1 … 0.5 mm below."""
    K = np.diag(np.full(n, 220.0)) - np.diag(np.full(n - 1, 100.0), 1) - np.diag(np.full(n - 1, 100.0), -1)
    g = 0.1 + 0.4 * np.linspace(-1, 1, n) ** 2
    return K, np.eye(n), np.full(n, 20.0), g


def penalty(K: np.ndarray, A: np.ndarray, f: np.ndarray, g: np.ndarray, rho: float) -> np.ndarray:
    """x (n,), mm."""
    closed, x = np.zeros(len(g), dtype=bool), np.linalg.solve(K, f)
    while not np.array_equal(A.T @ x > g, closed):
        closed = A.T @ x > g
        A_C = A[:, closed]
        x = np.linalg.solve(K + rho * A_C @ A_C.T, f + rho * A_C @ g[closed])
    return x


def main() -> float:
    K, A, f, g = joint()
    x = penalty(K, A, f, g, rho=1e6)
    judgement = judge(own_matrices(K, A, f, g), x)
    assert judgement.verdict == "outside"  # of 1e-7 mm
    assert judgement.displacement_error_mm is not None
    return judgement.displacement_error_mm


if __name__ == "__main__":
    print(f"{main():.6e}")
