"""Times relative to the fastest library and to what the machine can do, within one run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from report.analysis.drawn import drawn_cells, omission_note
from report.analysis.relative import load_cases
from report.analysis.roads import roads
from report.document.blocks import Block, Column, Figure, Place, Section, Table, number, records, word
from report.document.numbers import significant, span, spread, whole
from report.figures import style
from report.figures.lines import styles_of
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(130)

Styles = dict[str, dict[str, Any]]

PANEL, GROWING = 3.0, 4.5  # inches
YARDSTICK: dict[str, Any] = {"color": "#888888", "linewidth": 1.0, "zorder": 0.5}
BESIDE: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 7.5, "color": "#666666"}


def section(results: Results) -> Section | None:
    if not results.rows["cholesky_s"].notna().any():
        return None
    cases = load_cases(results)
    blocks: list[Block] = [_machine(results.rows)]
    if len(cases):
        blocks = [_ratios(cases, _from_scene(results)), *blocks, _figure(results, cases)]
    return Section("Relative speed", blocks)


def _from_scene(results: Results) -> dict[tuple[float, float, str], float]:
    """By threads, n and method: the total of one load case from the scene on, relative to that of the fastest
    library, the median over the scenes.
    """
    found = {}
    for threads in results.rows["threads"].dropna().unique():
        lines = roads(results.of_threads(threads))
        if lines.empty:
            continue
        library = lines[~lines["in_house"]].groupby("scene")["total_1_s"].min()
        lines = lines.assign(ratio=lines["total_1_s"] / lines["scene"].map(library))
        medians = lines.groupby(["n", "method"])["ratio"].median()
        for line in records(medians.reset_index()):
            found[float(threads), float(line["n"]), str(line["method"])] = line["ratio"]
    return found


def _ratios(cases: pd.DataFrame, from_scene: Mapping[tuple[float, float, str], float]) -> Table:
    lines = []
    for (n, threads), group in cases.groupby(["n", "threads"]):
        for method in in_order(group, "method"):
            mine = group[group["method"] == method]
            line: dict[str, Any] = {"n": n, "threads": threads, "method": method}
            line |= {"scenes": mine["scene"].nunique(), "runs": len(mine)}
            for name in ("to_library", "total_to_library", "to_cholesky"):
                by_scene = mine.groupby("scene")[name].median()
                line |= {name: by_scene.median(), f"{name}_least": mine[name].min()}
                line |= {f"{name}_most": mine[name].max()}
            lines.append(
                line
                | {
                    "scene_to_library": from_scene.get(
                        (float(group["threads"].iloc[0]), float(group["n"].iloc[0]), method)
                    )
                }
            )
    rivals = ", ".join(in_order(cases[~cases["in_house"]], "method")) or "none"
    caption = (
        "*Relative times*: the time per load case (set-up + solve + form) over that of the fastest library "
        "on the same scene, in any of its forms, the median of its repeats; the same with the preparation of "
        "each, paid once per assembly; from the scene on, with what makes the matrices (see *From scene to "
        "answer*); and the time per load case over one Cholesky factorisation of Q, measured in the same "
        "process after the solve. The median over the scenes, and in brackets the range of all runs; 0.1 is "
        f"ten times as fast. Only answers within the limit count. Libraries: {rivals}."
    )
    columns = [
        number("n", "n", whole),
        number("threads", "threads", whole),
        word("solver (form)", "method"),
        number("scenes", "scenes", whole),
        Column("per load case, relative to the fastest library", spread("to_library")),
        Column("with preparation, relative to the fastest library", spread("total_to_library")),
        number("from the scene on, relative to the fastest library", "scene_to_library"),
        Column("per load case, in Cholesky factorisations of Q", spread("to_cholesky")),
    ]
    return Table("speed-ratios", caption, pd.DataFrame(lines), columns)


def _machine(rows: pd.DataFrame) -> Table:
    lines = []
    for (n, threads), group in rows[rows["cholesky_s"].notna()].groupby(["n", "threads"]):
        m = float(group["m"].iloc[0])
        line: dict[str, Any] = {"n": n, "m": m, "threads": threads, "runs": len(group)}
        for name in ("cholesky_s", "product_s"):
            low, middle, high = group[name].quantile([0.1, 0.5, 0.9])
            line |= {f"{name}_low": low, name: middle, f"{name}_high": high}
        line["gflops"] = m**3 / 3 / line["cholesky_s"] / 1e9
        line["gb_per_s"] = 8 * m**2 / line["product_s"] / 1e9
        lines.append(line)
    columns = [
        number("n", "n", whole),
        number("m", "m", whole),
        number("threads", "threads", whole),
        number("runs", "runs", whole),
        Column("Cholesky of Q, s (10 to 90 %)", _range("cholesky_s")),
        number("10⁹ operations/s", "gflops"),
        Column("product Qv, s (10 to 90 %)", _range("product_s")),
        number("GB/s read", "gb_per_s"),
    ]
    caption = (
        "*What the machine can do*: a Cholesky factorisation of Q (m³/3 operations) and a product Qv (one "
        "pass over 8m² bytes), measured after each solve in its process, the median of three; here the "
        "medians over all runs."
    )
    return Table("speed-yardsticks", caption, pd.DataFrame(lines), columns)


def _range(name: str) -> Callable[[Mapping[str, Any]], str]:
    def text(line: Mapping[str, Any]) -> str:
        low, high = (significant(line[f"{name}_{end}"], 2) for end in ("low", "high"))
        return f"{significant(line[name])} ({span(low, high)})"

    return text


def _figure(results: Results, cases: pd.DataFrame) -> Figure:
    """One panel per size against the active contacts; if each size has one scene, one panel against n."""
    most = cases["threads"].max()
    results, cases = results.of_threads(most), cases[cases["threads"] == most]
    drawn = drawn_cells(results)
    styles = styles_of(results, drawn[drawn["method"].isin(cases["method"])])
    sizes = sorted(cases["n"].unique())
    growing = len(sizes) > 1 and cases["scene"].nunique() == len(sizes)
    drawing = style.figure(GROWING if growing else PANEL * len(sizes) + 0.3)
    if growing:
        _against_size(drawing.subplots(), cases, styles)
    else:
        panels = drawing.subplots(len(sizes), 1, squeeze=False)[:, 0]
        for axes, n in zip(panels, sizes, strict=True):
            _against_contacts(axes, cases[cases["n"] == n], styles)
        panels[-1].set_xlabel("active contacts")
    drawing.legend(handles=style.legend_entries(styles), loc="outside right upper", handlelength=3.2)
    against = "size" if growing else "active contacts"
    caption = (
        f"*Time per load case in Cholesky factorisations of Q* of the same process, against the {against}; "
        "answers within the limit only, medians of the repeats, at the largest number of threads."
        f"{omission_note(results)}"
    )
    return Figure("speed", caption, drawing)


def _against_contacts(axes: Axes, cases: pd.DataFrame, styles: Styles) -> None:
    product = (cases["product_s"] / cases["cholesky_s"]).median()
    _lines(axes, cases, "active", styles)
    for height, what in ((1.0, "one Cholesky of Q"), (product, "one product Qv")):
        axes.axhline(height, **YARDSTICK)
        axes.annotate(what, (1, height), (3, 0), xycoords=("axes fraction", "data"), **BESIDE)
    style.percent_above(axes, cases["m"].iloc[0])
    axes.set_title(f"n = {cases['n'].iloc[0]:.0f}", pad=5)


def _against_size(axes: Axes, cases: pd.DataFrame, styles: Styles) -> None:
    products = (cases["product_s"] / cases["cholesky_s"]).groupby(cases["n"]).median()
    _lines(axes, cases, "n", styles)
    for heights, what in ((0 * products + 1, "one Cholesky of Q"), (products, "one product Qv")):
        axes.plot(heights.index, heights, **YARDSTICK)
        axes.annotate(what, (heights.index[-1], heights.iloc[-1]), (8, 0), **BESIDE)
    axes.set_xscale("log")
    axes.set_xticks(products.index.tolist(), [f"{n:.0f}" for n in products.index])
    axes.minorticks_off()
    axes.set_xlabel("n")


def _lines(axes: Axes, cases: pd.DataFrame, along: str, styles: Styles) -> None:
    for method, look in styles.items():
        line = cases[cases["method"] == method].groupby(along)["to_cholesky"].median()
        axes.plot(line.index, line.to_numpy(), **look)
    axes.set(yscale="log", ylabel="time, in Cholesky factorisations")
    style.plain_log(axes.yaxis)
