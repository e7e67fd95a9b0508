"""The mutants of `mutate_proofs.py`: a text that occurs in a file exactly once, and what replaces it in turn.

Each leaves out, halves or weakens a term of a bound. Where a proof changes, its mutants change with it.
"""

from typing import NamedTuple


class Mutant(NamedTuple):
    file: str
    old: str
    new: str


#: By file.
CHANGES: dict[str, dict[str, tuple[str, ...]]] = {
    "harness/verification/judge.py": {
        "max(np.max(np.abs(force)), np.max(-lam, initial=0.0))": ("np.max(np.abs(force))",),
        "reference_gap > 2 * limit_mm": ("reference_gap > limit_mm",),
        "REFERENCE_SHARE * limit_mm": ("limit_mm", "2 * REFERENCE_SHARE * limit_mm"),
        "if not reference.bound_mm <= ": ("if reference.bound_mm > ",),
    },
    "harness/verification/findings.py": {
        "max(errors.get(key, (0.0, 0.0))[0], error)": ("error",),
        "max(bound_mm, then_bound_mm)": ("bound_mm", "then_bound_mm"),
    },
    "harness/verification/slowdown.py": {
        'lines["ratio"] / lines["ratio_other"]': ('lines["ratio"]',),
        'lines["ratio_least"] > lines["ratio_most_other"]': (
            'lines["ratio_least"] > 1',
            'lines["ratio"] > lines["ratio_most_other"]',
            'lines["ratio_least"] > lines["ratio_other"]',
        ),
        "(limit < S)": ("(S > 1)",),
        ".min(axis=1) >= ENOUGH": (".min(axis=1) >= 1",),
    },
    "harness/verification/enclosure.py": {
        "SAFE * (U * abs(value) + self.error)": (
            "SAFE * self.error",
            "SAFE * (U / 2 * abs(value) + self.error)",
            "SAFE * (U * abs(value))",
        ),
        "lost + (error - rest)": ("lost - rest", "error - rest", "lost + error"),
        "np.log2(2 * longest)": ("np.log2(longest)",),
        "else np.array(error)": ("else 0 * error",),
        "self.lo[rows] -= panel @ x[columns]": ("pass",),
        "gamma(longest + MORE) * most, ETA": ("0 * most, ETA",),
        "most, ETA * (1 + most) * (most > 0)": ("most, 0 * most",),
        "abs(panel).sum(axis=1), _count": ("panel.sum(axis=1), _count",),
        "ETA * (value != 0)": ("0.0 * value",),
        "rounding * most3 + again * most": ("rounding * most3", "again * most"),
        "again * most, rounding * most_after": ("again * most, 0 * most_after",),
        "rounding * most_after, rounding * most\n": ("rounding * most_after, 0 * most\n",),
        ", 8 * ETA * (1 + most) * (most > 0)": (", 0 * most",),
        "8 * ETA * (1 + most) * (most > 0)": ("8 * ETA * (1 + most)",),
        "self.error[rows] += of_rows": ("_ = of_rows",),
        "rounding * most_after, rounding * most, 0": ("0 * most, rounding * most, 0",),
        "most_after, rounding * most, 0 * most": ("most_after, 0 * most, 0 * most",),
        " + _times(panel, beyond, x1[columns])": ("",),
        "_times(panel, entries, after[columns])": ("_times(panel, beyond, after[columns])",),
        "// 2 + 1\n        unit": ("// 2 + 3\n        unit",),
        "x3, after = x3 + lo, after + lo": ("pass",),
        "rest = rest + _times(panel, M3, hi[columns])": ("pass",),
        "@ x[start : start + WIDTH]": ("@ x[:WIDTH]",),
        "WIDTH + -(-longest // WIDTH)": ("WIDTH",),
        "of_sparse if sp.issparse(panel) else of_dense": ("of_dense",),
        "rest + second[:, k:]": ("rest",),
        "small + second[:, :k]": ("small",),
        "first[:, k : 2 * k], first[:, 2 * k :]": ("first[:, k : 2 * k], 0.0",),
        "two_sum(value, -small)": ("two_sum(value, 0 * small)",),
        "np.where(size > 0, unit, unit[size > 0].min(initial=1.0))": ("unit * 0 + 1.0",),
        "norm = np.linalg.norm(v / scale, axis=0)": ("norm = np.linalg.norm(v, axis=0) / scale",),
        " + ETA * (norm > 0)": ("",),
    },
    "harness/verification/balanced_units.py": {
        "entries = panel * D[columns]": ("entries = panel * 1.0",),
        "entries *= D[rows, None]": ("pass",),
        "panel.data * D[columns][panel.indices] * np.repeat": ("panel.data * np.repeat",),
        " * np.repeat(D[rows], np.diff(panel.indptr))": ("",),
        "self.D * both.f": ("both.f",),
        "self.R * both.g": ("both.g",),
        "float((self.assembly.K.absolute_sums(D) * D).max(initial=0.0))": (
            "float(self.assembly.K.absolute_sums(D).max(initial=0.0))",
        ),
        "np.concatenate([r.error, s.error])": (
            "np.concatenate([0 * r.error, s.error])",
            "np.concatenate([r.error, 0 * s.error])",
        ),
        "total.subtract_small(row_panels(self.A), _longest(self.A), dlam)": ("pass",),
        "row_panels(self.A), _longest(self.A), lam": ("row_panels(self.A), 1, lam",),
        "w = z / scale": ("w, scale = z, 1.0",),
        "square += gamma(2 * len(z)) * self.stiffest * length(w) ** 2": ("pass",),
        "gamma(2 * len(z)) * self.stiffest": ("gamma(2 * len(z))",),
        "self.D * self.assembly.K.multiply(self.D * w)": ("self.assembly.K.multiply(w)",),
        "return float(s - SAFE * away)": ("return float(s)", "return float(s - away / 2)"),
        ">= SMALLEST:\n            return": (">= 0:\n            return",),
        "away is not None and": ("away is None or",),
        "return min((_of_block": ("return max((_of_block",),
        "sigma2 = least - SAFE * gamma(longest + 1) * float((size.T @ (size @ ones)).max())": (
            "sigma2 = least",
        ),
        "return sigma2 if sigma2 >= SMALLEST else 0.0": ("return sigma2",),
    },
    "harness/verification/proof.py": {
        "r, s, sharpness)\n            if": ("r, s)\n            if",),
        "np.minimum(reach, np.sqrt(self.compliance))": (
            "np.sqrt(self.compliance)",
            "np.minimum(reach, self.compliance)",
        ),
        "s.error + SAFE * rounding), z": ("s.error), z", "SAFE * rounding), z"),
        "distance = units.energy(z) / 2": ("distance = units.energy(z) / 4", "pass"),
        " + abs(z) / 2)": (")", " + abs(z) / 4)"),
        "abs(s.value) + abs(units.At) @ abs(z)": ("abs(s.value)",),
        " + roundings * ETA * z.any(axis=0)": ("",),
        "        delta = np.where(pressing, -s.value, np.maximum(-s.value, 0.0))": (
            "        delta = np.maximum(-s.value, 0.0)",
            "        delta = np.where(pressing, -s.value, 0.0)",
        ),
        "s.error * (pressing | (s.value < s.error))": (
            "s.error * pressing",
            "s.error * (s.value < 0)",
            "0.0",
        ),
        "length(abs(r.value) + r.error)": (
            "length(abs(r.value))",
            "length(r.error)",
            "abs(r.value + r.error).max(axis=0)",
        ),
        "reach = D / np.sqrt(self.kappa)\n": ("reach = D\n",),
        "(reach * error + D * away)": (
            "(reach * error)",
            "(reach * error + D * away / 2)",
            "(reach * error + away)",
        ),
        " + ETA * x.hi.any(axis=0)": ("",),
        " & ~(lam.hi < 0).any(axis=0)": ("",),
        "np.where(valid, bounds, np.inf), (reach": ("bounds, (reach",),
        "np.where(C, At @ dx - y, 0.0)": ("np.where(C, -y, 0.0)",),
        "A @ (dlam - rho * closing)": ("A @ dlam",),
        "not (bounds[column] <= enough[column]": ("not (False",),
        "dlam = np.maximum(dlam, -lam2.hi)": ("pass",),
        "force / np.sqrt(self.kappa) + distance": (
            "force + distance",
            "force / np.sqrt(self.kappa) / 2 + distance",
            "distance",
            "force / np.sqrt(self.kappa)",
        ),
        "+ distance + moved)": ("+ distance)", "+ distance + moved / 2)", ")"),
        "np.sqrt(np.divide(units.stiffest, units.sigma2)) if": (
            "np.sqrt(units.stiffest) if",
            "np.sqrt(np.divide(1.0, units.sigma2)) if",
            "np.divide(units.stiffest, units.sigma2) if",
        ),
    },
    "problems/stiffness/dense_block.py": {
        "(1 + relative) * row**2": ("row**2", "(1 + relative / 2) * row**2", "(1 + relative) * row"),
        " + epsilon / (1 - epsilon) * length": ("",),
        "gamma(3 * self.size)": ("gamma(self.size)",),
        " or not epsilon < 0.5": ("",),
        "D**2 @ self.diagonal()": ("self.diagonal().sum()",),
        "error = gamma(2 * (self.size + 1))\n": ("error = gamma(self.size + 1)\n",),
        "gamma(2 * (self.size + 1)) * _norm(R) + ": ("",),
        "return gamma(2 * (self.size + 1))": ("return gamma(self.size + 1)",),
        "_norm(R) + ROUNDING * (largest + abs(s))": ("_norm(R)",),
        "ROUNDING * (largest + abs(s))": ("ROUNDING * abs(s)", "ROUNDING * largest"),
        "(w / v).max()": ("(w / v).min()",),
        "np.abs(R, out=R)": ("pass",),
        "    if info:\n            return None\n        largest": ("    largest",),
    },
    "harness/verification/closed_contacts.py": {
        "C = C & ~negative": ("C = C",),
        "u - inverse.product(t * inverse.R)": ("u",),
        "(v / self.R)[self.M.order]": ("v[self.M.order]",),
        "0.0, u - lam) * inverse.R": ("0.0, u - lam)",),
        "0.0, lam * inverse.R)": ("0.0, lam)",),
        "solve(C, v / self.R) / self.R": ("solve(C, v) / self.R", "solve(C, v / self.R)"),
        "v / inverse.R - carried) / inverse.R": ("v / inverse.R) / inverse.R", "v / inverse.R - carried)"),
    },
    "harness/verification/sprung_contacts.py": {
        "np.where(C, self.rho * y, lam)": ("np.where(C, self.rho * y, 0 * lam)", "np.where(C, 0 * y, lam)"),
        "max(1.0, KEPT * kappa)": ("1.0",),
        "C = C ^ wrong": ("C = C | wrong",),
        "-self.rho * gap, -lam)": ("0 * gap, -lam)", "-self.rho * gap, 0 * lam)"),
        "springs.sprung.factor(np.where(C, self.rho, 0.0))": ("springs.sprung.factor(0.0 * y)",),
    },
    "harness/verification/feasible_push.py": {
        "least, opening = s - error,": ("least, opening = s,",),
        "self.opening - self.error\n": ("self.opening\n",),
        "closing.any() or not": ("not",),
        "closing.any() or not (opening[overlap] > 0).all()": ("closing.any()",),
        "(theta * self.energy) ** 2 + 2": ("2",),
        "2 * SAFE * gap": ("SAFE * gap / 2", "0 * gap"),
        "(abs(s) + error + theta": ("(error + theta", "(abs(s) + theta"),
        " + theta * (abs(self.opening) + self.error)": ("", " + theta * self.error"),
    },
    "problems/forms/sprung_stiffness.py": {
        "self.entries + self.G @ rho": ("self.entries",),
        "A.data[own] * A.data[other]": ("A.data[own]",),
    },
    "harness/verification/assess.py": {
        "SAFE * near + ": ("",),
        "SAFE * near + (1 + 4 * U) * away": ("SAFE * near",),
        "(1 + 4 * U) * away": ("away",),
        "np.where(np.isfinite(bounds), bounds, np.inf)": ("bounds",),
        "self.norms * error_mm": ("error_mm",),
        "self.norms * error_mm + rounding": ("self.norms * error_mm", "rounding"),
        "abs(g) + self.size @ abs(x)": ("self.size @ abs(x)", "abs(g)"),
        "abs(assembly.A).T": ("assembly.A.T",),
        "gamma(k + 2)": ("gamma(k)", "gamma(2)"),
    },
    "harness/verification/reference.py": {
        "[ESTIMATED * about for about in": ("[4 * ESTIMATED * about for about in",),
    },
    "problems/stiffness/banded_block.py": {
        "gamma(2 * (self.width + 2)) * norm + ": ("",),
        "gamma(2 * (self.width + 2))": ("gamma(self.width + 2)",),
        "* norm + U * (largest + abs(s))": ("* norm",),
        "U * (largest + abs(s))": ("U * abs(s)", "U * largest"),
        "return None if norm is None else ": ("norm = norm or 0.0; return ",),
    },
    "problems/stiffness/band_factor.py": {
        "np.abs(L, out=L)": ("pass",),
        "sums.max()": ("sums.min()",),
        "count + width] += blas": ("count + width] = blas",),
        "np.tril(taken[:near, :near])": ("0",),
        "        if info:\n            raise": ("        if False:\n            raise",),
        "L[:, count:] = 0.0": ("pass",),
    },
    "problems/stiffness/cholmod.py": {
        "gamma(2 * (int(": ("gamma((int(",),
        " / float(self.D.min()) ** 2": ("",),
    },
    "problems/stiffness/superlu.py": {
        "gamma(2 * (longest + 2))": ("gamma(longest + 2)",),
    },
    "problems/stiffness/__init__.py": {
        "np.sqrt(np.where(diagonal > 0, diagonal, 1.0))": ("np.where(diagonal > 0, diagonal, 1.0)",),
    },
    "problems/stiffness/operator.py": {"solve(v / D) / D": ("solve(v)",)},
    "harness/placement/session.py": {
        "gaps.max(axis=0) + errors)": ("gaps.max(axis=0) - errors)", "gaps.max(axis=0))"),
        "g + gap, u + change": ("g + gap, u",),
        "study.cases.staged(study.scene)": ("study.scene",),
        "locked(study.bare, self.approaches)": ("study.bare",),
        "self.last.data, np.zeros(": ("self.last.data, -1e-4 * np.ones(",),
        "(stage.springs.k[:, None] * approaches)": ("(0 * approaches)",),
        " - overlap.T @ self.vectors[0]": (" + overlap.T @ self.vectors[0]",),
        "> LIMIT_MM).any(axis=0), np.inf": ("> LIMIT_MM).any(axis=0), 0.0",),
    },
    "harness/placement/plan_search.py": {
        "reverse=True)[self.allowed]": ("reverse=True)[0]", "reverse=True)[self.allowed + 1]"),
        "round(self.gap_mm, DIGITS), self.plan": ("0.0, self.plan",),
    },
    "harness/shimming/search.py": {
        "figures[: len(self.study.masks)], ": ("figures[: len(self.study.masks) - 1], ",),
        "self.limit_mm * max(shares))": ("0.0)",),
        "len(order) - self.allowed]": ("len(order)]",),
        "s >= round(t + excess, DIGITS)": ("True",),
        "if s > t and": ("if",),
        "not waiting or kept[0] < waiting[0][:2]": ("True",),
        "entry[0] < below and": ("",),
    },
    "harness/shimming/study.py": {
        "force_error_per_mm(scene) * answer.bound_mm": ("-1e-3",),
        "if answer.bound_mm else 0.0": ("if False else -1.0",),
    },
    "harness/shimming/gap_regions.py": {
        "<= limit_mm:\n                break": ("<= 3 * limit_mm:\n                break",),
        "among[over[among]]": ("among",),
        "2 * first - low": ("low",),
    },
    "harness/shimming/each.py": {
        "count - kept <= most": ("True", "count - kept < most"),
        "search.among(self.cases, 0)": ("search.among((0,), 0)",),
    },
    "problems/effects/shims.py": {
        "(cross(edge, at[:, None] - corners) > 0) == (edge[:, 1] > 0)": (
            "cross(edge, at[:, None] - corners) > 0",
        ),
        "low + NUDGE, high - NUDGE": ("low - 1.0, high + 1.0",),
        "places - NUDGE": ("places",),
        "(last - first) * self.along(places)": ("0.0 * places[:, 0]",),
    },
    "harness/placement/search.py": {
        "set(nearest(step.plan, place, NEXT))": ("set()",),
        "for plan in self.even(len(step.plan) - 1)}": ("for plan in []}",),
        "set(more := self.deciding(after)) <= set(cases)": ("(more := self.deciding(after))",),
    },
    "harness/placement/fresh_cases.py": {
        "(1 - self.share) * cases / 2": ("(1 - self.share) * cases",),
        "binom.cdf(c, n, q) <= alpha / 2": ("binom.cdf(c, n, q) <= alpha",),
        "cases, 1 - self.share) <= alpha / 2": ("cases, 1 - self.share) <= alpha",),
        "ALPHA / 2 ** (len(samples) + 1)": ("ALPHA / 2",),
    },
    "harness/series/derivatives.py": {
        " - dg[C]": ("",),
        "free - K.solve(closed @ dlam)": ("free",),
        "np.vstack([dlam, dy, largest - dy])": (
            "np.vstack([0 * dlam, dy, largest - dy])",
            "np.vstack([dlam, 0 * dy, largest - dy])",
            "np.vstack([dlam, dy, 0 * dy])",
        ),
    },
    "problems/load_cases/random_inputs.py": {
        "self.levels - 1) + 0.5)": ("self.levels - 1) + 0.4)",),
        "if one.changes_K:\n                effects": ("if False:\n                effects",),
        'float(one.path == ("preload",))': ("0.0", "1.0"),
        "[elements if self.elements else [0]]": ("[: len(elements) or 1]",),
        "if i not in self.pieces": ("if True",),
    },
    "harness/series/staged.py": {
        "load = self.drawn.load(k)": ("load = self.of_last.load(k)",),
        "load.f + self.locking[k][1]": ("load.f",),
        "locked(part, self.locking[k][0])": ("part",),
        "job.cases.staged(job.scene)": ("job.scene",),
    },
    "problems/input/matrix_entries.py": {
        "SYMMETRY * sizes[i] * sizes[j]": ("SYMMETRY * sizes.max() ** 2",),
        "if M.nnz < len(values)": ("if False",),
        "M + sign * M.multiply(alone).T": ("M + sign * M.T",),
    },
    "solvers/algorithms/newton_sweeps.py": {
        "self.A.T @ change.f / self.squares": ("self.A.T @ change.f",),
        "np.clip(-force @ y / (force @ moved or 1.0), 0.0, 1.0)": ("1.0",),
        "same and change and not": ("same and not",),
        " and not case.trial.lam[~case.C].any()": ("",),
    },
    "problems/model/effect.py": {
        "(k * self.approach + np.resize(self.preload, len(k)))": (
            "(k * self.approach)",
            "(self.approach + np.resize(self.preload, len(k)))",
        ),
        "k * (self.approach - T.T @ x) + np.resize(self.preload, len(k))": (
            "k * (self.approach - T.T @ x)",
            "k * (self.approach + T.T @ x) + np.resize(self.preload, len(k))",
        ),
    },
    "problems/model/joint_model.py": {
        "self.springs.key(key) if self.springs else key\n        like": ("key\n        like",),
    },
    "problems/model/stage_answers.py": {
        "step.elements - fresh)": ("step.elements)",),
        "reached[:, elements]": ("0.5 * reached[:, elements]",),
        "step is last": ("False",),
        "again or effect.preload != 0": ("again",),
        "tuple(approaches[start:stop]": ("tuple(approaches[: stop - start]",),
    },
    "harness/scene/stress.py": {
        "energy_error(problem.load, reference.x, reference.lam)": (
            "energy_error(problem.load, reference.x, reference.lam) / 1e9",
        ),
    },
    "problems/model/stress.py": {
        "of_xx - bent": ("of_xx",),
        "thickness / 2 / (1 - nu**2)": ("thickness / (1 - nu**2)",),
        "of_xx + nu * of_yy": ("of_xx - nu * of_yy", "of_xx"),
        "(1 - nu) * of_xy": ("of_xy",),
        "thickness[((low <= places)": ("thickness[((low > places)",),
        "max(1.0, 1.5 * (1 - nu)) * s**2": ("0.001 * s**2",),
        "x**2 - x * y + y**2": ("x**2 + y**2",),
    },
    "problems/model/stages.py": {
        "acting = frozenset(everything) - self.staged": ("acting = frozenset(everything)",),
        "acting -= elements": ("pass",),
        "fresh | elements": ("fresh",),
    },
    "solvers/kkt.py": {
        "max(float((-y).max(initial=0.0)), float(": ("max(float(",),
        "float(abs(y[lam > 0]).max(initial=0.0))": ("0.0", "float(y[lam > 0].min(initial=0.0))"),
        "(abs(p) + abs(Q) @ lam)": ("abs(p)", "(abs(Q) @ lam)"),
        "4 * EPS * float((abs(p) + abs(Q) @ lam)": ("8 * EPS * float((abs(p) + abs(Q) @ lam)",),
    },
}

