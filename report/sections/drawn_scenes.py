"""Scenes drawn at random: every solve time, worst cases beside medians, failures, other tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Drawing

from harness.results.schema import ANSWERED
from report.document.blocks import Block, Column, Figure, Place, Section, Table, number, word
from report.document.numbers import MISSING, listed, power, spread, tidy_power, whole
from report.figures import style, times_panel
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(30, "drawn")

PANEL = 3.0  # inches
DOT: dict[str, Any] = {"markersize": 5.5, "markeredgewidth": 0.0, "linestyle": ""}
COMPARED, RIVAL, SLOWER = "newton", "mprgp", 1.5


def section(results: Results) -> Section | None:
    cells = results.cells[results.cells["status"] != "unsupported"].dropna(subset=["n", "tolerance"])
    if cells.empty:
        return None
    answered = cells["verdict"].isin(ANSWERED)
    seconds = (cells["setup_s"].fillna(0.0) + cells["solve_s"]).where(answered)
    good = (cells["status"] == "solved") & (cells["verdict"] == "within")
    cells = cells.assign(load_case_s=seconds, good=good)
    usual = _usual(cells)
    blocks: list[Block] = [_figure(cells[usual]), _times(cells[usual], results.limit)]
    if not cells[usual]["good"].all():
        blocks.append(_failures(cells[usual & ~cells["good"]]))
    if not usual.all():
        blocks.append(_tolerances(cells, usual))
    return Section("Scenes drawn at random", blocks)


def _usual(cells: pd.DataFrame) -> pd.Series[bool]:
    """Whether a cell has the usual tolerance of its method and size: of most scenes, then the tightest."""
    runs = cells.groupby(["n", "method", "tolerance"]).size().reset_index(name="runs")
    most = runs.sort_values(["runs", "tolerance"], ascending=[False, True]).drop_duplicates(["n", "method"])
    usual = cells[["n", "method"]].merge(most, how="left", on=["n", "method"])["tolerance"]
    return cells["tolerance"] == usual.to_numpy()


def _figure(cells: pd.DataFrame) -> Figure:
    """One colour for each solver and form: that of the marker's face elsewhere."""
    looks = style.line_styles(cells)
    styles = {
        name: looks[name] | DOT | {"color": looks[name]["markerfacecolor"]}
        for name in in_order(cells, "method")
    }
    panels = [*cells.groupby("n")]
    drawing: Drawing = style.figure(PANEL * len(panels) + 0.3)
    places = drawing.subplots(len(panels), 1, squeeze=False)[:, 0]
    for axes, (n, of_size) in zip(places, panels, strict=True):
        times_panel.panel(axes, of_size, styles)
        axes.set_ylabel("time of the solve, s")
        axes.set_title(f"n = {n:.0f}, {of_size['scene'].nunique()} scenes", pad=5)
    places[-1].set_xlabel("closed contacts")
    handles = [*style.legend_entries(styles), *times_panel.entries(cells)]
    drawing.legend(handles=handles, loc="outside right upper")
    tolerances = listed([tidy_power(value) for value in sorted(cells["tolerance"].unique())])
    caption = (
        "*Seconds of every solve* (set-up + solve) against the closed contacts: the number below, the "
        f"percentage of m above. Tolerance {tolerances}."
    )
    return Figure("drawn", caption, drawing)


