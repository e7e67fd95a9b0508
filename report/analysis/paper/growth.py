"""How the cost of each method grows over the scenes of one joint: the measured side of Table 3."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

from report.analysis.fit import Exponent, exponent
from report.analysis.seconds import timed
from report.document.blocks import records
from report.document.numbers import as_number
from report.results.reader import Results

from .selection import METHODS, cells_of_paper, of_method, of_scaling


@dataclass(frozen=True)
class Quantity:
    """A column of the table: its name, unit, and the order in n that the paper gives each family."""

    key: str
    name: str
    ipm: float | None = None
    gi: float | None = None

    def theory(self, name: str) -> float | None:
        return self.ipm if name.startswith("IPM") else self.gi


QUANTITIES = (
    Quantity("preparation_s", "data preparation, s", 3, 3),
    Quantity("prepare_s", "of it the solver's own, s", 3, 3),
    Quantity("working_s", "working time, s", None, 3),
    Quantity("working_per_cg", "working time over CG iterations per system, s", 2.5, None),
    Quantity("iterations", "outer iterations", 0.5, None),
    Quantity("cg", "CG iterations"),
    Quantity("s_per_cg", "s per CG iteration", 2, None),
    Quantity("pivots", "pivots", None, 1),
    Quantity("s_per_pivot", "s per pivot", None, 2),
    Quantity("working_mib", "working memory, MiB", 2, 2),
)
TIMES = ("preparation_s", "prepare_s", "working_s")
SHORTEST = 1e-3  # seconds: a shorter time does not show how the work grows
#: Steps of building an assembly that the paper counts as data preparation.
PREPARATION = ("cholesky", "Q")


def measured(results: Results) -> pd.DataFrame:
    """One line per scaling scene and method: n, m, active, status, the QUANTITIES and the row's key.

    Data preparation: the Cholesky factor of K and Q (steps of the build) and the solver's own preparation.
    Working time: seconds per load case, if the answer is within the limit.
    """
    cells = timed(of_scaling(cells_of_paper(results)))
    build = _build_seconds(results.problems)
    lines = [
        _line(name, row, build.get(str(row["scene"]), {}))
        for name in METHODS
        for row in records(of_method(cells, name))
    ]
    return pd.DataFrame(lines)


def _build_seconds(problems: pd.DataFrame) -> dict[str, dict[str, float]]:
    if "scene" not in problems or "build_s" not in problems:
        return {}
    last = problems.drop_duplicates("scene", keep="last")
    return {s: b for s, b in zip(last["scene"], last["build_s"], strict=True) if isinstance(b, dict)}


def _line(name: str, row: dict[str, Any], build: dict[str, float]) -> dict[str, Any]:
    within = row["verdict"] == "within"
    seconds = as_number(row["load_case_s"]) if within else None
    solve = as_number(row["solve_s"]) if within else None
    iterations = as_number(row["iterations"]) if within else None
    cg = as_number(row["inner_iterations"]) if within and name.startswith("IPM") else None
    pivots = iterations if name.startswith("GI") else None
    prepare = as_number(row["prepare_s"])
    steps = [as_number(step) for step in (prepare, *map(build.get, PREPARATION))]
    known = [step for step in steps if step is not None]
    return {
        "method": name,
        **{key: row[key] for key in ("scene", "n", "m", "active", "status", "verdict", "key")},
        **{key: row[key] for key in ("time_limit_s", "peak_rss_mib", "data_mib", "load_case_s")},
        "preparation_s": sum(known) if len(known) == len(steps) else None,
        "prepare_s": prepare,
        "cholesky_s": build.get("cholesky"),
        "Q_s": build.get("Q"),
        "working_s": seconds,
        "working_per_cg": 2 * seconds * iterations / cg if seconds and iterations and cg else None,
        "iterations": iterations if name.startswith("IPM") else None,
        "cg": cg,
        "s_per_cg": solve / cg if solve and cg else None,
        "pivots": pivots,
        "s_per_pivot": solve / pivots if solve and pivots else None,
        "working_mib": as_number(row["working_mib"]),
    }


def fitted(lines: pd.DataFrame, name: str, key: str) -> Exponent | None:
    """The exponent in n of one quantity of one method."""
    if lines.empty:
        return None
    mine = lines[lines["method"] == name]
    values = [as_number(v) or 0.0 for v in mine[key]]
    if key in TIMES:
        values = [v if v >= SHORTEST else 0.0 for v in values]
    return exponent(mine["n"].tolist(), values)


def keys(lines: pd.DataFrame, *names: str) -> list[str]:
    return [] if lines.empty else lines.loc[lines["method"].isin(names), "key"].tolist()
