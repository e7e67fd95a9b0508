"""Goldfarb–Idnani's dual active-set method with Powell's safeguards, on either form.

In the space of the constraints both forms have the same structure. With multipliers u ≥ 0 and slacks
s = s0 + G u, the method finds s ≥ 0, uᵀs = 0:

    primal form:  constraints Aᵀx ≤ g   u = λ   s = g − Aᵀx   G = AᵀK⁻¹A = Q   s0 = −p
    dual form:    constraints λ ≥ 0     u = y   s = λ         G = Q⁻¹          s0 = Q⁻¹p

u = 0 is the unconstrained minimum, where Algorithm 1 starts. The pivots are Goldfarb and Idnani's;
in this space they need a factor of G_CC instead of (n, n) matrices.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as sla
from scipy.linalg import lapack

from problems.forms.assembly import Matrix, Vector
from solvers.algorithms.block_pivoting import solve_from
from solvers.algorithms.goldfarb_idnani import GiResult, Slacks, goldfarb_idnani
from solvers.base import DENSE_FORMS, Answer, LoadCase, Problem, failed
from solvers.kkt import EPS, kkt_residual, kkt_status
from solvers.method import Method, State

MAX_PIVOTS = 10  # changes of the active set, in units of m


@dataclass(frozen=True, kw_only=True)
class _Prepared(State):
    """G : Q in the primal form, Q⁻¹ in the dual one. U : the factor of Q = UᵀU in the dual form."""

    G: Matrix
    U: Matrix | None = None


class GoldfarbIdnani(Method):
    """Goldfarb–Idnani with Powell's safeguards.

    Stops when no slack is below −tolerance (mm in the primal form, N in the dual form) beyond rounding. In
    the dual form the answer λ ≥ 0, y = Qλ − p is then checked: "solved" if −y, and |y| where λ > 0, are at
    most max(tolerance, 4ε(|p| + |Q|λ)) mm, else "inaccurate". Iterations are changes of the active set. If
    rounding in Q⁻¹ leaves it inaccurate, or in the primal form an open contact has a slack barely below zero,
    block principal pivoting continues from its set (details: finishing_sets).
    """

    forms = DENSE_FORMS

    def state(self, problem: Problem) -> _Prepared:
        """G: Q itself, or Q⁻¹ from the Cholesky factor of Q."""
        if not problem.bounded:
            return _Prepared(problem=problem, G=problem.Q)
        U = sla.cholesky(problem.Q, check_finite=False)
        G, info = lapack.dpotri(U)  # its upper triangle
        if info:
            raise np.linalg.LinAlgError(f"the diagonal of U is zero at {info}")
        G += np.triu(G, 1).T
        return _Prepared(problem=problem, G=G, U=U)

    def solved(self, ready: _Prepared, load: LoadCase, tolerance: float) -> Answer:
        data = ready.problem
        if ready.U is None:
            slacks = _primal_slacks(ready, load)
        else:
            p = data.prepared.with_p([load])[0].p
            slacks = _dual_slacks(ready, p)
        limit = self.most(MAX_PIVOTS * len(ready.G) + 10)
        result = goldfarb_idnani(ready.G, slacks, tolerance, limit)
        if not np.isfinite(result.u).all():
            return failed("rounding: the multipliers are no longer finite", result.pivots)
        details: dict[str, Any] = {"drops": result.drops, "refinements": result.refinements} | result.cause
        if ready.U is None:
            lam = _certain(ready, slacks, result, tolerance, details)
            if result.status != "solved":
                details.setdefault("cause", "rounding: some slack is below zero by more than the tolerance")
            return Answer(
                result.status, lam, data.prepared.recover(lam, load), result.pivots, details=details
            )
        if result.status == "inaccurate":
            return _finished(ready, p, result, tolerance, details)
        lam = _on_support(ready, p, slacks(result.u)[0], result)
        status, residual = kkt_status(data.Q, p, lam, data.Q @ lam - p, tolerance)
        if status == "inaccurate" and result.status == "solved":
            return _finished(ready, p, result, tolerance, details)
        details["kkt_residual_mm"] = residual
        status = "solved" if status == "solved" else result.status
        return Answer(status, lam, None, result.pivots, details=details)


def _finished(
    ready: _Prepared, p: Vector, result: GiResult, tolerance: float, details: dict[str, Any]
) -> Answer:
    """Block pivoting from the final set of the pivots, if rounding in Q⁻¹ made them inaccurate."""
    closed = np.ones(len(p), dtype=bool)
    closed[result.active] = False
    answer = solve_from(closed, ready.problem.Q, p, tolerance)
    details |= {"finishing_sets": answer.iterations, "kkt_residual_mm": answer.details["kkt_residual_mm"]}
    if answer.status == "solved":
        details.pop("cause", None)
    else:
        details |= {"cause": answer.details["cause"]}
    return replace(answer, iterations=result.pivots, details=details)


def _certain(
    ready: _Prepared, slacks: Slacks, result: GiResult, tolerance: float, details: dict[str, Any]
) -> Vector:
    """λ of the primal form; from block pivoting, if slacks within rounding leave the active set in doubt.

    With nearly dependent constraints, an open contact with a slack barely below zero may stand for another
    that is active. λ of the final set of block pivoting is taken if its slacks from the original data are
    no worse.
    """
    s = slacks(result.u)[0]
    closed = np.zeros(len(s), dtype=bool)
    closed[result.active] = True
    if result.status != "solved" or not (s[~closed] < 0).any():
        return result.u
    answer = solve_from(closed, ready.G, -slacks(np.zeros(len(s)))[0], tolerance)
    if answer.lam is None or kkt_residual(answer.lam, slacks(answer.lam)[0]) > kkt_residual(result.u, s):
        return result.u
    details["finishing_sets"] = answer.iterations
    return answer.lam


def _primal_slacks(ready: _Prepared, load: LoadCase) -> Slacks:
    prepared, A = ready.problem.prepared, ready.problem.assembly.A

    def slacks(u: Vector) -> tuple[Vector, Vector]:
        """s = g − Aᵀx with x = K⁻¹(f − Au) refined by δ, and T = |g| + |A|ᵀ(|x| + max|δ|/ε).

        δ, the rounding error of the first solution, estimates that of the refined one.
        """
        b = load.f - A @ u
        x = prepared.assembly.K.solve(b)
        delta = prepared.assembly.K.solve(b - prepared.assembly.K.multiply(x))
        x = x + delta
        return load.g - A.T @ x, abs(load.g) + abs(A).T @ (abs(x) + abs(delta).max() / EPS)

    return slacks


def _dual_slacks(ready: _Prepared, p: Vector) -> Slacks:
    Q, factor = ready.Q, (ready.U, False)

    def slacks(u: Vector) -> tuple[Vector, Vector]:
        """s = λ with Qλ = p + u, refined once.

        εT with T = |Q⁻¹| (|p + u| + |Q| |λ|) bounds the effect of rounding in the residual.
        """
        lam = sla.cho_solve(factor, p + u, check_finite=False)
        lam += sla.cho_solve(factor, p + u - Q @ lam, check_finite=False)
        return lam, abs(ready.G) @ (abs(p + u) + abs(Q) @ abs(lam))

    return slacks


def _on_support(ready: _Prepared, p: Vector, lam: Vector, result: GiResult) -> Vector:
    """λ with λ_C = 0 exactly and Q_SS λ_S = p_S refined on the rest S, so that no rounding of λ_C remains.

    With G = Q⁻¹, Q_SS⁻¹ r_S is v_S − G_SC G_CC⁻¹ v_C for v = G (r_S, 0). Entries that are then negative, at
    contacts closed without a force, move to C.
    """
    C, factor, Q = result.active, result.factor, ready.Q
    while True:
        lam = lam.copy()
        for _ in range(2):
            lam[C] = 0.0
            r = p - Q @ lam
            r[C] = 0.0
            v = sla.cho_solve((ready.U, False), r, check_finite=False)
            u = np.zeros_like(v)
            u[C] = factor.solve(factor.solve_transposed(v[C]))
            lam += v - ready.G @ u
        lam[C] = 0.0
        negative = np.flatnonzero(lam < 0)
        if not negative.size:
            return lam
        for k in negative:
            d = factor.solve_transposed(ready.G[C, k])
            sigma = np.sqrt(max(ready.G[k, k] - d @ d, EPS * ready.G[k, k]))
            factor.extend(d[:, None], np.array([[sigma]]))
            C = np.append(C, k)
