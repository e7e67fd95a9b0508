"""Claims of sections 5 and 6 on how cost and memory grow: Table 3."""

from __future__ import annotations

from ...numbers import significant, whole
from .fit import Exponent
from .scaling import fitted, keys
from .selection import method
from .verdict import Claim, Measured, Verdict, decided

CLOSE = 0.3  # exponents this near to each other are one order
FACTORS = {
    "working_s": "working time",
    "iterations": "outer iterations",
    "s_per_cg": "seconds a CG iteration",
}
RIVALS = ("GI dual", "GI primal")


def within(fit: Exponent | None, order: float) -> bool | None:
    """Whether an exponent is at most `order`, two standard errors allowed."""
    return None if fit is None else fit.slope - 2 * fit.error <= order


def _below_root(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words = []
    for name in ("IPM", "IPM, open gaps last"):
        fit = fitted(measured.lines, name, "iterations")
        if fit is None:
            continue
        low, high = fit.slope - 2 * fit.error, fit.slope + 2 * fit.error
        outcomes[name] = True if high < 0.5 else False if low > 0.5 else None
        words.append(f"{name}: n^{fit}")
    return decided(outcomes, "the ordering", "; ".join(words), keys(measured.lines, *outcomes))


def _ipm_order(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words = []
    for name in ("IPM", "IPM, open gaps last"):
        fit = fitted(measured.lines, name, "working_per_cg")
        if fit is None:
            continue
        outcomes[name] = within(fit, 2.5)
        parts = [(key, fitted(measured.lines, name, key)) for key in ("working_s", "iterations", "s_per_cg")]
        factors = ", ".join(f"{FACTORS[key]} n^{part}" for key, part in parts)
        words.append(f"{name}: working time over CG iterations a system n^{fit}; {factors}")
    return decided(outcomes, "the ordering", "; ".join(words), keys(measured.lines, *outcomes))


def _gi_order(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words = []
    for name in RIVALS:
        fit, working = (fitted(measured.lines, name, key) for key in ("s_per_pivot", "working_s"))
        if fit is not None:
            outcomes[name] = within(fit, 2.0)
            words.append(f"{name}: a pivot n^{fit}, working time n^{working or '–'}")
    return decided(outcomes, "the form", "; ".join(words), keys(measured.lines, *outcomes))


def _same_preparation(measured: Measured) -> Verdict:
    mine = fitted(measured.lines, "IPM", "preparation_s")
    outcomes: dict[str, bool | None] = {}
    words = [f"IPM: n^{mine}"]
    for name in RIVALS:
        fit = fitted(measured.lines, name, "preparation_s")
        if fit and mine:
            spread = 2 * (fit.error**2 + mine.error**2) ** 0.5
            outcomes[name] = abs(fit.slope - mine.slope) <= max(CLOSE, spread)
            words.append(f"{name}: n^{fit}")
    return decided(outcomes, "the form", "; ".join(words), keys(measured.lines, "IPM", *outcomes))


def _inversion_besides(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words: list[str] = []
    used: list[str] = []
    lines = measured.lines
    for name in RIVALS if len(lines) else ():
        both = lines[lines["method"] == "IPM"].merge(lines[lines["method"] == name], on="scene")
        both = both.dropna(subset=["prepare_s_x", "prepare_s_y"]).sort_values("n_x")
        if both.empty:
            continue
        outcomes[name] = bool((both["prepare_s_y"] > both["prepare_s_x"]).all())
        last = both.iloc[-1]
        mine, its = (significant(last[key]) for key in ("prepare_s_x", "prepare_s_y"))
        words.append(f"{name}: {its} s against the IPM's {mine} s at n = {last['n_x']:.0f}")
        used += [*both["key_x"], *both["key_y"]]
    return decided(outcomes, "the form", "; ".join(words), used)


def _less_memory(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words, used = [], []
    mine = method(measured.cells, "IPM").dropna(subset=["working_mib"])
    for n in sorted(mine["n"].unique()):
        largest = mine.loc[mine["n"] == n, "working_mib"].max()
        figures = [f"IPM {whole(largest)}"]
        for name in RIVALS:
            rows = method(measured.cells, name).dropna(subset=["working_mib"])
            rows = rows[rows["n"] == n]
            if rows.empty:
                continue
            outcomes[f"{name}, n = {n:.0f}"] = bool(largest < rows["working_mib"].max())
            figures.append(f"{name} {whole(rows['working_mib'].max())}")
            used += rows["key"].tolist()
        used += mine.loc[mine["n"] == n, "key"].tolist()
        words.append(f"n = {n:.0f}: {', '.join(figures)} MiB")
    return decided(outcomes, "the form and the size", "; ".join(words), used)


def _square_memory(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words = []
    for name in ("IPM", *RIVALS):
        fit = fitted(measured.lines, name, "working_mib")
        if fit is not None:
            outcomes[name] = within(fit, 2.0)
            words.append(f"{name}: n^{fit}")
    return decided(outcomes, "the method", "; ".join(words), keys(measured.lines, *outcomes))


AT_MOST = "The fitted exponent, less two standard errors, is at most the claimed one"

CLAIMS = [
    Claim(
        "iterations below √m",
        "5.1",
        "In practice the iterations grow more slowly than the worst case √m.",
        "The fitted exponent of the outer iterations, with two standard errors on it, stays below 0.5.",
        _below_root,
    ),
    Claim(
        "IPM working time",
        "6, Table 3",
        "The interior-point method's working time is O(n^2.5) times the CG iterations of a system.",
        AT_MOST + ": working time over the mean CG iterations of a system 2.5.",
        _ipm_order,
    ),
    Claim(
        "GI working time",
        "6, Table 3",
        "Goldfarb–Idnani's working time is O(n_act n²).",
        AT_MOST + ": seconds a pivot 2.",
        _gi_order,
    ),
    Claim(
        "preparation",
        "6, Table 3",
        "Data preparation is of the same order for both methods.",
        f"The exponents of data preparation differ by at most {CLOSE}, or two standard errors.",
        _same_preparation,
    ),
    Claim(
        "inversion",
        "6, Table 3",
        "Goldfarb–Idnani needs an inversion besides the factorisation.",
        "What the solver prepares once takes longer than with the interior-point method, at every size.",
        _inversion_besides,
    ),
    Claim(
        "less memory",
        "6, Table 3",
        "The interior-point method needs less memory.",
        "Its largest working memory over the scenes of a size is below Goldfarb–Idnani's.",
        _less_memory,
    ),
    Claim(
        "memory grows",
        "6, Table 3",
        "Memory grows like the square of the problem.",
        AT_MOST + ": working memory 2.",
        _square_memory,
    ),
]
