"""Which cells the figures show; the tables by scene have all of them."""

from __future__ import annotations

import pandas as pd

from report.document.numbers import counted, listed
from report.results.labels import in_order
from report.results.reader import Results

from .standings import standings

#: If a solver has more variants of a form than this, those run on few scenes are not drawn.
VARIANTS = 3
NOT_RUN = ("unsupported", "not_run")


def rare_variants(results: Results) -> pd.DataFrame:
    """The cells not drawn: if a solver has more than VARIANTS variants of a form, those run on fewer than
    half as many scenes as the one run on most.
    """
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    lines = cells.groupby(["solver", "form", "method"])["scene"].nunique().reset_index()
    of_solver = lines.groupby(["solver", "form"])["scene"]
    rare = (of_solver.transform("size") > VARIANTS) & (2 * lines["scene"] < of_solver.transform("max"))
    return cells[cells["method"].isin(lines.loc[rare, "method"])]


def drawn_cells(results: Results) -> pd.DataFrame:
    """The cells that figures show: those that were run, without rare variants."""
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    return cells.drop(rare_variants(results).index)


def best_tolerances(results: Results) -> pd.DataFrame:
    """The cells drawn, for each method those of its best tolerance."""
    cells, table = drawn_cells(results), standings(results)
    return cells[cells["label"].isin(table["label"][~table["method"].duplicated()] if len(table) else [])]


def with_rivals(cells: pd.DataFrame, methods: pd.Series[int]) -> pd.DataFrame:
    """The cells where two methods and more stand beside each other, and those of the largest size; all of
    them if that is nowhere the case.

    methods : how many stand beside each other, by the index of the cells
    """
    several = methods.reindex(cells.index) > 1
    return cells[several | (cells["n"] == cells["n"].max())] if several.any() else cells


def tolerance_note(results: Results) -> str:
    """A sentence for captions on `best_tolerances`; empty if every method has one tolerance."""
    several = drawn_cells(results).groupby("method")["tolerance"].nunique() > 1
    words = " Of several tolerances: the one within the limit on most scenes, then the fastest."
    return words if several.any() else ""


def omission_note(results: Results) -> str:
    """A sentence for captions; empty if every variant is drawn."""
    missing = rare_variants(results)
    if missing.empty:
        return ""
    solvers = listed(in_order(missing, "solver"))
    count = counted(missing["method"].nunique(), "variant")
    return f" Not drawn: {count} of {solvers} run on fewer than half of its scenes; the tables include them."


def sizes(results: Results) -> list[int]:
    """The sizes drawn: one with a single scene is omitted if another has more than two."""
    most = max((len(scenes(results, n)) for n in results.sizes), default=0)
    return [n for n in results.sizes if len(scenes(results, n)) > 1 or most < 3]


def scenes(results: Results, n: int) -> list[str]:
    """The scenes of one size by their active contacts."""
    of_size = results.of_size(n).drop_duplicates("scene")
    return of_size.sort_values(["active", "scene"])["scene"].tolist()


def middle_scene(results: Results, n: int) -> str | None:
    """The scene of one size with the median number of active contacts."""
    of_size = scenes(results, n)
    return of_size[len(of_size) // 2] if of_size else None


def middle_scenes(results: Results) -> list[str]:
    """The middle scene of each size drawn."""
    return [scene for n in sizes(results) if (scene := middle_scene(results, n))]
