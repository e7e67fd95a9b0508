"""Your own matrices: K, A, f, g through all that scenes go through, and Q, p through one solver.

Two strings of 50 nodes each on elastic beds, K_1 = tridiag(−1, 2.1, −1) N/mm and K_2 = 2 K_1, 0.2 mm apart
(A = [I; −I]), are pressed together in the middle. The same problem in its dual form,

    min ½ λᵀQ λ − pᵀλ,  λ ≥ 0,   Q = AᵀK⁻¹A,  p = AᵀK⁻¹f − g,

is here solved by Goldfarb–Idnani's method on plain arrays, and x = K⁻¹(f − Aλ) must be the same.

Prints the sum of the contact forces, N.
"""

import numpy as np
import scipy.linalg as sla

from rivetbench import own_matrices, solve, solve_dual

N = 50


def main() -> float:
    string = 2.1 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)
    K = sla.block_diag(string, 2 * string)
    A = np.vstack([np.eye(N), -np.eye(N)])
    f, g = np.zeros(2 * N), np.full(N, 0.2)
    f[N // 2], f[N + N // 2] = 1.0, -1.0

    answer = solve(own_matrices(K, A, f, g), "piqp", tolerance=1e-10)

    Q, p = A.T @ np.linalg.solve(K, A), A.T @ np.linalg.solve(K, f) - g
    dual = solve_dual((Q + Q.T) / 2, p, "gi")
    assert dual.lam is not None
    x = np.linalg.solve(K, f - A @ dual.lam)
    assert abs(x - answer.x).max() < 1e-7
    return float(answer.lam.sum())


if __name__ == "__main__":
    print(f"{main():.6f}")
