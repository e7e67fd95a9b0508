"""Claims of sections 5 and 6 on how cost and memory grow: Table 3."""

from __future__ import annotations

from collections.abc import Iterator

from report.analysis.fit import Exponent
from report.analysis.paper.growth import fitted, keys
from report.analysis.paper.selection import of_method
from report.document.numbers import significant, whole

from .verdict import Case, Claim, Measured, by_case

CLOSE = 0.3  # exponents this close to each other are one order
FACTORS = {
    "working_s": "working time",
    "iterations": "outer iterations",
    "s_per_cg": "seconds per CG iteration",
}
ORDERINGS = ("IPM", "IPM, open gaps last")
RIVALS = ("GI dual", "GI primal")


def within(fit: Exponent | None, order: float) -> bool | None:
    """Whether an exponent is at most `order`, two standard errors allowed."""
    return None if fit is None else fit.slope - 2 * fit.error <= order


@by_case("the ordering")
def _below_root(measured: Measured) -> Iterator[Case]:
    for name in ORDERINGS:
        fit = fitted(measured.lines, name, "iterations")
        if fit is None:
            continue
        low, high = fit.slope - 2 * fit.error, fit.slope + 2 * fit.error
        holds = True if high < 0.5 else False if low > 0.5 else None
        yield Case(name, holds, f"{name}: n^{fit}", keys(measured.lines, name))


@by_case("the ordering")
def _ipm_order(measured: Measured) -> Iterator[Case]:
    for name in ORDERINGS:
        fit = fitted(measured.lines, name, "working_per_cg")
        if fit is None:
            continue
        parts = [(key, fitted(measured.lines, name, key)) for key in ("working_s", "iterations", "s_per_cg")]
        factors = ", ".join(f"{FACTORS[key]} n^{part}" for key, part in parts)
        words = f"{name}: working time over CG iterations per system n^{fit}; {factors}"
        yield Case(name, within(fit, 2.5), words, keys(measured.lines, name))


@by_case("the form")
def _gi_order(measured: Measured) -> Iterator[Case]:
    for name in RIVALS:
        fit, working = (fitted(measured.lines, name, key) for key in ("s_per_pivot", "working_s"))
        if fit is not None:
            words = f"{name}: time per pivot n^{fit}, working time n^{working or '–'}"
            yield Case(name, within(fit, 2.0), words, keys(measured.lines, name))


@by_case("the form")
def _same_preparation(measured: Measured) -> Iterator[Case]:
    mine = fitted(measured.lines, "IPM", "preparation_s")
    yield Case("", None, f"IPM: n^{mine}", keys(measured.lines, "IPM"))
    for name in RIVALS:
        fit = fitted(measured.lines, name, "preparation_s")
        if fit and mine:
            spread = 2 * (fit.error**2 + mine.error**2) ** 0.5
            holds = abs(fit.slope - mine.slope) <= max(CLOSE, spread)
            yield Case(name, holds, f"{name}: n^{fit}", keys(measured.lines, name))


@by_case("the form")
def _additional_inversion(measured: Measured) -> Iterator[Case]:
    lines = measured.lines
    for name in RIVALS if len(lines) else ():
        both = lines[lines["method"] == "IPM"].merge(lines[lines["method"] == name], on="scene")
        both = both.dropna(subset=["prepare_s_x", "prepare_s_y"]).sort_values("n_x")
        if both.empty:
            continue
        holds = bool((both["prepare_s_y"] > both["prepare_s_x"]).all())
        last = both.iloc[-1]
        mine, its = (significant(last[key]) for key in ("prepare_s_x", "prepare_s_y"))
        words = f"{name}: {its} s against the IPM's {mine} s at n = {last['n_x']:.0f}"
        yield Case(name, holds, words, [*both["key_x"], *both["key_y"]])


@by_case("the form and the size")
def _less_memory(measured: Measured) -> Iterator[Case]:
    mine = of_method(measured.cells, "IPM").dropna(subset=["working_mib"])
    for n in sorted(mine["n"].unique()):
        of_size = mine[mine["n"] == n]
        largest = of_size["working_mib"].max()
        yield Case("", None, f"n = {n:.0f}: IPM {whole(largest)} MiB", of_size["key"].tolist())
        for name in RIVALS:
            rows = of_method(measured.cells, name).dropna(subset=["working_mib"])
            rows = rows[rows["n"] == n]
            if rows.empty:
                continue
            its = rows["working_mib"].max()
            words = f"{name} {whole(its)} MiB"
            yield Case(f"{name}, n = {n:.0f}", bool(largest < its), words, rows["key"].tolist())


@by_case("the method")
def _square_memory(measured: Measured) -> Iterator[Case]:
    for name in ("IPM", *RIVALS):
        fit = fitted(measured.lines, name, "working_mib")
        if fit is not None:
            yield Case(name, within(fit, 2.0), f"{name}: n^{fit}", keys(measured.lines, name))


AT_MOST = "The fitted exponent minus two standard errors is at most the claimed one"

CLAIMS = [
    Claim(
        "iterations below √m",
        "5.1",
        "In practice the iterations grow more slowly than the worst case √m.",
        "The fitted exponent of the outer iterations plus two standard errors is below 0.5.",
        _below_root,
    ),
    Claim(
        "IPM working time",
        "6, Table 3",
        "The interior-point method's working time is O(n^2.5) times the CG iterations per system.",
        AT_MOST + ": 2.5 for working time over the mean CG iterations per system.",
        _ipm_order,
    ),
    Claim(
        "GI working time",
        "6, Table 3",
        "Goldfarb–Idnani's working time is O(n_act n²).",
        AT_MOST + ": 2 for seconds per pivot.",
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
        "Goldfarb–Idnani needs an inversion in addition to the factorisation.",
        "The solver's own preparation takes longer than the interior-point method's at every size.",
        _additional_inversion,
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
        AT_MOST + ": 2 for working memory.",
        _square_memory,
    ),
]
