"""KKT residuals against the displacement error: a small residual does not prove a small error."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.precision import ZERO_ERROR_MM, swept
from report.document.blocks import Block, Figure, Place, Section, Table, Text, number, word
from report.document.numbers import power, tidy_power, whole
from report.figures import style
from report.figures.lines import styles_of
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(360)

RESIDUALS = {"primal_residual": "mm", "dual_residual": "N", "duality_gap": "N·mm"}

PANEL = 2.7  # inches
RING = {"markersize": 5.0, "markeredgewidth": 0.9}
OPACITY = 0.35


def section(results: Results) -> Section | None:
    cells = swept(results).dropna(subset=["error", *RESIDUALS])
    if cells.empty:
        return None
    cells = cells.assign(**{name: cells[name].abs().clip(lower=ZERO_ERROR_MM) for name in RESIDUALS})
    caption = (
        "*Displacement error against the residuals* of every answer on all scenes. If a small residual "
        f"implied a small error, the upper left would be empty. Dotted: {results.limit}. A residual of zero "
        f"is drawn at {tidy_power(ZERO_ERROR_MM)}."
    )
    blocks: list[Block] = [
        Text(sentence(cells, results)),
        Figure("residual-error", caption, _drawing(results, cells)),
        _table(cells, results),
    ]
    return Section("Residuals and displacement error", blocks)


def _drawing(results: Results, cells: pd.DataFrame) -> Drawing:
    """The markers are rings, those of the methods with the fewest answers on top."""
    styles = {s: style.marker_only(look) | RING for s, look in styles_of(results, cells).items()}
    for look in styles.values():
        look["markerfacecolor"] = (look["markerfacecolor"], OPACITY)
    drawing = style.figure(PANEL * len(RESIDUALS) + 0.4)
    panels = drawing.subplots(len(RESIDUALS), 1, sharey=True)
    often = cells["method"].value_counts()
    for axes, (name, unit) in zip(panels, RESIDUALS.items(), strict=True):
        for method, look in styles.items():
            line = cells[cells["method"] == method]
            axes.plot(line[name], line["error"], **look, zorder=3 - often[method] / often.max())
        axes.set(xscale="log", yscale="log", xlabel=f"{name.replace('_', ' ')}, {unit}")
        axes.set_ylabel("displacement error, mm")
        axes.axhline(cells["limit_mm"].max(), color="black", linewidth=1.1, linestyle=(0, (1, 1.5)))
    drawing.legend(handles=style.legend_entries(styles), loc="outside right upper")
    return drawing


def sentence(cells: pd.DataFrame, results: Results) -> str:
    """The starkest pair on one scene: an answer outside the limit whose three residuals are no larger, and
    one smaller, than those of an answer within it.
    """
    pair = deceptive(cells)
    if pair is None:
        return (
            f"No answer outside {results.limit} has all three residuals as small as those of an answer "
            "within it on the same scene: here the three residuals together do tell them apart."
        )
    bad, good = cells.loc[[*pair]].to_dict("records")
    return (
        f"A small residual does not prove a small error. On scene {bad['scene']}, {bad['label']} has "
        f"residuals ({_residuals(bad)}) no larger than {good['label']} ({_residuals(good)}), but an error of "
        f"{power(bad['error'], 2)} mm against {power(good['error'], 2)} mm."
    )


def deceptive(cells: pd.DataFrame) -> tuple[int, int] | None:
    """Index of the two answers of `sentence`: of all such pairs the one with the largest ratio of errors."""
    most, pair = 0.0, None
    for _, scene in cells.groupby("scene"):
        bad, good = scene[scene["error"] > scene["limit_mm"]], scene[scene["error"] <= scene["limit_mm"]]
        if bad.empty or good.empty:
            continue
        left, right = (of[[*RESIDUALS]].to_numpy() for of in (bad, good))
        no_larger = (left[:, None, :] <= right[None, :, :]).all(axis=2)
        one_smaller = (left[:, None, :] < right[None, :, :]).any(axis=2)
        ratios = bad["error"].to_numpy()[:, None] / good["error"].to_numpy() * (no_larger & one_smaller)
        i, j = np.unravel_index(ratios.argmax(), ratios.shape)
        if ratios[i, j] > most:
            most, pair = float(ratios[i, j]), (bad.index.tolist()[i], good.index.tolist()[j])
    return pair


def _residuals(line: dict[Hashable, object]) -> str:
    return ", ".join(f"{power(line[name], 2)} {unit}" for name, unit in RESIDUALS.items())


def _table(cells: pd.DataFrame, results: Results) -> Table:
    lines = []
    for method in in_order(cells, "method"):
        runs = cells[cells["method"] == method]
        small = runs[runs["primal_residual"] <= runs["limit_mm"]]
        line = {"method": method, "answers": len(runs), "small_residual": len(small)}
        line |= {"outside": int((small["error"] > small["limit_mm"]).sum())}
        lines.append(line | {"worst_error_mm": small["error"].max()})
    columns = [
        word("solver (form)", "method"),
        number("answers", "answers", whole),
        number(f"primal residual ≤ {results.limit}", "small_residual", whole),
        number("of these, error outside", "outside", whole),
        number("their largest error, mm", "worst_error_mm", power),
    ]
    caption = "*What a primal residual within the limit implies*: how often the error was outside it."
    return Table("residual-error", caption, pd.DataFrame(lines), columns)
