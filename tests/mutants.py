"""The mutants of `mutate_proofs.py`: a file, a text that occurs in it exactly once, and what replaces it.

Each leaves out, halves or weakens a term of a bound. Where a proof changes, its mutants change with it.
"""

from __future__ import annotations

from typing import NamedTuple

CERTIFICATE = "harness/verification/certificate.py"
EXACT = "harness/verification/exact_residual.py"
LENGTH = "harness/verification/length.py"
DEFINITE = "harness/verification/definite.py"
JUDGE = "harness/verification/judge.py"
BASELINE = "harness/verification/baseline.py"
GAP_ERROR = "harness/verification/gap_error.py"
SPARSE_DEFINITE = "harness/verification/sparse_definite.py"
SPARSE_BOUND = "harness/verification/sparse_bound.py"
SLICED = "harness/verification/sliced_forces.py"
AUGMENTED = "harness/verification/augmented.py"
BALANCE = "problems/forms/balance.py"
REFERENCE = "harness/verification/reference.py"
BLOCK = "harness/verification/batched/bound.py"
INDEPENDENCE = "harness/verification/independence.py"
COMPLIANCE = "harness/verification/batched/compliance.py"
RESIDUAL = "harness/verification/batched/residual.py"
ASSESS = "harness/verification/batched/assess.py"
KKT = "solvers/kkt.py"


class Mutant(NamedTuple):
    file: str
    old: str
    new: str


