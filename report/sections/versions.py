"""Versions of a library side by side."""

from __future__ import annotations

import re

import pandas as pd
from packaging.version import InvalidVersion, Version

from report.analysis.checks import asked_for
from report.analysis.comparison import MISSING, WORSE, compared
from report.analysis.standings import seconds_text
from report.document.blocks import Block, Column, Section, Table, Text, number, records, word
from report.document.escape import QUOTED, file_name, short
from report.document.numbers import counted, out_of, power, tidy_power, whole
from report.results.reader import Results
from report.results.rows import cells_of, form_place

MEANING = (
    "Worse than the version above: a verdict lost, an error more than ten times as large, or more than 10 % "
    "more seconds per load case, beyond their spread; fewer than three repeats are taken to vary by 15 %. A "
    "version that failed could not be installed, or has another interface than its adapter calls."
)
LONGEST = 300  # characters of a reason
MAX_DIGITS_LOST = 1.0  # an error ten times as large
MAX_SLOWDOWN = 1.1


def section(results: Results) -> Section | None:
    """For results with several versions of one solver on one scene: a table per solver."""
    blocks: list[Block] = []
    for solver, cells in of_versions(results).items():
        blocks += _blocks(solver, cells)
    return Section("Versions", [Text(MEANING), *blocks]) if blocks else None


def _blocks(solver: str, cells: pd.DataFrame) -> list[Block]:
    worse, compared_count = cells["group"] == WORSE, int(cells["group"].notna().sum())
    lost = cells["verdict"] == "no_answer"
    cells = cells.assign(
        verdict=cells["verdict"].str.replace("_", " "),
        against=worse.map({True: "worse: ", False: ""}) + cells["change"].fillna(""),
        seconds=[seconds_text(cell) for cell in records(cells)],
    )
    columns = [
        word("scene", "scene"),
        word("form", "what"),
        word("version", "solver_version"),
        Column("s", lambda line: str(line["seconds"])),
        number("iterations", "iterations", whole),
        number("error, mm", "displacement_error_mm", lambda error: power(error, 2)),
        word("verdict", "verdict"),
        word("against the version above", "against"),
    ]
    count = f"{out_of(worse.sum(), compared_count, 'measurement')} became worse"
    count += f", {counted(int(lost.sum()), 'measurement')} without an answer" if lost.any() else ""
    blocks: list[Block] = [Table(f"versions-{file_name(solver)}", f"*{solver}*: {count}.", cells, columns)]
    failed = records(cells[cells["status"].isin(["failed", "crashed"]) & (cells["message"] != "")])
    first = [short(cell["message"].partition(QUOTED["\n"])[0], LONGEST) for cell in failed]
    reasons = [
        f"- {solver} {cell['solver_version']}: {line}" for cell, line in zip(failed, first, strict=True)
    ]
    return [*blocks, Text("\n".join(dict.fromkeys(reasons)))] if reasons else blocks


def of_versions(results: Results) -> dict[str, pd.DataFrame]:
    """The cells of each solver that was measured in several versions on one scene, version below version.

    Adds `what`, a name of the measurement without scene and solver; `group` and `change`, how a version
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
    (_, older), *later = sorted(rows.groupby("solver_version"), key=lambda pair: _versions(str(pair[0])))
    parts = [cells_of(older, ["measurement"])]
    for _, newer in later:
        change = compared(older, newer, True, MAX_DIGITS_LOST, MAX_SLOWDOWN).set_index("measurement")
        change = change.loc[change["verdict_old"] != MISSING, ["group", "change"]]
        parts.append(cells_of(newer, ["measurement"]).join(change, on="measurement"))
        older = pd.concat([older[~older["measurement"].isin(newer["measurement"])], newer])
    lines = pd.concat(parts, ignore_index=True)
    order = {name: place for place, name in enumerate(rows["measurement"].unique())}
    return lines.sort_values("measurement", key=lambda names: names.map(order), kind="stable")


def _what(rows: pd.DataFrame) -> pd.Series[str]:
    """The form, the variant without the version, options that differ in it, and tolerance and threads where
    a solver has several.
    """
    cut = asked_for(rows)
    pairs = zip(rows["variant"], rows["solver_version"], cut, strict=True)
    base = [variant.removesuffix(v).strip() if named else variant for variant, v, named in pairs]
    words = rows["form"] + [f" {name}" if name else "" for name in base]
    differ = rows.groupby([rows["solver"], words])["settings"].transform("nunique") > 1
    several = rows.groupby("solver")[["tolerance", "threads_asked"]].transform("nunique") > 1
    chosen = several["tolerance"] & (rows["searched"] != 1.0)
    words += (" " + rows["settings"]).where(differ & (rows["settings"] != ""), "")
    words += (" " + rows["tolerance"].map(tidy_power)).where(chosen, "")
    return words + (" × " + rows["threads_asked"].map("{:.0f}".format)).where(several["threads_asked"], "")


def _versions(text: str) -> list[Version]:
    """The versions in a text, by which it is sorted: of "VERSION", or of each "NAME==VERSION" in it."""
    return [_version(word.rpartition("==")[2]) for word in text.split()]


def _version(word: str) -> Version:
    """The version that a word is, or has in its numbers."""
    try:
        return Version(word)
    except InvalidVersion:
        return Version(".".join(re.findall(r"\d+", word)) or "0")
