"""A solver as a plug-in: the accelerated projected gradient method (FISTA) with restarts, for the dual form.

    min ½ λᵀQ λ − pᵀλ,  λ ≥ 0:    λ⁺ = max(z − (Qz − p)/L, 0),   L = λmax(Q)
    z⁺ = λ⁺ + ((t − 1)/t⁺) (λ⁺ − λ),   t⁺ = (1 + √(1 + 4t²))/2

(Beck and Teboulle, SIAM J. Imaging Sci. 2, 2009); t is reset to 1 whenever the momentum points uphill,
(z − λ⁺)ᵀ(λ⁺ − λ) > 0 (O'Donoghue and Candès, Found. Comput. Math. 15, 2015). It needs of the order of
√cond(Q) products with Q, the projected gradient method cond(Q), and stops when max L|z − λ⁺|, a length in mm,
is at most the tolerance.

As a plug-in:  python -m harness check --plugin examples/accelerated_gradient.py
               python -m harness run --plugin examples/accelerated_gradient.py --size 4386 --out results/fista

Prints the largest contact force, N, in the scene gallery/three-part-stack.
"""

from typing import Any

import numpy as np

from rivetbench import Answer, DualLoadCase, Solver, check_solver, solve


class Fista(Solver):
    forms = ("dual",)

    def __init__(self, max_iterations: int = 200_000) -> None:
        self.max_iterations = max_iterations

    def prepare(self, problem: Any) -> Any:  # once per assembly
        return problem.Q, np.linalg.eigvalsh(problem.Q)[-1]

    def solve(self, ready: Any, load: DualLoadCase, tolerance: float) -> Answer:  # once per load case
        Q, largest = ready
        lam = z = np.zeros(len(load.p))
        t = 1.0
        for k in range(self.max_iterations):
            new = np.maximum(z - (Q @ z - load.p) / largest, 0)
            step, shift = new - lam, z - new
            if largest * abs(shift).max() <= tolerance:
                return Answer("solved", new, iterations=k)
            if shift @ step > 0:
                t = before = 1.0
            else:
                before, t = t, (1 + np.sqrt(1 + 4 * t * t)) / 2
            lam, z = new, new + (before - 1) / t * step
        return Answer("iteration_limit", lam, iterations=self.max_iterations)


def main() -> float:
    findings = check_solver(Fista)
    assert not findings, findings
    answer = solve("gallery/three-part-stack", Fista(), tolerance=1e-9)
    assert answer.judgement.verdict == "within", answer.judgement
    return float(answer.lam.max())


if __name__ == "__main__":
    print(f"{main():.6f}")