MUTANTS = [
    # ‖e‖ ≤ (‖r‖/√κ + √(sᵀλ))/√κ, and the rounding of x
    Mutant(CERTIFICATE, "(norm / np.sqrt(kappa) + np.sqrt(slack))", "(norm / np.sqrt(kappa))"),
    Mutant(
        CERTIFICATE,
        "(norm / np.sqrt(kappa) + np.sqrt(slack))",
        "(norm / np.sqrt(kappa) + np.sqrt(slack) / 2)",
    ),
    Mutant(CERTIFICATE, "(norm / np.sqrt(kappa) + np.sqrt(slack))", "np.sqrt(slack)"),
    Mutant(
        CERTIFICATE,
        "(norm / np.sqrt(kappa) + np.sqrt(slack))",
        "(norm / np.sqrt(kappa) / 2 + np.sqrt(slack))",
    ),
    Mutant(CERTIFICATE, "(norm / np.sqrt(kappa) + np.sqrt(slack))", "(norm + np.sqrt(slack))"),
    Mutant(CERTIFICATE, "np.sqrt(slack)) / np.sqrt(kappa)", "np.sqrt(slack))"),
    Mutant(CERTIFICATE, "np.sqrt(slack)) / np.sqrt(kappa)", "np.sqrt(slack)) / kappa"),
    Mutant(CERTIFICATE, "at_junction(units * error + abs(x.lo))", "at_junction(units * error)"),
    Mutant(CERTIFICATE, "(units * error + abs(x.lo))", "(units * error + abs(x.lo) / 2)"),
    Mutant(CERTIFICATE, "at_junction(units * error + abs(x.lo))", "at_junction(error + abs(x.lo))"),
    Mutant(CERTIFICATE, "length(units * (abs(r.value) + r.error))", "length(units * abs(r.value))"),
    Mutant(CERTIFICATE, "length(units * (abs(r.value) + r.error))", "length(units * r.error)"),
    Mutant(CERTIFICATE, "length(units * (abs(r.value) + r.error))", "length(units * (r.value + r.error))"),
    Mutant(CERTIFICATE, "length(units * (abs(r.value) + r.error))", "max(units * (abs(r.value) + r.error))"),
    Mutant(CERTIFICATE, "length(units * (abs(r.value) + r.error))", "length(abs(r.value) + r.error)"),
    Mutant(CERTIFICATE, "opening, pressing = s.value + s.error,", "opening, pressing = s.value,"),
    Mutant(CERTIFICATE, "lam.hi + abs(lam.lo)\n    slack", "lam.hi\n    slack"),
    Mutant(CERTIFICATE, " + ETA * np.count_nonzero(opening * (pressing > 0))", ""),
    Mutant(CERTIFICATE, "~(s.value - s.error >= 0)", "~(s.value >= 0)"),
    Mutant(CERTIFICATE, "~(s.value - s.error >= 0)", "s.value - s.error < 0"),
    Mutant(CERTIFICATE, "if not (feasible and kappa > 0):", "if not kappa > 0:"),
    Mutant(CERTIFICATE, "if not (feasible and kappa > 0):", "if not feasible:"),
    Mutant(CERTIFICATE, "np.where(negative, 0.0, lam.hi)", "lam.hi"),
    Mutant(CERTIFICATE, "if not np.isfinite(bound):", "if False:"),
    Mutant(CERTIFICATE, "1.01 * norms * error", "1.01 * error"),
    Mutant(CERTIFICATE, "(np.sqrt(diagonal) * np.sqrt(trace))[single] * error + ", ""),
    Mutant(CERTIFICATE, "error + abs(r.value[single]) +", "error +"),
    # The units of unknowns
    Mutant(CERTIFICATE, "at_junction(units * error + abs(x.lo))", "at_junction(units * (error + abs(x.lo)))"),
    Mutant(CERTIFICATE, "sp.csc_array(sp.diags_array(units) @ A)", "A"),
    Mutant(CERTIFICATE, "scaled = diagonal * units**2", "scaled = diagonal"),
    Mutant(CERTIFICATE, "scaled[rows].sum()", "scaled[rows].max()"),
    # Residuals in twice the working precision
    Mutant(EXACT, "error = U * abs(value) + gamma", "error = gamma"),
    Mutant(EXACT, "error = U * abs(value) + gamma", "error = U / 2 * abs(value) + gamma"),
    Mutant(EXACT, "gamma(self.terms) ** 2 * self.size + ", ""),
    Mutant(EXACT, "gamma(self.terms) ** 2 * self.size", "gamma(self.terms) ** 2 / 2 * self.size"),
    Mutant(EXACT, " * (self.size > 0) + self.error", " * (self.size > 0)"),
    Mutant(EXACT, "self.lo[rows] += rounding", "pass"),
    Mutant(EXACT, "                total.add(rounding, place)\n", ""),
    Mutant(EXACT, "                total.error[place] += 5 * ETA * (factor != 0)\n", ""),
    Mutant(EXACT, "terms + 2 * len(parts) * int(counts.max(initial=0))", "terms"),
    Mutant(EXACT, "terms + 2 * len(parts) * int(counts.max(initial=0))", "2 * int(counts.max(initial=0))"),
    Mutant(EXACT, "scale * (left + 2.0", "scale * (2.0"),
    Mutant(EXACT, "scale * (left + 2.0", "scale * (left / 2 + 2.0"),
    Mutant(EXACT, "(left + 2.0 ** (-K_SLICES * bits) * length + ETA)", "(left + ETA)"),
    Mutant(EXACT, "2.0 ** (-K_SLICES * bits) * length", "2.0 ** (-K_SLICES * bits) / 2 * length"),
    Mutant(EXACT, " + len(products) * n * ETA", ""),
    Mutant(EXACT, "    total.error[rows] += 1.01 * error\n", ""),
    Mutant(EXACT, "np.column_stack([rest, x.lo])", "np.column_stack([rest, 0 * x.lo])"),
    Mutant(EXACT, "np.maximum(np.exp2(exponents[:, 0]), SMALLEST_SCALE)", "np.exp2(exponents[:, 0])"),
    Mutant(LENGTH, "np.linalg.norm(v / scale, axis=0)\n", "np.linalg.norm(v, axis=0) / scale\n"),
    Mutant(LENGTH, " + ETA * (norm > 0)", ""),
    # λmin(K) ≥ s − γ ‖|R|ᵀ|R|‖₂ − u (max(B_ii) + s)
    Mutant(DEFINITE, "gamma(2 * (len(K) + 1)) * _norm(R) + ", ""),
    Mutant(DEFINITE, "gamma(2 * (len(K) + 1))", "gamma(len(K) + 1)"),
    Mutant(DEFINITE, "_norm(R) + U * (largest + abs(s))", "_norm(R)"),
    Mutant(DEFINITE, "U * (largest + abs(s))", "U * abs(s)"),
    Mutant(DEFINITE, "U * (largest + abs(s))", "U * largest"),
    Mutant(DEFINITE, "1.01 * (gamma(2", "1.00 * (gamma(2"),
    Mutant(DEFINITE, "max())\n        R, info", "min())\n        R, info"),
    Mutant(DEFINITE, "if info == 0:", "if True:"),
    Mutant(DEFINITE, "(w / v).max()", "(w / v).min()"),
    Mutant(DEFINITE, "np.abs(R, out=R)", "pass"),
    Mutant(DEFINITE, "if bound >= SMALLEST:", "if bound > 0:"),
    Mutant(
        REFERENCE,
        "min(smallest_eigenvalue(K, estimate) for K, estimate in",
        "min(estimate for _, estimate in",
    ),
    Mutant(REFERENCE, "return min(smallest_eigenvalue(", "return max(smallest_eigenvalue("),
    Mutant(REFERENCE, "if not np.isfinite(proof.bound_mm):", "if False:"),
    # λmin(DKD) of a band
    Mutant(SPARSE_DEFINITE, "gamma(2 * (len(L) + 1)) * _norm(L) + ", ""),
    Mutant(SPARSE_DEFINITE, "gamma(2 * (len(L) + 1))", "gamma(len(band) + 1)"),
    Mutant(SPARSE_DEFINITE, "_norm(L) + U * (largest + abs(s))", "_norm(L)"),
    Mutant(SPARSE_DEFINITE, "U * (largest + abs(s))", "U * abs(s)"),
    Mutant(SPARSE_DEFINITE, "U * (largest + abs(s))", "U * largest"),
    Mutant(SPARSE_DEFINITE, "s - 1.01 * rounding", "s - rounding"),
    Mutant(SPARSE_DEFINITE, "s - 1.01 * rounding", "s"),
    Mutant(SPARSE_DEFINITE, "float(abs(shifted[0]).max())", "float(abs(shifted[0]).min())"),
    Mutant(SPARSE_DEFINITE, "if info == 0:", "if True:"),
    Mutant(SPARSE_DEFINITE, "trans=1), lower=1).max()", "trans=1), lower=1).min()"),
    Mutant(SPARSE_DEFINITE, "np.abs(L, out=L)", "pass"),
    Mutant(SPARSE_DEFINITE, "if bound >= SMALLEST:", "if bound > 0:"),
    Mutant(SPARSE_DEFINITE, "least = min(least, _of_band", "least = max(0, _of_band"),
    Mutant(SPARSE_DEFINITE, "K.data * d[K.indices] * np.repeat(d, np.diff(K.indptr))", "K.data"),
    Mutant(SPARSE_DEFINITE, " * np.repeat(d, np.diff(K.indptr))", ""),
    # The equations of a contact set: no proof rests on them, but a bound that is tight does
    Mutant(AUGMENTED, "self.rho * g - lam_C", "self.rho * g"),
    Mutant(AUGMENTED, "self.rho * (self.A_C.T @ x - g)", "self.rho * (self.A_C.T @ x)"),
    Mutant(AUGMENTED, "x, lam = x + dx, lam + dlam", "pass"),
    Mutant(
        BALANCE,
        "np.log2(np.where(positive, diagonal, 1.0)) / 2",
        "np.log2(np.where(positive, diagonal, 1.0))",
    ),
    Mutant(
        BALANCE, "return np.exp2(np.where(positive, -np.round", "return np.exp2(np.where(positive, np.round"
    ),
    Mutant(BALANCE, "solve(v / D) / D", "solve(v)"),
    # √D (‖r‖/√κ + ‖z‖_K + ‖δ − Aᵀz‖ √(‖K‖/σ²))
    Mutant(BLOCK, "(force / np.sqrt(self.kappa) + distance)", "distance"),
    Mutant(BLOCK, "(force / np.sqrt(self.kappa) + distance)", "(force / np.sqrt(self.kappa) / 2 + distance)"),
    Mutant(BLOCK, "(force / np.sqrt(self.kappa) + distance)", "(force + distance)"),
    Mutant(BLOCK, "(force / np.sqrt(self.kappa) + distance)", "(force / np.sqrt(self.kappa))"),
    Mutant(BLOCK, "(force / np.sqrt(self.kappa) + distance)", "(force / np.sqrt(self.kappa) + distance / 2)"),
    Mutant(BLOCK, "SAFE * np.sqrt(self.compliance) *", "SAFE *"),
    Mutant(BLOCK, "SAFE * np.sqrt(self.compliance) *", "SAFE * self.compliance *"),
    Mutant(BLOCK, "length(abs(r) + error)", "length(abs(r))"),
    Mutant(BLOCK, "length(abs(r) + error)", "length(error)"),
    Mutant(BLOCK, "np.where(closed, -s, np.maximum(-s, 0.0))", "np.maximum(-s, 0.0)"),
    Mutant(BLOCK, "np.where(closed, -s, np.maximum(-s, 0.0))", "np.where(closed, -s, 0.0)"),
    Mutant(BLOCK, "np.where(closed | (s < s_error), s_error, 0.0)", "np.where(closed, s_error, 0.0)"),
    Mutant(BLOCK, "np.where(closed | (s < s_error), s_error, 0.0)", "np.where(s < 0, s_error, 0.0)"),
    Mutant(BLOCK, "if not (self.kappa > 0 and self.sigma2 > 0):", "if not self.sigma2 > 0:"),
    Mutant(BLOCK, "if not (self.kappa > 0 and self.sigma2 > 0):", "if not self.kappa > 0:"),
    Mutant(BLOCK, "np.where(np.isfinite(bounds), bounds, np.inf)", "bounds"),
    Mutant(BLOCK, "scale * np.sqrt(energy) + missed", "missed"),
    Mutant(BLOCK, "scale * np.sqrt(energy) + missed", "scale * np.sqrt(energy) / 2 + missed"),
    Mutant(BLOCK, " + missed * np.sqrt(self.stiffest / self.sigma2)", ""),
    Mutant(BLOCK, "np.sqrt(self.stiffest / self.sigma2)", "np.sqrt(self.stiffest)"),
    Mutant(BLOCK, "np.sqrt(self.stiffest / self.sigma2)", "np.sqrt(1 / self.sigma2)"),
    Mutant(BLOCK, "length(left) + length(rounding) + uncertainty", "length(rounding) + uncertainty"),
    Mutant(BLOCK, "length(left) + length(rounding) + uncertainty", "length(left) + uncertainty"),
    Mutant(BLOCK, "length(left) + length(rounding) + uncertainty", "length(left) + length(rounding)"),
    Mutant(
        BLOCK,
        "length(left) + length(rounding) + uncertainty",
        "length(left) / 2 + length(rounding) + uncertainty",
    ),
    Mutant(
        BLOCK,
        "length(left) + length(rounding) + uncertainty",
        "length(left) + length(rounding) / 2 + uncertainty",
    ),
    Mutant(
        BLOCK,
        "length(left) + length(rounding) + uncertainty",
        "length(left) + length(rounding) + uncertainty / 2",
    ),
    Mutant(BLOCK, "gamma(2 * n) * self.stiffest * size**2 + ", ""),
    Mutant(BLOCK, "gamma(2 * n) * self.stiffest * size**2", "gamma(n) * self.stiffest * size**2"),
    Mutant(BLOCK, "scale = np.exp2(exponent(abs(z).max(axis=0, initial=0.0)))", "scale = 1.0"),
    Mutant(BLOCK, "gamma(depth) * (abs(g) + abs(A).T @ x_size) + depth", "depth"),
    Mutant(BLOCK, "gamma(depth) * (abs(g) + abs(A).T @ x_size)", "gamma(depth) * (abs(A).T @ x_size)"),
    Mutant(BLOCK, "gamma(depth) * (abs(g) + abs(A).T @ x_size)", "gamma(depth) * abs(g)"),
    Mutant(BLOCK, "(abs(g) + abs(A).T @ x_size) + depth * ETA", "(abs(g) + abs(A).T @ x_size)"),
    Mutant(INDEPENDENCE, "sigma2 = least - uncertainty", "sigma2 = least"),
    Mutant(
        INDEPENDENCE, "least = min(least, smallest_eigenvalue(", "least = max(least, smallest_eigenvalue("
    ),
    # max (K⁻¹)_ii ≤ (1 + c/κ) (row + ε ‖X‖_F)²
    Mutant(COMPLIANCE, "SAFE * (1 + relative) * row**2", "SAFE * row**2"),
    Mutant(COMPLIANCE, "SAFE * (1 + relative) * row**2", "SAFE * (1 + relative / 2) * row**2"),
    Mutant(COMPLIANCE, "SAFE * (1 + relative) * row**2", "SAFE * (1 + relative) * row"),
    Mutant(COMPLIANCE, " + epsilon / (1 - epsilon) * length", ""),
    Mutant(COMPLIANCE, "gamma(3 * len(K))", "gamma(len(K))"),
    Mutant(COMPLIANCE, "or epsilon >= 0.5", ""),
    Mutant(COMPLIANCE, "gamma(2 * (len(K) + 1))", "gamma(len(K) + 1)"),
    # The residual of a block
    Mutant(RESIDUAL, "error += gamma(depth) * size + depth * ETA", "error += depth * ETA"),
    Mutant(RESIDUAL, "error += gamma(depth) * size + depth * ETA", "error += gamma(depth) * size"),
    Mutant(RESIDUAL, "abs(f) + abs(A) @ abs(lam)", "abs(f)"),
    Mutant(RESIDUAL, "abs(f) + abs(A) @ abs(lam)", "abs(A) @ abs(lam)"),
    Mutant(RESIDUAL, "gamma(n) * abs(d).max(axis=0) + gamma(1)", "gamma(1)"),
    Mutant(
        RESIDUAL, "gamma(n) * abs(d).max(axis=0) + gamma(1)", "gamma(n) / 2 * abs(d).max(axis=0) + gamma(1)"
    ),
    Mutant(RESIDUAL, "+ gamma(1) * abs(moved.tail).max(axis=0) + ETA", "+ ETA"),
    Mutant(RESIDUAL, "error = error + stiffest * error_of_d", "error = stiffest * error_of_d"),
    Mutant(RESIDUAL, "error + stiffest * error_of_d + gamma", "error + gamma"),
    Mutant(RESIDUAL, " + gamma(1) * (abs(r) + abs(Kd))", ""),
    Mutant(RESIDUAL, " + (n + 1) * ETA\n", "\n"),
    Mutant(RESIDUAL, "(scaled[0] * head_size + scaled[1]", "(scaled[1]"),
    Mutant(RESIDUAL, "(scaled[0] * head_size + scaled[1] * tail_size", "(scaled[0] * head_size"),
    Mutant(RESIDUAL, " + 4 * n * ETA)", ")"),
    # The distance of an answer from the point that the bound is for
    Mutant(ASSESS, "SAFE * (bounds + abs(moved)", "1.0 * (bounds + abs(moved)"),
    Mutant(ASSESS, "(bounds + abs(moved).max(axis=0) + rounding)", "(bounds + rounding)"),
    Mutant(
        ASSESS,
        "(bounds + abs(moved).max(axis=0) + rounding)",
        "(bounds + abs(moved).max(axis=0) / 2 + rounding)",
    ),
    Mutant(ASSESS, "(bounds + abs(moved).max(axis=0) + rounding)", "(bounds + abs(moved).max(axis=0))"),
    Mutant(ASSESS, "(bounds + abs(moved).max(axis=0) + rounding)", "(abs(moved).max(axis=0) + rounding)"),
    Mutant(ASSESS, "bounds = np.where(np.isfinite(bounds), bounds, np.inf)", "pass"),
    Mutant(JUDGE, "REFERENCE_SHARE * limit_mm", "limit_mm"),
    Mutant(JUDGE, "REFERENCE_SHARE * limit_mm", "2 * REFERENCE_SHARE * limit_mm"),
    Mutant(JUDGE, "if not reference.bound_mm <= ", "if reference.bound_mm > "),
    Mutant(JUDGE, "max(np.max(np.abs(force)), np.max(-lam, initial=0.0))", "np.max(np.abs(force))"),
    Mutant(JUDGE, "reference_gap > 2 * limit_mm", "reference_gap > limit_mm"),
    Mutant(BASELINE, "max(errors.get(key, (0.0, 0.0))[0], error)", "error"),
    Mutant(BASELINE, "max(bound_mm, then_bound_mm)", "bound_mm"),
    Mutant(BASELINE, "max(bound_mm, then_bound_mm)", "then_bound_mm"),
    # |ŷ − y| ≤ ‖a‖₁ e + γ_{k+1} (|g| + |a|ᵀ|x|)
    Mutant(GAP_ERROR, "self.norms * error_mm", "error_mm"),
    Mutant(GAP_ERROR, "self.norms * error_mm + rounding", "self.norms * error_mm"),
    Mutant(GAP_ERROR, "self.norms * error_mm + rounding", "rounding"),
    Mutant(GAP_ERROR, "abs(g) + self.size @ abs(x)", "self.size @ abs(x)"),
    Mutant(GAP_ERROR, "abs(g) + self.size @ abs(x)", "abs(g)"),
    Mutant(GAP_ERROR, "abs(assembly.A).T", "assembly.A.T"),
    Mutant(GAP_ERROR, "gamma(k + 2)", "gamma(k)"),
    Mutant(GAP_ERROR, "gamma(k + 2)", "gamma(2)"),
    Mutant(KKT, "max(float((-y).max(initial=0.0)), float(", "max(float("),
    Mutant(KKT, "float(abs(y[lam > 0]).max(initial=0.0))", "0.0"),
    Mutant(KKT, "float(abs(y[lam > 0]).max(initial=0.0))", "float(y[lam > 0].min(initial=0.0))"),
    Mutant(KKT, "(abs(p) + size)", "abs(p)"),
    Mutant(KKT, "(abs(p) + size)", "(abs(Q) @ lam)"),
    Mutant(KKT, "4 * EPS * float((abs(p) + size)", "8 * EPS * float((abs(p) + size)"),
    # D/√κ (‖Dr‖/√κ + ‖δ‖ √(‖DKD‖/σ²)), refined
    Mutant(SPARSE_BOUND, "(force / np.sqrt(self.kappa) + distance)", "distance"),
    Mutant(
        SPARSE_BOUND,
        "(force / np.sqrt(self.kappa) + distance)",
        "(force / np.sqrt(self.kappa) / 2 + distance)",
    ),
    Mutant(SPARSE_BOUND, "(force / np.sqrt(self.kappa) + distance)", "force / np.sqrt(self.kappa)"),
    Mutant(
        SPARSE_BOUND,
        "(force / np.sqrt(self.kappa) + distance)",
        "(force / np.sqrt(self.kappa) + distance / 2)",
    ),
    Mutant(SPARSE_BOUND, "self.D * (abs(r.value) + r.error)", "self.D * abs(r.value)"),
    Mutant(SPARSE_BOUND, "self.D * (abs(r.value) + r.error)", "self.D * r.error"),
    Mutant(
        SPARSE_BOUND,
        "length(self.D * (abs(r.value) + r.error))",
        "length(self.D**2 * (abs(r.value) + r.error))",
    ),
    Mutant(SPARSE_BOUND, "np.sqrt(self.stiffest / self.sigma2)", "np.sqrt(self.stiffest)"),
    Mutant(
        SPARSE_BOUND,
        "np.where(pressing, abs(s.value), np.maximum(-s.value, 0.0))",
        "np.where(pressing, abs(s.value), 0.0)",
    ),
    Mutant(
        SPARSE_BOUND,
        "np.where(pressing, abs(s.value), np.maximum(-s.value, 0.0))",
        "np.maximum(-s.value, 0.0)",
    ),
    Mutant(SPARSE_BOUND, "+ s.error * (", "+ 0 * s.error * ("),
    Mutant(
        SPARSE_BOUND,
        "at_junction(self.D) * error + abs(at_junction(state.x.lo))",
        "at_junction(self.D) * error",
    ),
    Mutant(SPARSE_BOUND, "at_junction(self.D) * error", "error"),
    Mutant(SPARSE_BOUND, " & ~(state.lam.hi < 0).any(axis=0)", ""),
    Mutant(SPARSE_BOUND, "self.bound.stiffness[rows] * most + of_force[rows]", "of_force[rows]"),
    Mutant(
        SPARSE_BOUND,
        "self.bound.stiffness[rows] * most + of_force[rows]",
        "self.bound.stiffness[rows] * most",
    ),
    # f − Kx − Aλ by slices: of them all, and in their bits
    Mutant(SLICED, "np.hstack([x1, x2, x3])", "np.hstack([x1, x2, 0 * x3])"),
    Mutant(SLICED, "np.hstack([x1, after])", "np.hstack([x1, x2])"),
    Mutant(SLICED, "terms.append(part @ x.hi)", "pass"),
    Mutant(SLICED, "// 2 + 1\n    top", "// 2 + 3\n    top"),
    Mutant(SLICED, "x3, after = x3 + x.lo, after + x.lo", "pass"),
    Mutant(SLICED, "rounding + of_K3 * most_lo + 8", "8"),
]

#: Which tests must fail.
TESTS = {
    CERTIFICATE: ("terms_certificate", "terms_residual", "sparse_terms"),
    EXACT: ("terms_residual", "exact_residual"),
    LENGTH: ("terms_residual",),
    DEFINITE: ("terms_definite",),
    SPARSE_DEFINITE: ("sparse_terms", "sparse_certificate"),
    SPARSE_BOUND: ("terms_sparse",),
    SLICED: ("sliced_forces",),
    AUGMENTED: ("sparse_terms", "sparse_certificate"),
    BALANCE: ("sparse_terms", "sparse_certificate"),
    REFERENCE: ("terms_verdict",),
    BLOCK: ("terms_batched",),
    INDEPENDENCE: ("terms_batched",),
    COMPLIANCE: ("terms_batched",),
    RESIDUAL: ("terms_batched", "series_bound"),
    ASSESS: ("terms_batched",),
    JUDGE: ("terms_verdict", "harness_judge"),
    BASELINE: ("gate_baseline",),
    GAP_ERROR: ("allowed_gap",),
    KKT: ("terms_verdict",),
}
