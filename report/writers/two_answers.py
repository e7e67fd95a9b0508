"""Writes two answers on one junction: comparison.md, maps, tables of contacts and fasteners, and index.html.

Reads solution.json and solution.npz of two directories, nothing else.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from report.document.blocks import Block, Column, Figure, Section, Table, Text, number, word
from report.document.escape import csv_frame, quoted
from report.document.numbers import significant, whole
from report.figures.answer import Answer, gap_maps, pair_name
from report.figures.maps import Array
from report.page.answer import two_answers_data
from report.page.write import write as write_page

from .pages import written


def write(directory: Path, folders: list[str]) -> tuple[Path, pd.DataFrame]:
    """Write DIRECTORY/comparison.md, with index.html, from two of its folders.

    Returns the path of the former and the figures per pair.
    """
    first, second = answers = [_read(directory / folder) for folder in folders]
    names = [str(record["scene"]) for record, _ in answers]
    if names[0] == names[1]:
        names = folders
    pairs = pd.DataFrame([_pair(pair, first[1], second[1]) for pair in first[0]["pairs"]])
    both = "the first scene, then the second"
    blocks: list[Block] = [
        Text(f"First: {first[0]['title']} ([answer]({folders[0]}/answer.md))."),
        Text(f"Second: {second[0]['title']} ([answer]({folders[1]}/answer.md))."),
        Table("pairs", f"*Gaps, mm, and contact forces, N: {both}.*", pairs, _columns()),
    ]
    if "contact_nodes" in first[1]:
        captions = {
            "gaps": "*The remaining gaps.* Outlined in white: closed contacts.",
            "difference": "*Red: the gap is larger in the second scene. Blue: it is smaller.*",
        }
        blocks += [
            Figure(name, captions[name], drawing) for name, drawing in gap_maps(answers, names).items()
        ]
    fasteners = _fasteners(first[0], second[0])
    if len(fasteners):
        columns = {"x, mm": "x_mm", "y, mm": "y_mm", "first": "first_N", "second": "second_N"}
        shown = [word("kind", "kind"), word("contact", "contact")]
        shown += [number(heading, name) for heading, name in columns.items()]
        blocks.append(Table("fasteners", f"*Force in each fastener, N: {both}.*", fasteners, shown))
    csv_frame(_contacts(first, second)).to_csv(directory / "contacts.csv", index=False)
    blocks.append(Text("Every contact: [contacts.csv](contacts.csv)."))
    title = f"{names[0]} and {names[1]}"
    data = two_answers_data([first[0], second[0]], [first[1], second[1]], names)
    write_page(directory / "index.html", title, data)
    section = Section("Two scenes on one junction", blocks)
    return written(directory / "comparison.md", title, [section]), pairs


def _read(folder: Path) -> Answer:
    record = quoted(json.loads((folder / "solution.json").read_text("utf-8")))
    with np.load(folder / "solution.npz") as saved:
        return record, {name: saved[name] for name in saved.files}


def _pair(pair: dict[str, Any], one: dict[str, Array], other: dict[str, Array]) -> dict[str, Any]:
    """The figures of a pair of parts in both scenes."""
    own = slice(pair["start"], pair["stop"])
    line: dict[str, Any] = {"contact": pair_name(pair)}
    for side, arrays in (("first", one), ("second", other)):
        gap, force = arrays["gap_after"][own], arrays["lam"][own]
        line |= {
            f"initial_{side}_mm": arrays["gap_before"][own].max(),
            f"largest_{side}_mm": gap.max(),
            f"mean_{side}_mm": gap.mean(),
            f"closed_{side}": int((force > 0).sum()),
            f"force_{side}_N": float(np.nansum(force)),
        }
    change = other["gap_after"][own] - one["gap_after"][own]
    closed, opened = (np.maximum(0.0, most) + 0.0 for most in (-change.min(), change.max()))  # no -0
    return line | {"most_closed_mm": closed, "most_opened_mm": opened}


def _columns() -> list[Column]:
    def both(heading: str, name: str, show: Callable[[object], str] = significant) -> Column:
        first, second = name.format("first"), name.format("second")
        return Column(heading, lambda row: f"{show(row[first])}, {show(row[second])}")

    return [
        word("contact", "contact"),
        both("largest initial gap", "initial_{}_mm"),
        both("largest gap left", "largest_{}_mm"),
        both("mean", "mean_{}_mm"),
        both("closed contacts", "closed_{}", whole),
        both("sum of forces", "force_{}_N"),
        number("closed further by up to", "most_closed_mm"),
        number("opened by up to", "most_opened_mm"),
    ]


def _fasteners(one: dict[str, Any], other: dict[str, Any]) -> pd.DataFrame:
    """One line per place, contact and kind of fastener in either scene; several on one node are added."""
    forces: dict[tuple[Any, ...], list[float]] = {}
    for side, record in enumerate((one, other)):
        for entry in record["fasteners"]:
            key = entry["kind"], pair_name(entry), entry["x"], entry["y"]
            both = forces.setdefault(key, [np.nan, np.nan])
            both[side] = np.nan_to_num(both[side]) + entry["force_N"]
    names = ["kind", "contact", "x_mm", "y_mm", "first_N", "second_N"]
    return pd.DataFrame([(*key, *both) for key, both in forces.items()], columns=names)


def _contacts(first: Answer, second: Answer) -> pd.DataFrame:
    """One line per contact: where it is, and its gaps and forces in both scenes."""
    (record, one), (_, other) = first, second
    spans = [(pair_name(pair), pair["stop"] - pair["start"]) for pair in record["pairs"]]
    table = pd.DataFrame({"contact": [name for name, count in spans for _ in range(count)]})
    if "contact_nodes" in one:
        table["x_mm"], table["y_mm"] = one["contact_nodes"].T
    columns = {"gap_before": "gap_before_{}_mm", "gap_after": "gap_after_{}_mm", "lam": "force_{}_N"}
    for name, column in columns.items():
        table[column.format("first")], table[column.format("second")] = one[name], other[name]
    return table.assign(change_mm=other["gap_after"] - one["gap_after"])
