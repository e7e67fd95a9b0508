"""Writes the report of a search for shims: report.md with a drawing, shims.csv and forces.csv."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Rectangle

from report.document.blocks import Block, Column, Figure, Section, Table, facts_table, number, word
from report.document.escape import quoted
from report.document.numbers import significant
from report.figures import style
from report.writers.sections_writer import written

COLUMNS = {"thickness, mm": "thickness_mm", "area, mm²": "area_mm2", "gap before, mm": "gap_before_mm"}
COLUMNS |= {"gap after, mm": "gap_after_mm", "liquid shim, mm³": "liquid_mm3"}
LIMITS = {"gap": "largest gap, mm", "force": "largest force, N", "stress": "largest stress, N/mm²"}
NEAR = 0.9  # of the limit: a gap is at it


def write(directory: Path) -> Path:
    """Write DIRECTORY/report.md from the record in DIRECTORY. Returns its path."""
    record = quoted(json.loads((directory / "shim.json").read_text("utf-8")))
    patches, forces = pd.DataFrame(record["patches"]), pd.DataFrame(record["forces"])
    shims, before, after = patches[patches["thickness_mm"] > 0], record["before"], record["after"]
    facts = {
        "found": record["said"],
        "stock": ", ".join(f"{t:g}" for t in record["stock"]) + " mm",
        "fresh cases": "; ".join(f"{s['kept']} of {s['cases']} keep all limits" for s in record["samples"]),
        "at the limit": ", ".join(patches[patches["gap_after_mm"] > NEAR * record["limit_mm"]]["patch"]),
        "liquid shim": f"{significant(patches['liquid_mm3'].sum())} mm³ fill what is left in all patches",
        "how sure": ". ".join(record["sure"]),
    }
    for key, name in LIMITS.items():
        if (allowed := record.get("limit_mm" if key == "gap" else f"allow_{key}")) is not None:
            figures = f"{significant(before[key])} without, {significant(after[key])} with shims"
            facts[name] = f"{figures}; {allowed:g} allowed"
    ranges = [Column(f"{axis}, mm", partial(_range, axis)) for axis in "xy"]
    columns = [word("patch", "patch"), *ranges, *(number(name, key) for name, key in COLUMNS.items())]
    caption = "*The shims*: thickness, and borders in mm; rings are fasteners and other marks of the scene."
    names = {"x, mm": "x", "y, mm": "y", "without, N": "force_N", "with shims, N": "with_shims_N"}
    of_forces = [word("kind", "kind"), *(number(name, key) for name, key in names.items())]
    with style.applied():
        blocks: list[Block] = [
            facts_table("", "*The question and its answer.*", facts),
            Figure("shims", caption, _drawing(record, shims)),
            Table("shims", "*All patches*; one without a thickness has no shim.", patches, columns),
            Table("forces", "*Forces in fasteners* of the scene as its file has it.", forces, of_forces),
        ]
    return written(directory / "report.md", f"Shims: {record['title']}", [Section("The shims", blocks)])


def _range(axis: str, line: Mapping[str, Any]) -> str:
    return f"{line[f'{axis}_min']:.6g} … {line[f'{axis}_max']:.6g}"


def _drawing(record: dict[str, Any], shims: pd.DataFrame) -> Drawing:
    """The junction with each shim, its name and thickness; borders of shims are the ticks of the axes."""
    (west, south), (east, north) = record["bounds"]
    drawing = style.figure(min(max(style.WIDTH * (north - south) / (east - west), 2.2), style.WIDTH))
    axes = drawing.subplots()
    axes.add_patch(Rectangle((west, south), east - west, north - south, fill=False))
    for line in shims.to_dict("records"):
        low = np.array([line["x_min"], line["y_min"]])
        width, height = np.array([line["x_max"], line["y_max"]]) - low
        axes.add_patch(Rectangle(tuple(low), width, height, facecolor=style.SKY, edgecolor=style.BLUE))
        look: dict[str, Any] = {"ha": "center", "va": "center", "rotation": 90 if width < height else 0}
        axes.text(
            low[0] + width / 2, low[1] + height / 2, f"{line['patch']}: {line['thickness_mm']:g}", **look
        )
    axes.plot(*np.reshape(record["marks"], (-1, 2)).T, "o", color=style.BLACK, fillstyle="none", ms=4)
    axes.set_xticks(sorted({west, east, *shims["x_min"], *shims["x_max"]}))
    axes.set_yticks(sorted({south, north, *shims["y_min"], *shims["y_max"]}))
    axes.tick_params(axis="x", rotation=90)
    axes.set(
        xlabel="x, mm", ylabel="y, mm", aspect="equal" if (north - south) / (east - west) > 0.2 else "auto"
    )
    axes.grid(visible=False)
    return drawing
