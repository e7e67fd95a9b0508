"""Writes two answers on one junction: comparison.md, maps, tables of contacts and fasteners, index.html."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy.sparse as sp

from harness.results.schema import EXCEEDED
from report.document.blocks import Block, Column, Figure, Section, Table, Text, number, word
from report.document.numbers import counted, position, significant, whole
from report.figures.answer_maps import gap_maps
from report.page.answer_page_data import FASTENER, headline, two_answers_data
from report.page.page_file import write as write_page
from report.results.answer_record import SavedAnswer, closed_contacts, contacts, fasteners, pair_name, read
from report.writers.sections_writer import written

SIDES = ("first", "second")
CAPTIONS = {
    "gaps": "*The remaining gaps.* Outlined in white: closed contacts.",
    "difference": "*Red: the gap is larger in the second scene. Blue: it is smaller.*",
}


def write(
    directory: Path, folders: list[str], weights: Sequence[tuple[sp.csr_array, sp.csr_array]] | None
) -> tuple[Path, pd.DataFrame, list[str]]:
    """Write DIRECTORY/comparison.md, with index.html, from two of its folders.

    Returns the path of comparison.md, the figures per pair, and sentences on two meshes. weights : those of
    the contacts of either answer at common places, pair by pair; None if their contacts are the same.
    """
    answers = [read(directory / folder) for folder in folders]
    common = answers if weights is None else [*map(_at_places, answers, zip(*weights, strict=True))]
    (first, one), (second, _) = answers
    names = [str(record["scene"]) for record, _ in answers]
    if names[0] == names[1]:
        names = folders
    table, of_both = _contacts(common), zip(first["pairs"], second["pairs"], strict=True)
    pairs = pd.DataFrame([_pair(both, answers, table) for both in of_both])
    said = [] if weights is None else [*_said_of_meshes(answers, table)]
    both = "the first scene, then the second"
    titles = [
        f"[{name}: {record['title']}]({folder}/answer.md). {headline(record, arrays)['text']}"
        for name, (record, arrays), folder in zip(names, answers, folders, strict=True)
    ]
    blocks: list[Block] = [
        Text(f"First: {titles[0]}\n\nSecond: {titles[1]}\n\nEvery contact: [contacts.csv](contacts.csv)."),
        *([Text(" ".join(said))] if said else []),
        Table("pairs", f"*Gaps, mm, and contact forces, N: {both}.*", pairs, _columns()),
    ]
    if "contact_nodes" in one:
        maps = gap_maps(answers, names, common)
        blocks += [Figure(name, CAPTIONS[name], made) for name, made in maps.items()]
    forces = _fasteners([first, second])
    if len(forces):
        columns = [*FASTENER, *(number(side, f"{side}_N") for side in SIDES)]
        blocks.append(Table("fasteners", f"*Force in each fastener, N: {both}.*", forces, columns))
    title = f"{names[0]} and {names[1]}"
    write_page(directory / "index.html", title, two_answers_data(answers, common))
    sections, files = [Section("Two scenes on one junction", blocks)], {"contacts": table}
    return written(directory / "comparison.md", title, sections, files=files), pairs, said


def _at_places(answer: SavedAnswer, weights: Sequence[sp.csr_array]) -> SavedAnswer:
    """The gaps of an answer at common places; no forces, which are those of the contacts of one mesh."""
    (record, arrays), W = answer, sp.block_diag(weights, format="csr")
    stops = np.cumsum([some.shape[0] for some in weights]).tolist()
    ends = zip(record["pairs"], [0, *stops], stops, strict=False)
    pairs = [pair | {"start": start, "stop": stop} for pair, start, stop in ends]
    gaps = {name: W @ arrays[name] for name in ("contact_nodes", "gap_before", "gap_after")}
    return record | {"pairs": pairs}, gaps | {"lam": np.full(W.shape[0], np.nan)}


def _said_of_meshes(answers: list[SavedAnswer], table: pd.DataFrame) -> Iterator[str]:
    """Yield where the gaps on two meshes differ most, and what the mesh does to the verdict."""
    change, nodes = table["change_mm"].abs().to_numpy(), table[["x_mm", "y_mm"]].to_numpy()
    k = int(change.argmax())
    worst, at = table.to_dict("records")[k], position(nodes[k], nodes)
    gaps = " and ".join(significant(worst[f"gap_after_{side}_mm"]) for side in SIDES)
    most = f"Gaps on the two meshes differ by up to {significant(change[k])} mm"
    yield f"{most}, at {at} ({worst['contact']}): {gaps} mm."
    coarse = min(record["m"] for record, _ in answers)
    if beyond := coarse - len(table):
        yield f"Not compared: {beyond} of {counted(coarse, 'contact')}, beyond those of the other mesh."
    if "allowed_gap" in answers[0][0]:
        checks = [record["allowed_gap"] for record, _ in answers]
        one, other = (EXCEEDED[check["exceeded"]] for check in checks)
        verdict = f"both are {one}" if one == other else f"the mesh decides: first {one}, second {other}"
        yield f"With a limit of {checks[0]['allowed_mm']:g} mm, {verdict}."


def _pair(both: Sequence[dict[str, Any]], answers: list[SavedAnswer], table: pd.DataFrame) -> dict[str, Any]:
    """The figures of a pair of parts in both scenes."""
    line: dict[str, Any] = {"contact": pair_name(both[0])}
    for side, pair, (_, arrays) in zip(SIDES, both, answers, strict=True):
        here = slice(pair["start"], pair["stop"])
        gap, force = arrays["gap_after"][here], arrays["lam"][here]
        line |= {
            f"initial_{side}_mm": arrays["gap_before"][here].max(),
            f"largest_{side}_mm": gap.max(),
            f"mean_{side}_mm": gap.mean(),
            f"closed_{side}": closed_contacts(force),
            f"force_{side}_N": float(force.sum()),
        }
    change = table.loc[table["contact"] == line["contact"], "change_mm"]
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


def _contacts(answers: list[SavedAnswer]) -> pd.DataFrame:
    """One line per contact: where it is, and its gaps and forces in both scenes."""
    first, second = (contacts(*answer) for answer in answers)
    table = first[[name for name in first if name in ("contact", "x_mm", "y_mm")]].copy()
    for name in ("gap_before_{}mm", "gap_after_{}mm", "force_{}N"):
        for side, of_side in zip(SIDES, (first, second), strict=True):
            table[name.format(f"{side}_")] = of_side[name.format("")]
    return table.assign(change_mm=second["gap_after_mm"] - first["gap_after_mm"])
