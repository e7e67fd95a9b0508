"""The mutants of `mutate_proofs.py`: a file, a text that occurs in it exactly once, and what replaces it.

Each leaves out, halves or weakens a term of a bound. Where a proof changes, its mutants change with it.
"""

from typing import NamedTuple

ENCLOSURE = "harness/verification/enclosure.py"
BALANCED = "harness/verification/balanced.py"
PROOF = "harness/verification/proof.py"
NEAR = "harness/verification/near.py"
ASSESS = "harness/verification/assess.py"
DEFINITE = "harness/verification/definite.py"
REFERENCE = "harness/verification/reference.py"
BASELINE = "harness/verification/baseline.py"
GAP_ERROR = "harness/verification/gap_error.py"
JUDGE = "harness/verification/judge.py"
DENSE = "problems/stiffness/dense.py"
BANDED = "problems/stiffness/banded.py"
BALANCE = "problems/stiffness/balance.py"
KKT = "solvers/kkt.py"


class Mutant(NamedTuple):
    file: str
    old: str
    new: str


MUTANTS = [
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
    # f − Kx − Aλ by slices, and what is rounded of it
    Mutant(ENCLOSURE, "SAFE * (U * abs(value) + self.error)", "SAFE * self.error"),
    Mutant(ENCLOSURE, "SAFE * (U * abs(value) + self.error)", "SAFE * (U / 2 * abs(value) + self.error)"),
    Mutant(ENCLOSURE, "SAFE * (U * abs(value) + self.error)", "SAFE * (U * abs(value))"),
    Mutant(ENCLOSURE, "lost + (error - rest)", "lost - rest"),
    Mutant(ENCLOSURE, "lost + (error - rest)", "error - rest"),
    Mutant(ENCLOSURE, "lost + (error - rest)", "lost + error"),
    Mutant(ENCLOSURE, "np.log2(2 * longest)", "np.log2(longest)"),
    Mutant(ENCLOSURE, "else np.array(error)", "else 0 * error"),
    Mutant(ENCLOSURE, "self.lo[rows] -= panel @ x[columns]", "pass"),
    Mutant(ENCLOSURE, "gamma(longest + MORE) * most, ETA", "0 * most, ETA"),
    Mutant(ENCLOSURE, "most, ETA * (1 + most) * (most > 0)", "most, 0 * most"),
    Mutant(ENCLOSURE, "abs(panel).sum(axis=1), _count", "panel.sum(axis=1), _count"),
    Mutant(ENCLOSURE, "ETA * (value != 0)", "0.0 * value"),
    Mutant(ENCLOSURE, "rounding * most3 + again * most", "rounding * most3"),
    Mutant(ENCLOSURE, "rounding * most3 + again * most", "again * most"),
    Mutant(ENCLOSURE, "again * most, rounding * most_after", "again * most, 0 * most_after"),
    Mutant(ENCLOSURE, "rounding * most_after, rounding * most\n", "rounding * most_after, 0 * most\n"),
    Mutant(ENCLOSURE, ", 8 * ETA * (1 + most) * (most > 0)", ", 0 * most"),
    Mutant(ENCLOSURE, "8 * ETA * (1 + most) * (most > 0)", "8 * ETA * (1 + most)"),
    Mutant(ENCLOSURE, "self.error[rows] += np.hstack", "_ = np.hstack"),
    Mutant(ENCLOSURE, "rounding * most_after, rounding * most, 0", "0 * most, rounding * most, 0"),
    Mutant(ENCLOSURE, "most_after, rounding * most, 0 * most", "most_after, 0 * most, 0 * most"),
    Mutant(ENCLOSURE, "rest = rest + _with(panel, beyond) @ x1[columns]", "pass"),
    Mutant(ENCLOSURE, "_with(panel, entries) @ after[columns]", "_with(panel, beyond) @ after[columns]"),
    Mutant(ENCLOSURE, "// 2 + 1\n        unit", "// 2 + 3\n        unit"),
    Mutant(ENCLOSURE, "x3, after = x3 + lo, after + lo", "pass"),
    Mutant(ENCLOSURE, "rest = rest + _with(panel, M3) @ hi[columns]", "pass"),
    Mutant(ENCLOSURE, "rest + second[:, k:]", "rest"),
    Mutant(ENCLOSURE, "small + second[:, :k]", "small"),
    Mutant(ENCLOSURE, "first[:, k : 2 * k], first[:, 2 * k :]", "first[:, k : 2 * k], 0.0"),
    Mutant(ENCLOSURE, "two_sum(value, -small)", "two_sum(value, 0 * small)"),
    Mutant(ENCLOSURE, "np.where(size > 0, unit, unit[size > 0].min(initial=1.0))", "unit * 0 + 1.0"),
    Mutant(ENCLOSURE, "norm = np.linalg.norm(v / scale, axis=0)", "norm = np.linalg.norm(v, axis=0) / scale"),
    Mutant(ENCLOSURE, " + ETA * (norm > 0)", ""),
    # The units: D and R once, and all of K's and A's rows in them
    Mutant(BALANCED, "panel * D[columns] * D[rows, None]", "panel * D[rows, None]"),
    Mutant(BALANCED, "panel.data * D[columns][panel.indices] * np.repeat", "panel.data * np.repeat"),
    Mutant(BALANCED, " * np.repeat(D[rows], np.diff(panel.indptr))", ""),
    Mutant(BALANCED, "self.D * both.f", "both.f"),
    Mutant(BALANCED, "self.R * both.g", "both.g"),
    Mutant(
        BALANCED,
        "float((self.assembly.K.absolute_sums(D) * D).max(initial=0.0))",
        "float(self.assembly.K.absolute_sums(D).max(initial=0.0))",
    ),
    Mutant(BALANCED, "np.concatenate([r.error, s.error])", "np.concatenate([0 * r.error, s.error])"),
    Mutant(BALANCED, "np.concatenate([r.error, s.error])", "np.concatenate([r.error, 0 * s.error])"),
    Mutant(BALANCED, "total.subtract_small(row_panels(self.A), _longest(self.A), dlam)", "pass"),
    Mutant(BALANCED, "row_panels(self.A), _longest(self.A), lam", "row_panels(self.A), 1, lam"),
    Mutant(BALANCED, "w = z / scale", "w, scale = z, 1.0"),
    Mutant(BALANCED, "found += gamma(2 * len(z)) * self.stiffest * length(w) ** 2", "pass"),
    Mutant(BALANCED, "gamma(2 * len(z)) * self.stiffest", "gamma(2 * len(z))"),
    Mutant(BALANCED, "self.D * self.assembly.K.multiply(self.D * w)", "self.assembly.K.multiply(w)"),
    # Translations, and what they save
    Mutant(PROOF, "np.sqrt(self.kappa) + distance + missed", "np.sqrt(self.kappa) + missed"),
    Mutant(PROOF, "+ distance + missed * stretch)", "+ distance)"),
    Mutant(PROOF, "np.minimum(reach, np.sqrt(self.compliance))", "np.sqrt(self.compliance)"),
    Mutant(PROOF, "np.minimum(reach, np.sqrt(self.compliance))", "np.minimum(reach, self.compliance)"),
    Mutant(PROOF, "uncertain + SAFE * rounding, units", "uncertain, units"),
    Mutant(PROOF, "uncertain + SAFE * rounding, units", "SAFE * rounding, units"),
    Mutant(PROOF, "(abs(delta) + abs(units.At) @ abs(z))", "abs(delta)"),
    Mutant(PROOF, " + roundings * ETA * z.any(axis=0)", ""),
    Mutant(DENSE, "(1 + relative) * row**2", "row**2"),
    Mutant(DENSE, "(1 + relative) * row**2", "(1 + relative / 2) * row**2"),
    Mutant(DENSE, "(1 + relative) * row**2", "(1 + relative) * row"),
    Mutant(DENSE, " + epsilon / (1 - epsilon) * length", ""),
    Mutant(DENSE, "gamma(3 * self.size)", "gamma(self.size)"),
    Mutant(DENSE, " or not epsilon < 0.5", ""),
    Mutant(DENSE, "D**2 @ self.diagonal()", "self.diagonal().sum()"),
    Mutant(DENSE, "error = gamma(2 * (self.size + 1))\n", "error = gamma(self.size + 1)\n"),
    # D/√κ ( ‖r‖/√κ + ‖δ‖ √(‖K‖/σ²) ), and the rounding of x
    Mutant(PROOF, "np.where(pressing, -s.value, np.maximum(-s.value, 0.0))", "np.maximum(-s.value, 0.0)"),
    Mutant(
        PROOF,
        "np.where(pressing, -s.value, np.maximum(-s.value, 0.0))",
        "np.where(pressing, -s.value, 0.0)",
    ),
    Mutant(PROOF, "s.error * (pressing | (s.value < s.error))", "s.error * pressing"),
    Mutant(PROOF, "s.error * (pressing | (s.value < s.error))", "s.error * (s.value < 0)"),
    Mutant(PROOF, "s.error * (pressing | (s.value < s.error))", "0.0"),
    Mutant(PROOF, "length(abs(r.value) + r.error)", "length(abs(r.value))"),
    Mutant(PROOF, "length(abs(r.value) + r.error)", "length(r.error)"),
    Mutant(PROOF, "length(abs(r.value) + r.error)", "abs(r.value + r.error).max(axis=0)"),
    Mutant(
        PROOF,
        "(force / np.sqrt(self.kappa) + distance + missed * stretch)",
        "(force + distance + missed * stretch)",
    ),
    Mutant(
        PROOF,
        "reach, distance = D / np.sqrt(self.kappa), np",
        "reach, distance = D, np",
    ),
    Mutant(
        PROOF,
        "(force / np.sqrt(self.kappa) + distance + missed * stretch)",
        "(force / np.sqrt(self.kappa) / 2 + distance + missed * stretch)",
    ),
    Mutant(
        PROOF,
        "(force / np.sqrt(self.kappa) + distance + missed * stretch)",
        "(force / np.sqrt(self.kappa) + distance + missed * stretch / 2)",
    ),
    Mutant(
        PROOF,
        "(force / np.sqrt(self.kappa) + distance + missed * stretch)",
        "(force / np.sqrt(self.kappa))",
    ),
    Mutant(
        PROOF,
        "(force / np.sqrt(self.kappa) + distance + missed * stretch)",
        "(distance + missed * stretch)",
    ),
    Mutant(
        PROOF,
        "np.sqrt(np.divide(units.stiffest, units.sigma2)) if missed",
        "np.sqrt(units.stiffest) if missed",
    ),
    Mutant(
        PROOF,
        "np.sqrt(np.divide(units.stiffest, units.sigma2)) if missed",
        "np.sqrt(np.divide(1.0, units.sigma2)) if missed",
    ),
    Mutant(
        PROOF,
        "np.sqrt(np.divide(units.stiffest, units.sigma2)) if missed",
        "np.divide(units.stiffest, units.sigma2) if missed",
    ),
    Mutant(PROOF, "(reach * error + D * lo)", "(reach * error)"),
    Mutant(PROOF, "(reach * error + D * lo)", "(reach * error + D * lo / 2)"),
    Mutant(PROOF, "(reach * error + D * lo)", "(reach * error + lo)"),
    Mutant(PROOF, " + ETA * x.hi.any(axis=0)", ""),
    Mutant(PROOF, " & ~(lam.hi < 0).any(axis=0)", ""),
    Mutant(PROOF, "np.where(valid, bounds, np.inf), (D", "bounds, (D"),
    # Refinement: no proof rests on it, but a bound that is tight does
    Mutant(PROOF, "-(y + units.At @ w), 0.0)", "-y, 0.0)"),
    Mutant(PROOF, "not (bounds[column] <= enough[column]", "not (False"),
    Mutant(PROOF, "dlam = np.maximum(dlam, -lam2.hi)", "pass"),
    Mutant(NEAR, "C = C & ~negative", "C = C"),
    Mutant(NEAR, "u - near.product(t * near.R)", "u"),
    Mutant(NEAR, "(v / self.R)[self.M.order]", "v[self.M.order]"),
    Mutant(NEAR, "0.0, u - lam) * near.R", "0.0, u - lam)"),
    # The distance of an answer from the proven one
    Mutant(ASSESS, "SAFE * near + ", ""),
    Mutant(ASSESS, "SAFE * near + (1 + 4 * U) * away", "SAFE * near"),
    Mutant(ASSESS, "(1 + 4 * U) * away", "away"),
    Mutant(ASSESS, "np.where(np.isfinite(bounds), bounds, np.inf)", "bounds"),
    # λmin(DKD) ≥ s − the backward error of a factorisation
    Mutant(DEFINITE, "return float(s - SAFE * away)", "return float(s)"),
    Mutant(DEFINITE, "return float(s - SAFE * away)", "return float(s - away / 2)"),
    Mutant(DEFINITE, ">= SMALLEST:\n            return", ">= 0:\n            return"),
    Mutant(DEFINITE, "away is not None and", "away is None or"),
    Mutant(DEFINITE, "return min((_of_block", "return max((_of_block"),
    Mutant(
        DEFINITE,
        "sigma2 = found - SAFE * gamma(longest + 1) * float((size.T @ (size @ ones)).max())",
        "sigma2 = found",
    ),
    Mutant(DEFINITE, "return sigma2 if sigma2 >= SMALLEST else 0.0", "return sigma2"),
    Mutant(REFERENCE, "[ESTIMATED * about for about in", "[4 * ESTIMATED * about for about in"),
    Mutant(DENSE, "gamma(2 * (self.size + 1)) * _norm(R) + ", ""),
    Mutant(DENSE, "return gamma(2 * (self.size + 1))", "return gamma(self.size + 1)"),
    Mutant(DENSE, "_norm(R) + ROUNDING * (largest + abs(s))", "_norm(R)"),
    Mutant(DENSE, "ROUNDING * (largest + abs(s))", "ROUNDING * abs(s)"),
    Mutant(DENSE, "ROUNDING * (largest + abs(s))", "ROUNDING * largest"),
    Mutant(BANDED, "gamma(2 * (len(L) + 1)) * _norm(L) + ", ""),
    Mutant(BANDED, "gamma(2 * (len(L) + 1))", "gamma(len(L) + 1)"),
    Mutant(BANDED, "_norm(L) + U * (largest + abs(s))", "_norm(L)"),
    Mutant(BANDED, "U * (largest + abs(s))", "U * abs(s)"),
    Mutant(BANDED, "U * (largest + abs(s))", "U * largest"),
    Mutant(DENSE, "(w / v).max()", "(w / v).min()"),
    Mutant(DENSE, "np.abs(R, out=R)", "pass"),
    Mutant(BANDED, "np.abs(L, out=L)", "pass"),
    Mutant(BANDED, "trans=1), lower=1).max()", "trans=1), lower=1).min()"),
    Mutant(DENSE, "    if info:\n            return None\n        largest", "    largest"),
    Mutant(BANDED, "return None if info else ", "return "),
    Mutant(
        BALANCE, "np.sqrt(np.where(diagonal > 0, diagonal, 1.0))", "np.where(diagonal > 0, diagonal, 1.0)"
    ),
    Mutant(BALANCE, "solve(v / D) / D", "solve(v)"),
    # Verdicts
    Mutant(JUDGE, "REFERENCE_SHARE * limit_mm", "limit_mm"),
    Mutant(JUDGE, "REFERENCE_SHARE * limit_mm", "2 * REFERENCE_SHARE * limit_mm"),
    Mutant(JUDGE, "if not reference.bound_mm <= ", "if reference.bound_mm > "),
    Mutant(KKT, "max(float((-y).max(initial=0.0)), float(", "max(float("),
    Mutant(KKT, "float(abs(y[lam > 0]).max(initial=0.0))", "0.0"),
    Mutant(KKT, "float(abs(y[lam > 0]).max(initial=0.0))", "float(y[lam > 0].min(initial=0.0))"),
    Mutant(KKT, "(abs(p) + abs(Q) @ lam)", "abs(p)"),
    Mutant(KKT, "(abs(p) + abs(Q) @ lam)", "(abs(Q) @ lam)"),
    Mutant(KKT, "4 * EPS * float((abs(p) + abs(Q) @ lam)", "8 * EPS * float((abs(p) + abs(Q) @ lam)"),
]


#: Which tests must fail.
TESTS = {
    ENCLOSURE: ("proofs/test_enclosure.py",),
    BASELINE: ("harness/test_gate_baseline.py",),
    GAP_ERROR: ("harness/test_allowed_gap.py",),
    BALANCED: ("proofs/test_enclosure.py", "proofs/test_proof.py"),
    PROOF: ("proofs/test_proof.py",),
    NEAR: ("proofs/test_proof.py",),
    ASSESS: ("proofs/test_proof.py",),
    DEFINITE: ("proofs/test_definite.py",),
    REFERENCE: ("proofs/test_terms_verdict.py",),
    JUDGE: ("proofs/test_terms_verdict.py", "harness/test_judge.py"),
    DENSE: ("proofs/test_definite.py",),
    BANDED: ("proofs/test_definite.py",),
    BALANCE: ("proofs/test_definite.py", "proofs/test_proof.py"),
    KKT: ("proofs/test_terms_verdict.py",),
}
