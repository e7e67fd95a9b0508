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
DENSE = "problems/stiffness/dense.py"
BANDED = "problems/stiffness/banded.py"
STIFFNESS_BLOCK = "problems/stiffness/block.py"
SPARSE_BOUND = "harness/verification/sparse_bound.py"
SLICED = "harness/verification/sliced_forces.py"
AUGMENTED = "harness/verification/augmented.py"
BALANCE = "problems/stiffness/balance.py"
REFERENCE = "harness/verification/reference.py"
BLOCK = "harness/verification/batched/bound.py"
INDEPENDENCE = "harness/verification/independence.py"
COMPLIANCE = "harness/verification/batched/compliance.py"
RESIDUAL = "harness/verification/batched/residual.py"
ASSESS = "harness/verification/batched/assess.py"
KKT = "solvers/kkt.py"
ALTERATION = "problems/forms/alteration.py"
READ = "problems/input/user_matrices.py"


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
    Mutant(CERTIFICATE, " - 1.01 * float(units.max()) ** 2 * assembly.altered.norm_K", ""),
    Mutant(CERTIFICATE, "1.01 * norms * error", "1.01 * error"),
    Mutant(CERTIFICATE, "(np.sqrt(diagonal) * np.sqrt(trace))[single] * error + ", ""),
    Mutant(CERTIFICATE, "error + abs(r.value[single]) +", "error +"),
    # The units of unknowns
    Mutant(CERTIFICATE, "at_junction(units * error + abs(x.lo))", "at_junction(units * (error + abs(x.lo)))"),
    Mutant(CERTIFICATE, "float(units.max()) ** 2 *", "float(units.max()) *"),
    Mutant(CERTIFICATE, "float(units.max()) ** 2 *", "float(units.min()) ** 2 *"),
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
    Mutant(
        EXACT, "        total.error += assembly.altered.of_forces(_size(x), _size(lam))\n", "        pass\n"
    ),
    Mutant(EXACT, "        total.error += assembly.altered.of_gaps(_size(x))\n", "        pass\n"),
    Mutant(LENGTH, "np.linalg.norm(v / scale, axis=0)\n", "np.linalg.norm(v, axis=0) / scale\n"),
    Mutant(LENGTH, " + ETA * (norm > 0)", ""),
    # λmin(K) ≥ s − γ ‖|R|ᵀ|R|‖₂ − u (max(B_ii) + s)
    Mutant(DENSE, "gamma(2 * (self.size + 1)) * _norm(R) + ", ""),
    Mutant(DENSE, "gamma(2 * (self.size + 1))", "gamma(self.size + 1)"),
    Mutant(DENSE, "_norm(R) + ROUNDING * (largest + abs(s))", "_norm(R)"),
    Mutant(DENSE, "ROUNDING * (largest + abs(s))", "ROUNDING * abs(s)"),
    Mutant(DENSE, "ROUNDING * (largest + abs(s))", "ROUNDING * largest"),
    Mutant(DENSE, "float(abs(diagonal).max())", "float(abs(diagonal).min())"),
    Mutant(DENSE, "clean=False)\n        if info:", "clean=False)\n        if False:"),
    Mutant(DENSE, "(w / v).max()", "(w / v).min()"),
    Mutant(DENSE, "np.abs(R, out=R)", "pass"),
    Mutant(DENSE, "            B *= D[:, None]\n", ""),
    Mutant(DEFINITE, "least = min(least, s - SAFE * error)", "least = min(least, s - error)"),
    Mutant(DEFINITE, "least = min(least, s - SAFE * error)", "least = min(least, s)"),
    Mutant(DEFINITE, "least = min(least, ", "least = max(least % 1e308, "),
    Mutant(DEFINITE, "s - SAFE * error >= SMALLEST:", "s - SAFE * error > 0:"),
    Mutant(DEFINITE, "block.shifted(D[rows], s)", "block.shifted(0 * D[rows] + 1, s)"),
    Mutant(REFERENCE, "if not np.isfinite(proof.bound_mm):", "if False:"),
    # λmin(DKD) of a band
    Mutant(BANDED, "gamma(2 * (len(L) + 1)) * _norm(L) + ", ""),
    Mutant(BANDED, "gamma(2 * (len(L) + 1))", "gamma(len(L) + 1)"),
    Mutant(BANDED, "_norm(L) + U * (largest + abs(s))", "_norm(L)"),
    Mutant(BANDED, "U * (largest + abs(s))", "U * abs(s)"),
    Mutant(BANDED, "U * (largest + abs(s))", "U * largest"),
    Mutant(BANDED, "float(abs(band[0]).max())", "float(abs(band[0]).min())"),
    Mutant(BANDED, "return None if info else gamma", "return gamma"),
    Mutant(BANDED, "trans=1), lower=1).max()", "trans=1), lower=1).min()"),
    Mutant(BANDED, "np.abs(L, out=L)", "pass"),
    Mutant(STIFFNESS_BLOCK, "M.data * rows[M.indices] * np.repeat(columns, np.diff(M.indptr))", "M.data"),
    Mutant(STIFFNESS_BLOCK, " * np.repeat(columns, np.diff(M.indptr))", ""),
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
    Mutant(BLOCK, " + distance) / certain", " + distance)"),
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
    Mutant(BLOCK, "outer(assembly.altered.A_columns, abs(z)", "outer(0 * assembly.altered.A_columns, abs(z)"),
    Mutant(BLOCK, "gamma(depth) * (abs(g) + abs(A).T @ x_size) + depth", "depth"),
    Mutant(BLOCK, "gamma(depth) * (abs(g) + abs(A).T @ x_size)", "gamma(depth) * (abs(A).T @ x_size)"),
    Mutant(BLOCK, "gamma(depth) * (abs(g) + abs(A).T @ x_size)", "gamma(depth) * abs(g)"),
    Mutant(BLOCK, "(abs(g) + abs(A).T @ x_size) + depth * ETA", "(abs(g) + abs(A).T @ x_size)"),
    Mutant(BLOCK, "        error = error + assembly.altered.of_gaps(x_size)\n", "        pass\n"),
    Mutant(INDEPENDENCE, "sigma2 = least - uncertainty", "sigma2 = least"),
    Mutant(INDEPENDENCE, "least = min(least, _least(", "least = max(least, _least("),
    Mutant(
        INDEPENDENCE,
        "        sigma2 -= 2 * SAFE * np.sqrt(sigma2) * assembly.altered.norm_A\n",
        "        pass\n",
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
    Mutant(
        RESIDUAL, "        error += assembly.altered.of_forces(", "        1 * assembly.altered.of_forces("
    ),
    Mutant(RESIDUAL, "gamma(n) * abs(d).max(axis=0) + gamma(1)", "gamma(1)"),
    Mutant(
        RESIDUAL, "gamma(n) * abs(d).max(axis=0) + gamma(1)", "gamma(n) / 2 * abs(d).max(axis=0) + gamma(1)"
    ),
    Mutant(RESIDUAL, "+ gamma(1) * abs(moved.tail).max(axis=0) + ETA", "+ ETA"),
    Mutant(RESIDUAL, "error = error + stiffest * error_of_d", "error = stiffest * error_of_d"),
    Mutant(RESIDUAL, "error + stiffest * error_of_d + gamma", "error + gamma"),
    Mutant(RESIDUAL, " + gamma(1) * (abs(r) + abs(Kd))", ""),
    Mutant(RESIDUAL, " + (n + 1) * ETA\n", "\n"),
    Mutant(RESIDUAL, "outer(assembly.altered.K,", "outer(0 * assembly.altered.K,"),
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
    Mutant(KKT, "max(float((-y).max(initial=0.0)), float(", "max(float("),
    Mutant(KKT, "float(abs(y[lam > 0]).max(initial=0.0))", "0.0"),
    Mutant(KKT, "float(abs(y[lam > 0]).max(initial=0.0))", "float(y[lam > 0].min(initial=0.0))"),
    Mutant(KKT, "(abs(p) + size)", "abs(p)"),
    Mutant(KKT, "(abs(p) + size)", "(abs(Q) @ lam)"),
    Mutant(KKT, "4 * EPS * float((abs(p) + size)", "8 * EPS * float((abs(p) + size)"),
    # What reading has altered
    Mutant(ALTERATION, "outer(self.f, np.ones_like(x_size)) + ", ""),
    Mutant(ALTERATION, " + outer(self.K, x_size)", ""),
    Mutant(ALTERATION, " + outer(self.A_rows, lam_size)", ""),
    Mutant(ALTERATION, "outer(self.g, np.ones_like(x_size)) +", "outer(0 * self.g, np.ones_like(x_size)) +"),
    Mutant(ALTERATION, " + np.multiply.outer(self.A_columns, x_size)", ""),
    Mutant(ALTERATION, "max(self.A_rows.max(initial=0.0), ", "max("),
    Mutant(ALTERATION, ", self.A_columns.max(initial=0.0))", ", 0.0)"),
    Mutant(READ, "off_K + abs(K - given)", "abs(K - given)"),
    Mutant(READ, "off_K + abs(K - given)", "off_K"),
    Mutant(READ, "lost[~same] = U * abs(rounded[~same])", "lost[~same] = U / 4 * abs(rounded[~same])"),
    Mutant(READ, "off + 2 * U * count.multiply(size)", "off"),
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
    CERTIFICATE: ("terms_certificate", "terms_residual", "sparse_terms", "altered"),
    EXACT: ("terms_residual", "altered", "exact_residual"),
    LENGTH: ("terms_residual",),
    DEFINITE: ("terms_definite", "sparse_terms", "sparse_certificate"),
    DENSE: ("terms_definite", "sparse_terms", "certificate"),
    BANDED: ("terms_definite", "sparse_certificate"),
    STIFFNESS_BLOCK: ("sparse_terms", "sparse_certificate"),
    SPARSE_BOUND: ("terms_sparse",),
    SLICED: ("sliced_forces",),
    AUGMENTED: ("sparse_terms", "sparse_certificate"),
    BALANCE: ("sparse_terms", "sparse_certificate"),
    REFERENCE: ("terms_verdict", "altered"),
    BLOCK: ("terms_batched", "altered"),
    INDEPENDENCE: ("terms_batched", "altered"),
    COMPLIANCE: ("terms_batched",),
    RESIDUAL: ("terms_batched", "altered", "series_bound"),
    ASSESS: ("terms_batched",),
    JUDGE: ("terms_verdict", "harness_judge"),
    KKT: ("terms_verdict",),
    ALTERATION: ("altered",),
    READ: ("altered",),
}
