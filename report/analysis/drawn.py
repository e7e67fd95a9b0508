"""What the figures show of the cells; the tables of the scenes hold all of them."""

from __future__ import annotations

import pandas as pd

from report.document.numbers import counted, listed
from report.results.labels import in_order
from report.results.reader import Results

from .standings import standings

#: Of a solver and form with more variants than this, those that were run on few scenes are not drawn.
VARIANTS = 3
NOT_RUN = ("unsupported", "not_run")


def sidelined(results: Results) -> pd.DataFrame:
    """The cells not drawn: of a solver with more than VARIANTS variants of a form, the variants run on
    fewer than half as many scenes as the one run on most.
    """
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    lines = cells.groupby(["solver", "form", "method"])["scene"].nunique().reset_index()
    of_solver = lines.groupby(["solver", "form"])["scene"]
    rare = (of_solver.transform("size") > VARIANTS) & (2 * lines["scene"] < of_solver.transform("max"))
    return cells[cells["method"].isin(lines.loc[rare, "method"])]


def drawn(results: Results) -> pd.DataFrame:
    """The cells that figures show: those that were run and are not sidelined."""
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    return cells.drop(sidelined(results).index)


def best(results: Results) -> pd.DataFrame:
    """The cells drawn, of several tolerances of a method those of the one that stands best."""
    cells, table = drawn(results), standings(results)
    return cells[cells["label"].isin(table["label"][~table["method"].duplicated()] if len(table) else [])]


def of_tolerances(results: Results) -> str:
    """A sentence for the captions of figures of the `best`, empty where every method has one tolerance."""
    several = drawn(results).groupby("method")["tolerance"].nunique() > 1
    words = " Of several tolerances, the one within the limit on most scenes, then the fastest."
    return words if several.any() else ""


def left_out(results: Results) -> str:
    """A sentence for the captions, empty where every variant is drawn."""
    missing = sidelined(results)
    if missing.empty:
        return ""
    solvers = listed(in_order(missing, "solver"))
    count = counted(missing["method"].nunique(), "variant")
    return f" Not drawn: {count} of {solvers} run on fewer than half of its scenes; the tables have them."


def sizes(results: Results) -> list[int]:
    """The sizes drawn: one of a single scene is left out beside sizes of more than two."""
    most = max((len(scenes(results, n)) for n in results.sizes), default=0)
    return [n for n in results.sizes if len(scenes(results, n)) > 1 or most < 3]


def scenes(results: Results, n: int) -> list[str]:
    """The scenes of a size, by their active contacts."""
    of_size = results.of_size(n).drop_duplicates("scene")
    return of_size.sort_values(["active", "scene"])["scene"].tolist()


def middle_scene(results: Results, n: int) -> str | None:
    """Of the scenes of a size, the one with the middle number of active contacts."""
    of_size = scenes(results, n)
    return of_size[len(of_size) // 2] if of_size else None


def middle_scenes(results: Results) -> list[str]:
    """The middle scene of each size drawn."""
    return [scene for n in sizes(results) if (scene := middle_scene(results, n))]
