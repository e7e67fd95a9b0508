"""Every solver of the registry in each of its forms, and how far from the answer it may end."""

import numpy as np

from harness.solving.session import SolverSession
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.base import Answer, Form
from solvers.registry import make_solver, modules, owner_of, solver_names

#: Those of the project and of its extra `extra-solvers`: what else is installed decides about no test.
TESTED = [
    name for name in solver_names() if name in {*modules(), "daqp", "highs", "qpalm", "quadprog", "scs"}
]
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
    session = SolverSession(solver, in_form(prepared, form), tolerance)
    session.open()
    answer = session.cold(LoadCase(case.f, case.g, prepared.dual_load(case)))
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
