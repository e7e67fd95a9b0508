"""Maps of answers: gaps, contact forces and displacements of one scene, and the gaps of two."""

import itertools
import textwrap
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from report.document.numbers import beside, significant
from report.results.answer_record import STRESS, SavedAnswer, pair_name, stages, stress_map, von_mises
from report.results.series_results import allowed_mm

from . import style
from .deformed_faces import deformed_figure
from .gap_section import section_figure
from .junction_maps import (
    CLOSED,
    LARGER,
    RIM,
    Array,
    Map,
    Marks,
    Outlines,
    Scale,
    larger_than,
    map_sheet,
    rooted,
)
from .node_cells import grid_of

#: Colour and marker of the force in each kind of fastener over the stages.
LINES = [
    (style.VERMILLION, "s"),
    (style.BLUE, "^"),
    (style.GREEN, "D"),
    (style.PURPLE, "v"),
    (style.BLACK, "o"),
]


def answer_figures(record: dict[str, Any], arrays: dict[str, Array]) -> dict[str, Figure]:
    """The pictures of an answer by their names; those that it has nothing for are left out."""
    with style.applied():
        figures = stage_figures(record, arrays) if "stage_gaps" in arrays and record["m"] else {}
        figures |= {"gap": _gap(record, arrays)} if record["m"] else {}
        for name, view in (("section", section_figure), ("deformed", deformed_figure)):
            if (figure := view(record, arrays)) is not None:
                figures[name] = figure
        if (arrays["lam"] > 0).any():
            figures["forces"] = _forces(record, arrays)
        figures |= {"stress": _stress(record, arrays)} if "stress" in arrays else {}
        return figures | {"displacement": _displacement(record, arrays)}


def _pairs(
    title: str, answer: SavedAnswer, values: Array, scale: Scale, outlines: Outlines = ()
) -> list[Map]:
    """A map of each pair of parts. values, and the masks of the outlines : of all contacts."""
    record, arrays = answer
    maps = []
    for pair in record["pairs"]:
        here = slice(pair["start"], pair["stop"])
        lines = [(inside[here], colour, label) for inside, colour, label in outlines]
        name, nodes = f"{title}: {pair_name(pair)}", arrays["contact_nodes"][here]
        maps.append(Map(name, nodes, values[here], scale, lines, record["marks"]))
    return maps


