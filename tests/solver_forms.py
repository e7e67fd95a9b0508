"""Every solver of the registry in each of its forms, and how far from the exact answer it may end."""

import tomllib
from pathlib import Path

import numpy as np
from exact_draws import ExactLoad
from small_problems import problem_in

from harness.solving.solver_session import SolverSession
from harness.verification.judge import LIMIT_MM, conditioned_limit
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from solvers.base import Answer, Form
from solvers.libraries.qpsolvers import DISTRIBUTIONS
from solvers.registry import make_solver, modules, owner_of, solver_names

COMPLIANCE = 0.1  # mm/N, as in ipm's CONTACT_COMPLIANCE

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
REQUIRED = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["extra-solvers"]]
INSTALLED = {requirement.partition(">")[0] for requirement in REQUIRED}
#: The solvers of the package and those that it requires: what else is installed decides about no test.
TESTED = [n for n in solver_names() if n in modules() or DISTRIBUTIONS.get(n, n) in INSTALLED]
CASES: list[tuple[str, Form]] = [(name, form) for name in TESTED for form in make_solver(name, {}).forms]
#: Its steps grow with cond(Q): it may give up, but must not be wrong.
SLOW = ("projected-gauss-seidel",)
IN_HOUSE = [(name, form) for name, form in CASES if owner_of(name) == "ours"]

#: The textbook methods written here.
WRITTEN_HERE = (*SLOW, "textbook-active-set")

#: The tolerance handed over; 1e-9 to the others.
TOLERANCES = {
    name: 1e-14 if name == "ipm" else 1e-10
    for name in modules()
    if owner_of(name) == "ours" or name in WRITTEN_HERE
}

#: These end with the right contact set and solve its equations: no tolerance is left in their answer.
ACTIVE_SET = ("gi", "newton", "ipm-fast", "quadprog", "daqp", "nnls", "textbook-active-set")


def solve(name: str, form: Form, prepared: Prepared, case: LoadCase) -> tuple[Answer, Vector | None]:
    """The solver's answer, and its displacements where it has any."""
    solver, tolerance = make_solver(name, {}), TOLERANCES.get(name, 1e-9)
    session = SolverSession(solver, problem_in(prepared, form), tolerance)
    session.open()
    answer = session.cold(prepared.with_p([case])[0])
    if answer.lam is None or form != "dual":
        return answer, answer.x
    return answer, prepared.recover(answer.lam, case)


def eigenvalues(prepared: Prepared) -> tuple[float, float]:
    """λmin and λmax of K."""
    values = [np.linalg.eigvalsh(K) for K in prepared.assembly.K.matrices]
    return min(float(v[0]) for v in values), max(float(v[-1]) for v in values)


def allowed(name: str, prepared: Prepared, case: LoadCase, x: Vector, lam: Vector) -> float:
    """max|x − x*|, mm, that cond(K) and the solver's tolerance τ explain.

    100 cond(K) 2⁻⁵³ max(|x|, |K⁻¹f|), x being what is left of K⁻¹f − K⁻¹Aλ; and besides
    (‖r‖₂/√κ + √(sᵀλ))/√κ, κ = λmin(K), with ‖r‖₂ ≤ τ√n and sᵀλ ≤ τ(m + Σλ): ‖x − x*‖²_K is at most
    (x − x*)ᵀr + sᵀλ. PIQP looks at λ ≥ 0 in a scaling of its own and was seen
    to leave −3.5τ; a λ ≥ −10τ adds s*ᵀ10τ to sᵀλ, for (s* − s)ᵀ(λ* − λ) then is at most sᵀλ − s*ᵀλ.
    Clarabel's τ is a share of the data where that is above 1.
    """
    low, high = eigenvalues(prepared)
    size = max(float(abs(v).max(initial=0.0)) for v in (x, prepared.assembly.K.solve(case.f)))
    conditioning = 100 * high / low * 2.0**-53 * size
    if name in ACTIVE_SET:
        return conditioning
    tau = 1e-10 if name == "ipm" else TOLERANCES.get(name, 1e-9)
    if name == "clarabel":
        tau *= max(1.0, float(abs(case.f).max()))
    residual = tau * np.sqrt(prepared.assembly.n / low)
    complementarity = tau * (prepared.assembly.m + lam.sum())
    if name == "piqp":
        complementarity += 10 * tau * np.maximum(case.g - prepared.assembly.A.T @ x, 0.0).sum()
    return conditioning + float((residual + np.sqrt(complementarity)) / np.sqrt(low))


def promised(name: str, D: float, m: int, weakest: float, force: float, rounding: float) -> float:
    """√D ‖x − x*‖_K, which max|x − x*| does not exceed, of a solver that kept its word; D = 1: ‖λ − λ*‖_Q.

    With contacts of unit length and |y_C| ≤ δ, y ≥ −δ: the answer is that of gaps changed by δ, and off by
    √(mδ²/λmin(Q)) in the norm of K at most. Of ipm, λᵀy ≤ m ε_μ, and feasible to δ: from
    ‖e‖²_K = (λ − λ*)ᵀ(y − y*) ≤ λᵀy − λ*ᵀy ≤ m ε_μ + δ Σ(λ + λ*).
    """
    tolerance = TOLERANCES[name]
    if name == "ipm":
        delta = max(1e-3 * np.sqrt(tolerance), rounding)
        return float(np.sqrt(D * (m * tolerance + 2.1 * delta * force)))
    return float(np.sqrt(D * m / weakest) * max(tolerance, rounding)) if weakest > 0 else np.inf


def promises(data: Prepared, draw: ExactLoad, condition: float) -> dict[str, tuple[float, float]]:
    """max|x − x*|, mm, that each solver's promise and the judge's limit leave.

    The latter is for joints no more compliant than ipm assumes, and for units in which 1e-7 mm is more than
    the rounding of K⁻¹f: where it is less, the judge knows of cond(K), not of nearly dependent contacts.
    """
    m, c = data.assembly.m, abs(data.assembly.A).max(axis=0).toarray().ravel()
    D = float(np.diag(data.assembly.K.solve(np.eye(data.assembly.n))).max())
    weakest = float(np.linalg.eigvalsh(data.Q / c / c[:, None])[0])
    size = float(max(abs(v).max() for v in (draw.x, data.assembly.K.solve(draw.load.f), draw.load.g / c)))
    rounding = conditioned_limit(0.0, condition, size)
    judged = LIMIT_MM if D <= COMPLIANCE and rounding <= LIMIT_MM else np.inf
    force = float((c * draw.lam).sum())
    return {
        name: (promised(name, D, m, weakest, force, rounding / 10) + rounding, judged) for name in TOLERANCES
    }
