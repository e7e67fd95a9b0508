"""What the rows say of sections 6 and 7: growth with n, active contacts, IPM beside GI."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from report.analysis.standings import geometric_mean
from report.analysis.time_to_solution import Exponent
from report.document.numbers import power, significant, whole

from . import table3
from .rows import BETTER, FORMS, METHODS, Evidence, Row, Study, against, clearly_faster, merged, pairs

# The thresholds that claims.csv states.
CLOSE = 0.3  # exponents
CLEAR, FEWEST, SLIGHT = 0.8, 4, 3.0  # a rank correlation, the scenes for it, longest over shortest time
AGREE_MM = 1e-7


# Growth with n.


def _fits(study: Study, quantity: str, methods: Iterable[str]) -> dict[str, Exponent]:
    lines = table3.quantities(study)
    found = {name: table3.fitted(lines, name, quantity) for name in methods}
    return {name: fit for name, fit in found.items() if fit}


def exponent_at_most(quantity: str, order: float, methods: Iterable[str]) -> Callable[[Study], Evidence]:
    """Evidence that the fitted exponent, less two standard errors, is at most `order`."""

    def evidence(study: Study) -> Evidence:
        for name, fit in _fits(study, quantity, methods).items():
            yield name, fit.slope - 2 * fit.error <= order, f"n^{fit}"

    return evidence


def iterations_below_root(study: Study) -> Evidence:
    for name, fit in _fits(study, table3.OUTER, METHODS[:2]).items():
        known = abs(fit.slope - 0.5) > 2 * fit.error
        yield name, fit.slope < 0.5 if known else None, f"n^{fit}"


def preparation_of_one_order(study: Study) -> Evidence:
    fits = _fits(study, table3.PREPARATION, ("IPM", *FORMS))
    if ipm := fits.pop("IPM", None):
        for name, gi in fits.items():
            spread = 2 * math.hypot(gi.error, ipm.error)
            yield name, abs(gi.slope - ipm.slope) <= max(CLOSE, spread), f"n^{gi} against n^{ipm}"


def gi_prepares_longer(study: Study) -> Evidence:
    lines = table3.quantities(study)
    own = {name: {r["n"]: r[table3.OWN] for r in lines if r["method"] == name} for name in METHODS}
    for name in FORMS:
        both = [(own[name][n], own["IPM"][n]) for n in own[name] if n in own["IPM"]]
        if both := [pair for pair in both if None not in pair]:
            gi, ipm = map(significant, both[-1])
            yield name, all(gi > ipm for gi, ipm in both), f"{gi} against {ipm} s at the largest size"


def ipm_needs_less_memory(study: Study) -> Evidence:
    for n in study.sizes:
        mib = {name: [r["working_mib"] or 0.0 for r in study.of(name, n).values()] for name in METHODS}
        most = {name: max(values, default=0.0) for name, values in mib.items()}
        for name in FORMS:
            if most["IPM"] and most[name]:
                holds = most["IPM"] < most[name]
                yield f"{name}, n = {n}", holds, f"{whole(most['IPM'])} against {whole(most[name])} MiB"


# Active contacts, and the two methods beside each other.


def _timed(study: Study, method: str, n: int) -> list[Row]:
    """The rows of a method at a size with a time, by active contacts."""
    rows = [row for row in study.of(method, n).values() if row["at_least"]]
    return sorted(rows, key=lambda row: row["active"])


def trend(method: str, sign: int) -> Callable[[Study], Evidence]:
    """The rank correlation of the seconds with the active contacts has this sign."""

    def evidence(study: Study) -> Evidence:
        for n in study.sizes:
            rows = _timed(study, method, n)
            active, seconds = ([row[name] for row in rows] for name in ("active", "at_least"))
            if len(rows) >= FEWEST and min(len({*active}), len({*seconds})) > 1:
                rho = float(spearmanr(active, seconds).statistic)
                yield f"n = {n}", sign * rho >= CLEAR, f"{rho:+.2f}"

    return evidence


def time_hardly_depends_on_contact(study: Study) -> Evidence:
    for n in study.sizes:
        times = {name: [row["at_least"] for row in _timed(study, name, n)] for name in ("IPM", *FORMS)}
        spread = {name: max(s) / min(s) for name, s in times.items() if len(s) >= FEWEST}
        if "IPM" in spread and len(spread) > 1:
            figures = ", ".join(f"{name} {ratio:.1f}" for name, ratio in spread.items())
            yield f"n = {n}", spread["IPM"] <= min(SLIGHT, *spread.values()), figures


def faster_at_half_contact(rival: str, *, once: bool = False) -> Callable[[Study], Evidence]:
    """The interior-point method, where half of m is active, at each size; `once`: one size is enough."""

    def evidence(study: Study) -> Evidence:
        compared = []
        for n in study.sizes:
            mine, other = _at_half(study, "IPM", n), _at_half(study, rival, n)
            if mine and other:
                faster = bool(mine["at_least"] < other["at_least"])
                known = not (mine if faster else other)["cut"]
                compared.append((f"n = {n}", faster if known else None, against(mine, other)))
        met = [case for case in compared if case[1]]
        yield from met if once and met else compared

    return evidence


def _at_half(study: Study, method: str, n: int) -> Row | None:
    """The seconds there, their logarithm interpolated in the active contacts; None outside their range."""
    rows = _timed(study, method, n)
    below, above = ([r for r in rows if sign * (2 * r["active"] - r["m"]) <= 0] for sign in (1, -1))
    if not below or not above:
        return None
    low, high = below[-1], above[0]
    places = [low["active"], high["active"]]
    return merged((low, high), lambda s: math.exp(np.interp(low["m"] / 2, places, np.log(s))))


def displacements_agree(study: Study) -> Evidence:
    ipm = {scene: row["displacement_error_mm"] for scene, row in study.of("IPM").items()}
    for name in FORMS:
        gi = {scene: row["displacement_error_mm"] for scene, row in study.of(name).items()}
        apart = [e + ipm[scene] for scene, e in gi.items() if e is not None and ipm.get(scene) is not None]
        if apart:
            yield name, max(apart) <= AGREE_MM, f"at most {power(max(apart))} mm on {len(apart)} scenes"


def _worst_below(study: Study, rival: str, n: int) -> tuple[bool | None, str]:
    """Whether the longest time of the interior-point method is below that of a rival."""
    mine, other = (_timed(study, name, n) for name in ("IPM", rival))
    if not mine or not other:
        return None, "not measured"
    a, b = (max(rows, key=lambda row: (row["at_least"], row["cut"])) for rows in (mine, other))
    below = bool(a["at_least"] < b["at_least"])
    smaller, timed, all_ = (a, mine, study.of("IPM", n)) if below else (b, other, study.of(rival, n))
    known = not smaller["cut"] and len(timed) == len(all_)  # it could be longer
    return below if known else None, against(a, b)


def worst_case_below(study: Study) -> Evidence:
    for n in study.sizes:
        for name in FORMS:
            holds, figures = _worst_below(study, name, n)
            if figures != "not measured":
                yield f"{name}, n = {n}", holds, figures


def _mean_below(study: Study, rival: str, n: int) -> tuple[bool | None, str]:
    """Whether the interior-point method's geometric mean, over the scenes of both, is below a rival's."""
    both = pairs(study.of("IPM", n), study.of(rival, n))
    if not both:
        return None, "not measured"
    mine, other = (merged(rows, lambda s: geometric_mean(pd.Series(s))) for rows in zip(*both, strict=True))
    return clearly_faster(mine, other), against(mine, other)


def gi_is_faster_if_well_chosen(study: Study) -> Evidence:
    for n in study.sizes:
        ipm_faster, figures = _mean_below(study, BETTER, n)
        if figures != "not measured":
            yield f"n = {n}", None if ipm_faster is None else not ipm_faster, f"IPM {figures}"


def ipm_suits_large_problems(study: Study) -> Evidence:
    for n in study.sizes[-1:]:
        for name in (*FORMS, BETTER):
            (mean, means), (worst, worsts) = _mean_below(study, name, n), _worst_below(study, name, n)
            if means != "not measured":
                holds = False if False in (mean, worst) else None if None in (mean, worst) else True
                yield f"{name}, n = {n}", holds, f"mean {means}, worst {worsts}"
