"""Writes two answers on one junction: comparison.md, maps, tables of contacts and fasteners, index.html."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from report.document.blocks import Block, Column, Figure, Section, Table, Text, number, word
from report.document.numbers import significant, whole
from report.figures.answer_maps import gap_maps
from report.page.answer_page_data import two_answers_data
from report.page.page_file import write as write_page
from report.results.answer_record import Answer, contacts, fasteners, pair_name, read
from report.results.series_results import Array
from report.writers.sections_writer import written

SIDES = ("first", "second")
CAPTIONS = {
    "gaps": "*The remaining gaps.* Outlined in white: closed contacts.",
    "difference": "*Red: the gap is larger in the second scene. Blue: it is smaller.*",
}


def write(directory: Path, folders: list[str]) -> tuple[Path, pd.DataFrame]:
    """Write DIRECTORY/comparison.md, with index.html, from two of its folders.

    Returns the path of the former and the figures per pair.
    """
    (first, one), (second, other) = answers = [read(directory / folder) for folder in folders]
    names = [str(record["scene"]) for record, _ in answers]
    if names[0] == names[1]:
        names = folders
    pairs = pd.DataFrame([_pair(pair, one, other) for pair in first["pairs"]])
    both = "the first scene, then the second"
    titles = [
        f"[{record['title']}]({folder}/answer.md)"
        for (record, _), folder in zip(answers, folders, strict=True)
    ]
    blocks: list[Block] = [
        Text(f"First: {titles[0]}. Second: {titles[1]}. Every contact: [contacts.csv](contacts.csv)."),
        Table("pairs", f"*Gaps, mm, and contact forces, N: {both}.*", pairs, _columns()),
    ]
    if "contact_nodes" in one:
        blocks += [Figure(name, CAPTIONS[name], made) for name, made in gap_maps(answers, names).items()]
    forces = _fasteners([first, second])
    if len(forces):
        columns = [word("kind", "kind"), word("contact", "contact"), number("x, mm", "x_mm")]
        columns += [number("y, mm", "y_mm"), *(number(side, f"{side}_N") for side in SIDES)]
        blocks.append(Table("fasteners", f"*Force in each fastener, N: {both}.*", forces, columns))
    title = f"{names[0]} and {names[1]}"
    write_page(directory / "index.html", title, two_answers_data(answers))
    sections, files = [Section("Two scenes on one junction", blocks)], {"contacts": _contacts(answers)}
    return written(directory / "comparison.md", title, sections, files=files), pairs


def _pair(pair: dict[str, Any], one: dict[str, Array], other: dict[str, Array]) -> dict[str, Any]:
    """The figures of a pair of parts in both scenes."""
    here = slice(pair["start"], pair["stop"])
    line: dict[str, Any] = {"contact": pair_name(pair)}
    for side, arrays in zip(SIDES, (one, other), strict=True):
        gap, force = arrays["gap_after"][here], arrays["lam"][here]
        line |= {
            f"initial_{side}_mm": arrays["gap_before"][here].max(),
            f"largest_{side}_mm": gap.max(),
            f"mean_{side}_mm": gap.mean(),
            f"closed_{side}": int((force > 0).sum()),
            f"force_{side}_N": float(np.nansum(force)),
        }
    change = other["gap_after"][here] - one["gap_after"][here]
    closed, opened = (np.maximum(0.0, most) + 0.0 for most in (-change.min(), change.max()))  # no -0
    return line | {"most_closed_mm": closed, "most_opened_mm": opened}


def _columns() -> list[Column]:
    def both(heading: str, name: str, show: Callable[[object], str] = significant) -> Column:
        first, second = (name.format(side) for side in SIDES)
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


def _fasteners(records: list[dict[str, Any]]) -> pd.DataFrame:
    """One line per place, contact and kind of fastener in either scene; several on one node are added."""
    keys = ["kind", "contact", "x_mm", "y_mm"]
    one, other = (
        fasteners(record).groupby(keys, sort=False)["force_N"].sum().rename(f"{side}_N")
        for record, side in zip(records, SIDES, strict=True)
    )
    return pd.concat([one, other], axis=1).reset_index()


def _contacts(answers: list[Answer]) -> pd.DataFrame:
    """One line per contact: where it is, and its gaps and forces in both scenes."""
    first, second = (contacts(*answer) for answer in answers)
    table = first[[name for name in first if name in ("contact", "x_mm", "y_mm")]].copy()
    for name in ("gap_before_{}mm", "gap_after_{}mm", "force_{}N"):
        for side, of_side in zip(SIDES, (first, second), strict=True):
            table[name.format(f"{side}_")] = of_side[name.format("")]
    return table.assign(change_mm=second["gap_after_mm"] - first["gap_after_mm"])
