"""Sparse problems drawn at random: ours beside the fastest library, family by family."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from harness.results.schema import SPARSE
from report.analysis.standings import NOT_RUN
from report.document.blocks import Column, Section, Table, number, word
from report.document.numbers import significant, whole
from report.results.reader import Results
from report.results.rows import in_order

INF = float("inf")


def section(results: Results) -> Section | None:
    """A line per method of ours, family and number of unknowns, and one of all of them."""
    cells = results.cells
    cells = cells[cells["scene"].str.startswith(SPARSE) & (cells["status"] != "unsupported")]
    ours = cells[cells["owner"] == "ours"]
    if ours.empty:
        return None
    within = cells[cells["verdict"] == "within"]
    libraries = cells[(cells["owner"] == "library") & ~cells["status"].isin(NOT_RUN)]
    seconds = libraries["total_s"].where(libraries["verdict"] == "within", INF)
    library = seconds.groupby(libraries["scene"]).min()
    solved = within[within["status"] == "solved"].groupby(["method", "scene"])["total_s"].min()
    lines: list[dict[str, Any]] = []
    for method in in_order(ours, "method"):
        scenes = ours.loc[ours["method"] == method, "scene"].drop_duplicates()
        frame = pd.DataFrame({"seconds": [solved.get((method, scene), INF) for scene in scenes]})
        times = frame["seconds"] / [library.get(scene, np.nan) for scene in scenes]
        frame["times"] = times.where(frame["seconds"] < INF, INF)
        frame["problems"] = [scene.removeprefix(SPARSE).rpartition("-")[0] for scene in scenes]
        kinds = [_figures(kind) for _, kind in frame.groupby("problems", sort=False)]
        every = _figures(frame) | {"problems": "all", "slowest": max(line["slowest"] for line in kinds)}
        lines += [{"method": method} | line for line in (*kinds, every)]
    columns = [word("solver (form)", "method"), word("family and unknowns", "problems")]
    columns += [number("problems", "count", whole), number("solved and within", "within", whole)]
    columns += [
        Column("median, s", partial(_shown, "seconds")),
        Column("slowest / median", partial(_shown, "slowest")),
        Column("to the fastest library, median", partial(_shown, "median")),
        Column("the same, worst", partial(_shown, "worst")),
    ]
    caption = (
        f"*Sparse problems, beside the fastest library within {results.limit}*, preparation included; ∞: not "
        "solved, or not within; 0: no library is within, –: none was run. In the line of all, slowest / "
        "median is the largest."
    )
    return Section("Sparse problems", [Table("sparse", caption, pd.DataFrame(lines), columns, keys=2)])


def _figures(problems: pd.DataFrame) -> dict[str, Any]:
    """The line of some problems, from their seconds and the times as long as the fastest library takes."""
    seconds, times = problems["seconds"], problems["times"]
    within = int(np.isfinite(seconds).sum())
    slowest = seconds.max() / seconds.median() if within == len(problems) else INF
    line = {"problems": problems["problems"].iloc[0], "count": len(problems), "within": within}
    middles = {"seconds": seconds.median(), "slowest": slowest}
    return line | middles | {"median": times.median(), "worst": times.max()}


def _shown(name: str, line: Any) -> str:
    return "∞" if line[name] == INF else significant(line[name])