def _gap(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """Both gaps of each pair, with the closed contacts and those whose gap is larger than allowed."""
    after = arrays["gap_after"]
    outlines = [(arrays["lam"] > 0, CLOSED, "closed contacts"), larger_than(allowed_mm(record), after)]
    gaps = ("gap before", arrays["gap_before"], ()), ("gap after", after, outlines)
    sides = [
        _pairs(name, (record, arrays), gap, rooted(f"{name}, mm", "viridis", gap), lines)
        for name, gap, lines in gaps
    ]
    return map_sheet([item for pair in zip(*sides, strict=True) for item in pair], 2)[0]


def stage_figures(record: dict[str, Any], arrays: dict[str, Array]) -> dict[str, Figure]:
    """`history`, the largest gap, the forces and the largest stress over the stages, and `stage-gaps`, on one
    scale; outlined: larger than allowed.
    """
    table, limit = stages(record, arrays), allowed_mm(record)
    limited = limit < np.inf
    stressed = STRESS in table
    history = style.figure(4.2 + 1.6 * stressed)
    gap, force, *stress = history.subplots(2 + stressed, 1, sharex=True)
    gap.plot(table["stage"], table["largest_mm"], color=style.BLACK, marker="o")
    ends = [*table["largest_mm"], limit if limited else 0.0]
    if limited:
        gap.axhline(limit, color=LARGER, linestyle="--", label="limit")
        gap.legend()
    gap.set(ylabel="largest gap, mm", ylim=(min(0.0, *ends), 1.1 * max(ends) or None))
    names = [name for name in table.columns if name.endswith(", N")]
    for name, (colour, marker) in zip(names, itertools.cycle(LINES), strict=False):
        look: dict[str, Any] = {"color": colour, "marker": marker, "markerfacecolor": "none"}
        force.plot(table["stage"], table[name], label=name.removesuffix(", N"), **look)
    force.set(ylabel="sum of forces, N")
    force.set_xticks(range(len(table)), [textwrap.fill(name, 14) for name in table["stage"]])
    force.legend()
    for axes in stress:
        largest = table[STRESS].astype(float)  # NaN where none is known
        axes.plot(table["stage"], largest, color=style.BLACK, marker="o")
        axes.set(ylabel=f"largest {STRESS}", ylim=(0.0, 1.1 * largest.max() if largest.max() > 0 else None))
    scale = rooted("gap, mm", "viridis", arrays["stage_gaps"])
    maps = []
    told = zip(table.to_dict("records"), record["stages"], arrays["stage_gaps"], strict=True)
    for line, stage, values in told:
        answer = record | {"marks": stage["marks"]}, arrays
        here = _pairs(stage["name"], answer, values, scale, [larger_than(limit, values)])
        title = _outcome(line, limit)
        maps += [replace(item, title=title) for item in here] if len(here) == 1 else here
    return {"history": history, "stage-gaps": map_sheet(maps, 2)[0]}


def _outcome(stage: Mapping[Any, Any], limit_mm: float) -> str:
    """A line of the table of stages in words."""
    words = f"{stage['stage']}: gap {beside(limit_mm)(stage['largest_mm'])} mm"
    words += f", stress {significant(stage[STRESS])} N/mm²" if STRESS in stage else ""
    return words + (f", {stage['verdict']}" if "verdict" in stage else "")


def _forces(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    lam = np.nan_to_num(arrays["lam"])
    outlines = [(lam > 0, RIM, "closed contacts")]
    forces, scale = np.where(lam > 0, lam, np.nan), rooted("force, N", "magma_r", lam)
    maps = _pairs("contact forces", (record, arrays), forces, scale, outlines)
    return map_sheet(maps, len(maps))[0]


def _displacement(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """All parts on one scale; the rest of a part is hatched, a thick edge clamped."""
    parts, x = record["parts"], arrays["x"]
    scale = Scale("displacement, mm", "plasma", Normalize(float(x.min()), float(x.max())))
    maps = []
    for part in parts:
        here = slice(part["start"], part["stop"])
        title = f"displacement of {part['name']}"
        maps.append(Map(title, arrays["nodes"][here], x[here], scale, (), _marks(record, part)))
    corners = np.array([(x, y) for part in parts for x in part["outline"][:2] for y in part["outline"][2:]])
    figure, panels = map_sheet(maps, len(parts), corners)
    for axes, part in zip(panels, parts, strict=True):
        west, east, south, north = part["outline"]
        axes.spines[:].set_visible(False)
        edge: dict[str, Any] = {"edgecolor": "#666666", "facecolor": "white", "hatch": "///", "zorder": 0}
        if grid_of(arrays["nodes"][part["start"] : part["stop"]]) is not None:
            axes.add_patch(Rectangle((west, south), east - west, north - south, clip_on=False, **edge))
        for side, y in (("south", south), ("north", north)):
            if side in part["clamped"]:
                axes.plot([west, east], [y, y], color="#222222", lw=3.0, clip_on=False)
    return figure


def _stress(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """Von Mises' stress of each part; outlined: where it is not to be read."""
    values, near = von_mises(arrays), arrays["stress_near_force"]
    scale = rooted("von Mises stress, N/mm²", "cividis", np.where(near, 0.0, values))
    maps = []
    for k, part in enumerate(record["parts"]):
        places, highest, unread = stress_map(arrays, k)
        outlines = [(unread, LARGER, "not to be read")]
        title = f"von Mises stress of {part['name']}"
        if len(places):
            maps.append(Map(title, places, highest, scale, outlines, _marks(record, part)))
    return map_sheet(maps, len(maps))[0]


def _marks(record: dict[str, Any], part: dict[str, Any]) -> Marks:
    return record["marks"] | ({"supports": part["supports"]} if part["supports"] else {})


def gap_maps(answers: list[SavedAnswer], names: list[str], common: list[SavedAnswer]) -> dict[str, Figure]:
    """`gaps`, all pairs of two scenes on one scale; `difference`, second minus first at common places."""
    (_, one), (_, other) = answers
    scale = rooted("gap, mm", "viridis", one["gap_after"], other["gap_after"])
    change = common[1][1]["gap_after"] - common[0][1]["gap_after"]
    size = float(abs(change).max()) or 1.0
    both = Scale("change of the gap, mm", "RdBu_r", Normalize(-size, size))
    sides = []
    for name, (record, arrays) in zip(names, answers, strict=True):
        closed = [(arrays["lam"] > 0, CLOSED, "closed contacts")]
        sides.append(_pairs(f"{name}: gap", (record, arrays), arrays["gap_after"], scale, closed))
    changes = _pairs(f"{names[1]} minus {names[0]}", common[1], change, both)
    with style.applied():
        sheet, _ = map_sheet([item for pair in zip(*sides, strict=True) for item in pair], 2)
        return {"gaps": sheet, "difference": map_sheet(changes, len(changes))[0]}
