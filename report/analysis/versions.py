"""Versions of one solver side by side: what became worse from one to the next.

Rows measured by `run --with` end their variant in the version.
"""

from __future__ import annotations

import re

import pandas as pd

from report.document.numbers import tidy_power
from report.results.cells import cells_of
from report.results.labels import form_place
from report.results.reader import Results

from .comparison import MISSING, compared

MAX_DIGITS_LOST = 1.0  # an error ten times as large
MAX_SLOWDOWN = 1.1


def asked_for(rows: pd.DataFrame) -> pd.Series[bool]:
    """Whether the version of a row is the one that its variant names."""
    pairs = zip(rows["variant"], rows["solver_version"], strict=True)
    return pd.Series([bool(v) and variant.endswith(v) for variant, v in pairs], rows.index, dtype=bool)


def of_versions(results: Results) -> dict[str, pd.DataFrame]:
    """Of each solver measured in several versions on one scene, its cells, version below version.

    Adds `what`, the form and what else distinguishes measurements, and `group` and `change`, how a version
    differs from the one above, as in a comparison of runs; missing for the first.
    """
    rows = results.rows[(results.rows["status"] != "unsupported") & (results.rows["solver_version"] != "")]
    if rows["solver_version"].nunique() < 2:
        return {}
    rows = rows.assign(what=_what(rows), place=rows["form"].map(form_place))
    rows = rows.sort_values(["n", "active", "scene", "place", "what"], kind="stable")
    rows["measurement"] = rows["scene"] + " " + rows["solver"] + " " + rows["what"]
    several = rows.groupby("measurement")["solver_version"].transform("nunique") > 1
    return {str(solver): _side_by_side(mine) for solver, mine in rows[several].groupby("solver")}


def _side_by_side(rows: pd.DataFrame) -> pd.DataFrame:
    (_, before), *later = sorted(rows.groupby("solver_version"), key=lambda pair: _numbers(str(pair[0])))
    parts = [cells_of(before, ["measurement"])]
    for _, own in later:
        change = compared(before, own, True, MAX_DIGITS_LOST, MAX_SLOWDOWN).set_index("measurement")
        change = change.loc[change["verdict_old"] != MISSING, ["group", "change"]]
        parts.append(cells_of(own, ["measurement"]).join(change, on="measurement"))
        before = pd.concat([before[~before["measurement"].isin(own["measurement"])], own])
    lines = pd.concat(parts, ignore_index=True)
    order = {name: place for place, name in enumerate(rows["measurement"].unique())}
    return lines.sort_values("measurement", key=lambda names: names.map(order), kind="stable")


def _what(rows: pd.DataFrame) -> pd.Series[str]:
    """The form, the variant without the version, and tolerance and threads where a solver has several."""
    cut = asked_for(rows)
    pairs = zip(rows["variant"], rows["solver_version"], cut, strict=True)
    base = [variant.removesuffix(v).strip() if named else variant for variant, v, named in pairs]
    words = rows["form"] + [f" {name}" if name else "" for name in base]
    several = rows.groupby("solver")[["tolerance", "threads"]].transform("nunique") > 1
    chosen = several["tolerance"] & (rows["searched"] != 1.0)
    words += (" " + rows["tolerance"].map(tidy_power)).where(chosen, "")
    return words + (" × " + rows["threads"].map("{:.0f}".format)).where(several["threads"], "")


def _numbers(version: str) -> list[int]:
    """The numbers of a version, or of "NAME==VERSION"."""
    return [int(digits) for digits in re.findall(r"\d+", re.sub(r"\S*==", "", version))]
