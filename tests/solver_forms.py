"""Every solver of the registry in each of its forms, and how far from the exact answer it may end."""

import tomllib
from pathlib import Path

import numpy as np
from exact_draws import ExactLoad

from harness.verification.judge import LIMIT_MM, conditioned_limit
from problems.forms.prepared import Prepared
from solvers.base import Form
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