MUTANTS = [
    Mutant(file, old, new)
    for file, changes in CHANGES.items()
    for old, changed in changes.items()
    for new in changed
]

#: Which tests must fail.
TESTS = {
    "harness/verification/enclosure.py": ("proofs/test_enclosure.py",),
    "harness/verification/findings.py": ("harness/test_gate_baseline.py",),
    "harness/verification/slowdown.py": ("harness/test_gate_baseline.py",),
    "harness/verification/balanced_units.py": (
        "proofs/test_enclosure.py",
        "proofs/test_definite.py",
        "proofs/test_proof.py",
    ),
    "harness/verification/proof.py": ("proofs/test_proof.py", "proofs/test_sprung_contacts.py"),
    "harness/verification/closed_contacts.py": ("proofs/test_proof.py",),
    "harness/verification/sprung_contacts.py": ("proofs/test_sprung_contacts.py",),
    "harness/verification/feasible_push.py": ("proofs/test_feasible_push.py",),
    "problems/forms/sprung_stiffness.py": ("problems/test_sparse_factor.py",),
    "harness/verification/assess.py": ("proofs/test_proof.py", "harness/test_allowed_gap.py"),
    "harness/verification/reference.py": ("proofs/test_terms_verdict.py",),
    "harness/verification/judge.py": ("proofs/test_terms_verdict.py", "harness/test_judge.py"),
    "problems/stiffness/dense_block.py": ("proofs/test_definite.py",),
    "problems/stiffness/banded_block.py": ("proofs/test_definite.py",),
    "problems/stiffness/band_factor.py": ("problems/test_sparse_factor.py",),
    "problems/stiffness/cholmod.py": ("proofs/test_definite.py",),
    "problems/stiffness/superlu.py": ("proofs/test_definite.py",),
    "problems/stiffness/__init__.py": ("proofs/test_definite.py", "proofs/test_proof.py"),
    "problems/stiffness/operator.py": ("proofs/test_definite.py", "proofs/test_proof.py"),
    "harness/placement/session.py": (
        "harness/test_place.py",
        "harness/test_staged_place.py",
        "harness/test_random_series.py",
        "harness/test_staged_random.py",
    ),
    "harness/placement/plan_search.py": ("harness/test_search.py", "harness/test_place.py"),
    "harness/shimming/search.py": ("harness/test_shim.py", "harness/test_shim_stages.py"),
    "harness/shimming/study.py": ("harness/test_shim.py", "harness/test_shim_stages.py"),
    "harness/shimming/gap_regions.py": ("harness/test_shim.py",),
    "harness/shimming/each.py": ("harness/test_shim.py",),
    "problems/effects/shims.py": ("harness/test_shim.py", "harness/test_shim_stages.py"),
    "harness/placement/search.py": ("harness/test_search.py", "harness/test_place.py"),
    "harness/placement/fresh_cases.py": ("harness/test_place.py",),
    "harness/series/derivatives.py": ("harness/test_derivatives.py",),
    "problems/load_cases/random_inputs.py": (
        "harness/test_random_series.py",
        "harness/test_staged_random.py",
    ),
    "harness/series/staged.py": ("harness/test_staged_series.py", "harness/test_staged_random.py"),
    "problems/input/matrix_entries.py": ("problems/test_entries.py", "problems/test_formats.py"),
    "solvers/algorithms/newton_sweeps.py": (
        "solvers/test_sweeps.py",
        "problems/test_outside.py",
        "proofs/test_fuzz_exact.py",
    ),
    "problems/model/effect.py": ("problems/test_stages.py",),
    "problems/model/joint_model.py": ("problems/test_stages.py",),
    "problems/model/stage_answers.py": ("problems/test_stages.py",),
    "problems/model/stages.py": ("problems/test_stages.py",),
    "harness/scene/stress.py": ("problems/test_stress.py",),
    "problems/model/stress.py": ("problems/test_stress.py",),
    "solvers/kkt.py": ("proofs/test_terms_verdict.py",),
}
