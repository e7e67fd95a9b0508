"""What the figures show of the cells; the tables of the scenes hold all of them."""

from __future__ import annotations

from typing import Any

import pandas as pd

from . import style
from .labels import in_order
from .numbers import counted
from .rows import Results

#: Of a solver and form with more variants than this, those that were run on few scenes are not drawn.
VARIANTS = 3
NOT_RUN = ("unsupported", "not_run")


def sidelined(results: Results) -> pd.DataFrame:
    """The cells not drawn: of a solver with more than VARIANTS variants of a form, the variants run on
    fewer than half as many scenes as the one run on most.
    """
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    lines = cells.groupby(["solver", "form", "series"])["scene"].nunique().reset_index()
    of_solver = lines.groupby(["solver", "form"])["scene"]
    rare = (of_solver.transform("size") > VARIANTS) & (2 * lines["scene"] < of_solver.transform("max"))
    return cells[cells["series"].isin(lines.loc[rare, "series"])]


def drawn(results: Results) -> pd.DataFrame:
    """The cells that figures show: those that were run and are not sidelined."""
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    return cells.drop(sidelined(results).index)


def styles_of(results: Results, cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The looks of the series in some of the cells drawn, the same in every figure of a report."""
    styles = style.line_styles(drawn(results))
    return {series: styles[series] for series in in_order(cells, "series")}


def tightest(results: Results) -> pd.DataFrame:
    """The cells drawn, at the tightest tolerance of each series: one line of a figure each."""
    cells = drawn(results)
    least = cells.groupby("series")["tolerance"].transform("min")
    return cells[(cells["tolerance"] == least) | least.isna()]


def left_out(results: Results) -> str:
    """A sentence for the captions, empty where every variant is drawn."""
    missing = sidelined(results)
    if missing.empty:
        return ""
    solvers = " and ".join(in_order(missing.assign(line=missing["solver"]), "line"))
    count = counted(missing["series"].nunique(), "variant")
    return f" Not drawn: {count} of {solvers} run on fewer than half of its scenes; the tables have them."


def middle_scene(results: Results, n: int) -> str | None:
    """Of the scenes of a size, the one with the middle number of active contacts."""
    scenes = _scenes(results.of_size(n))
    return scenes[len(scenes) // 2] if scenes else None


def middle_scenes(results: Results) -> list[str]:
    """The middle scene of each size; a size of one scene is left out beside sizes of more than two."""
    by_size = [_scenes(results.of_size(n)) for n in results.sizes]
    most = max(map(len, by_size), default=0)
    return [scenes[len(scenes) // 2] for scenes in by_size if len(scenes) > 1 or (scenes and most < 3)]


def _scenes(cells: pd.DataFrame) -> list[str]:
    return cells.drop_duplicates("scene").sort_values(["active", "scene"])["scene"].tolist()