def _times(cells: pd.DataFrame, limit: str) -> Table:
    lines = []
    for n, of_size in cells.groupby("n"):
        for method in in_order(of_size, "method"):
            mine = of_size[of_size["method"] == method]
            good = mine[mine["good"]].sort_values("load_case_s")
            line: dict[str, Any] = {"n": n, "method": method, "scenes": len(mine), "within": len(good)}
            line |= {"median_s": good["load_case_s"].median(), "worst_s": good["load_case_s"].max()}
            line |= {"worst_scene": good["scene"].iloc[-1] if len(good) else "", **_beside(mine, of_size)}
            lines.append(line | {"worst_to_median": line["worst_s"] / line["median_s"]})
    caption = (
        f"*Medians and worst cases* of the answers that are reported solved and within {limit}. Last column: "
        f"on how many scenes {COMPARED} takes at most {SLOWER:g} times as long as {RIVAL} in the same form; "
        "failures count as infinitely slow."
    )
    columns = [
        number("n", "n", whole),
        word("solver (form)", "method"),
        number("scenes", "scenes", whole),
        number("solved and within", "within", whole),
        number("median, s", "median_s"),
        number("worst, s", "worst_s"),
        number("worst / median", "worst_to_median"),
        Column(f"≤ {SLOWER:g} × {RIVAL}", _of_compared),
    ]
    return Table("drawn", caption, pd.DataFrame(lines), columns, keys=2)


def _beside(mine: pd.DataFrame, of_size: pd.DataFrame) -> dict[str, float]:
    """On how many scenes both were run, and on how many of these the one is not much slower."""
    first = mine.iloc[0]
    rival = of_size[(of_size["solver"] == RIVAL) & (of_size["form"] == first["form"])]
    if first["solver"] != COMPARED or rival.empty:
        return {}
    times = [
        each["load_case_s"].where(each["good"], inf).groupby(each["scene"]).min() for each in (mine, rival)
    ]
    own, other = times[0].align(times[1], join="inner")
    return {"compared": len(own), "not_slower": int(((own < inf) & (own <= SLOWER * other)).sum())}


def _of_compared(line: Mapping[str, Any]) -> str:
    known = line.get("compared")
    return f"{line['not_slower']:.0f} of {known:.0f}" if known is not None and known == known else MISSING


def _failures(cells: pd.DataFrame) -> Table:
    columns = [
        word("scene", "scene"),
        word("solver (form)", "method"),
        Column("status", lambda line: str(line["status"]).replace("_", " "), "left"),
        Column("verdict", lambda line: str(line["verdict"]).replace("_", " "), "left"),
        number("closed contacts", "active", whole),
        number("error, mm", "displacement_error_mm", power),
        number("s", "load_case_s"),
    ]
    names = [
        "scene",
        "method",
        "tolerance",
        "status",
        "verdict",
        "active",
        "displacement_error_mm",
        "load_case_s",
    ]
    caption = "*Not solved, or not within the limit.*"
    return Table("drawn-failures", caption, cells.sort_values(["n", "scene", "method"])[names], columns)


def _tolerances(cells: pd.DataFrame, usual: pd.Series[bool]) -> Table:
    """The time at each other tolerance over that at the usual one, on the scenes with both."""
    base = cells[usual].set_index(["scene", "method"])["load_case_s"]
    others = cells[~usual].join(base.rename("base_s"), on=["scene", "method"])
    others = others.assign(ratio=others["load_case_s"] / others["base_s"])
    tolerances = sorted(others["tolerance"].unique(), reverse=True)
    lines = []
    for n, of_size in others.groupby("n"):
        for method in in_order(of_size, "method"):
            mine = of_size[of_size["method"] == method]
            line: dict[str, Any] = {"n": n, "method": method, "scenes": mine["scene"].nunique()}
            for value in tolerances:
                ratios = mine.loc[mine["tolerance"] == value, "ratio"]
                line |= {f"{value:g}": ratios.median(), f"{value:g}_least": ratios.min()}
                line |= {f"{value:g}_most": ratios.max()}
            lines.append(line)
    usually = listed([tidy_power(value) for value in sorted(cells.loc[usual, "tolerance"].unique())])
    caption = f"*Time at other tolerances* over that at {usually}: the median (least to most)."
    columns = [number("n", "n", whole), word("solver (form)", "method"), number("scenes", "scenes", whole)]
    columns += [Column(tidy_power(value), spread(f"{value:g}")) for value in tolerances]
    return Table("drawn-tolerances", caption, pd.DataFrame(lines), columns, keys=2)
