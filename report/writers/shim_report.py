"""Writes the report of a search for shims: report.md with a drawing and tables, index.html, and sheet.pdf."""

from base64 import b64encode
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Polygon, Rectangle

from harness.results import records
from report.document.blocks import Block, Column, Figure, Section, Table, facts_table, number, word
from report.document.escape import quoted
from report.document.numbers import beside, coordinate, counted, raised, significant, whole
from report.figures import style
from report.page.page_file import Data, banner, table_data
from report.page.page_file import write as write_page
from report.writers.sections_writer import written
from report.writers.sheet import Sheet, origin, write_sheet

COLUMNS = {"area, mm²": "area_mm2", "gap before, mm": "gap_before_mm"}
COLUMNS |= {"gap after, mm": "gap_after_mm", "liquid shim, mm³": "liquid_mm3"}
FORCES = {"without, N": "force_N", "with shims, N": "with_shims_N"}
LIMITS = {"gap": ("mm", "limit_mm"), "force": ("N", "allow_force"), "stress": ("N/mm²", "allow_stress")}
NEAR = 0.9  # of the limit: a gap is at it


def write(directory: Path) -> Path:
    """Write DIRECTORY/report.md from the record in DIRECTORY, with a page and a sheet; returns its path."""
    record = quoted(records.read_object(directory / "shim.json"))
    patches = pd.DataFrame(record["patches"]).astype(dict.fromkeys(COLUMNS.values(), float))  # NaN: not known
    title = f"Shims: {record['title']}"
    label, what, heads = "thickness_mm", "thickness in mm", [number("thickness, mm", "thickness_mm")]
    if "thickness_end_mm" in patches:
        heads.append(number("at its other end, mm", "thickness_end_mm"))
    blocks, files = list[Block](), dict[str, pd.DataFrame]()
    with style.applied():
        if joints := record.get("joints"):
            sizes = ["thickness_mm", "thickness_end_mm"][: 1 + record["taper"]]
            pieces = [(joint["joint"], int(k), *t) for joint in joints for k, *t in joint.pop("plan")]
            table = pd.DataFrame(pieces, columns=["joint", "patch", *sizes])
            thickest = table.assign(most=table[sizes].max(axis=1)).groupby("patch")
            used = thickest.agg(joints=("joint", "size"), thickness_mm=("most", "max"))
            patches = patches.join(used).fillna({"joints": 0, "thickness_mm": 0.0})
            heads = [number("joints with it", "joints", whole), number("thickest, mm", "thickness_mm")]
            label, what = "joints", f"in how many of {counted(len(joints), 'joint')}"
            thicknesses = table.pivot(index="joint", columns="patch", values=sizes)
            ends = [
                (patches["patch"][at[1]], ", other end" * (at[0] != sizes[0])) for at in thicknesses.columns
            ]
            lines = pd.DataFrame(joints)
            names = ("".join(end) for end in ends)
            thicknesses.columns = pd.Index([f"{name}, mm" if name in lines else name for name in names])
            files["joints"] = lines.join(thicknesses, on="joint")
            blocks += _stock(table.join(patches["area_mm2"], on="patch"), sizes)
        shims = patches[patches["thickness_mm"] > 0]
        ranges = [Column(f"{axis}, mm", partial(_range, axis)) for axis in "xy"]
        columns = [word("patch", "patch"), *ranges, *heads, *(number(*pair) for pair in COLUMNS.items())]
        caption = "*Shims by patch*; one without a thickness has none."
        blocks.append(Table("shims", caption, patches.drop(columns="outline"), columns))
        if len(forces := pd.DataFrame(record["forces"])):
            places = (number(f"{axis}, mm", axis, coordinate) for axis in "xy")
            of_forces = [word("kind", "kind"), *places, *(number(*pair) for pair in FORCES.items())]
            caption = "*Forces in fasteners* of the scene as its file has it."
            blocks.append(Table("forces", caption, forces, of_forces))
        facts = facts_table("", "*The question and its answer.*", _facts(record, patches, len(shims)))
        caption = f"*The shims*: {what}; the ticks are borders in mm, rings fasteners and other marks."
        drawing = Figure("shims", caption, _drawing(record, shims, label))
        sections = [Section("The shims", [facts, drawing, *blocks])]
        page = written(directory / "report.md", title, sections, files=files)
    tables = [block for block in blocks if isinstance(block, Table)]
    kind, picture = record["said"].partition(":")[0].lower(), directory / "shims.png"
    code = pd.DataFrame([record])[["machine", "commit", "clean", "recorded_at"]]
    data: Data = {
        "headline": {"kind": kind, "text": record["said"]},
        "banner": banner(code, f"scene {record['scene']}", warnings=[]),
        "pictures": [f"data:image/png;base64,{b64encode(picture.read_bytes()).decode()}"],
        "tables": [_on_page(table) for table in (facts, *tables)],
    }
    write_page(directory / "index.html", title, data)
    sure = [f"Largest gap: {_largest(record, 'gap', len(shims))}.", *(f"{text}." for text in record["sure"])]
    tables = [replace(table, data=shims) if table.name == "shims" else table for table in tables]
    about = sure, origin(record), record["inputs"], [picture], tables
    write_sheet(directory / "sheet.pdf", Sheet(title, kind, record["said"], *about))
    return page


def _facts(record: dict[str, Any], patches: pd.DataFrame, shims: int) -> dict[str, str]:
    at_limit = patches[patches["gap_after_mm"] > NEAR * record["limit_mm"]]["patch"]
    liquid = patches["liquid_mm3"].sum(skipna=False)
    per_joint = Counter(joint["shims"] for joint in record.get("joints", ()) if joint["kept"])
    return {
        "found": record["said"],
        "stock": ", ".join(f"{t:g}" for t in record["stock"]) + " mm",
        "fresh cases": "; ".join(f"{s['kept']} of {s['cases']} keep all limits" for s in record["samples"]),
        "shims per joint": ", ".join(f"{n} in {counted(per_joint[n], 'joint')}" for n in sorted(per_joint)),
        "at the limit": ", ".join(at_limit),
        "liquid shim": f"{significant(liquid)} mm³ fill what is left in all patches",
        "how sure": ". ".join(record["sure"]),
        **{f"largest {key}": _largest(record, key, shims) for key in LIMITS},
    }


def _largest(record: dict[str, Any], key: str, shims: int) -> str:
    """The largest gap, force or stress without and with so many shims, if it has a limit."""
    unit, name = LIMITS[key]
    if record[name] is None:
        return ""
    before, after = (
        f"{beside(record[name], raised)(record[when][key])} {unit}" for when in ("before", "after")
    )
    chose, fresh = (" in the cases that chose", " in the fresh cases") if record["samples"] else ("", "")
    at = f", at {record['worst_at']}" if key == "gap" else ""
    if shims:
        before, after = f"{before} without shims", f"{after} with them"
    both = f"{before}{chose}, {after}{fresh}" if shims or fresh else after
    return f"{both}{at}; {record[name]:g} {unit} allowed"


def _stock(pieces: pd.DataFrame, sizes: list[str]) -> list[Block]:
    """What to order: how many pieces of each thickness all joints take, of a tapered one from its thin end.

    pieces : one line each. sizes : their columns of thicknesses.
    """
    pieces[sizes] = np.sort(pieces[sizes], axis=1)
    of = {"pieces": ("joint", "size"), "joints": ("joint", "nunique"), "area_mm2": ("area_mm2", "sum")}
    table = pieces.groupby(sizes).agg(**of).reset_index()
    names = [" to ".join(f"{t:g}" for t in row) for row in table[sizes].to_numpy()]
    drawing, axes = style.single(2.6)
    axes.bar(names, table["pieces"], color=style.BLUE)
    axes.set(xlabel="thickness, mm", ylabel="pieces")
    heads = "thickness, mm", "at its other end, mm"
    shown = [*(number(*pair) for pair in zip(heads, sizes, strict=False)), number("pieces", "pieces", whole)]
    shown += [number("joints", "joints", whole), number("area, mm²", "area_mm2")]
    caption = "*What to order*: the pieces of each thickness that all joints take."
    return [Figure("stock", "*Pieces of each thickness.*", drawing), Table("stock", caption, table, shown)]


def _on_page(table: Table) -> Data:
    _, title, summary = table.caption.split("*", 2)
    return table_data(title.rstrip("."), table.columns, table.data, summary.strip("; "))


def _range(axis: str, line: Mapping[str, Any]) -> str:
    return f"{line[f'{axis}_min']:.6g} … {line[f'{axis}_max']:.6g}"


def _drawing(record: dict[str, Any], shims: pd.DataFrame, label: str) -> Drawing:
    """The junction with each shim, its name and what `label` has of it; the ticks are borders of shims."""
    (west, south), (east, north) = record["bounds"]
    drawing, axes = style.single(min(max(style.WIDTH * (north - south) / (east - west), 2.2), style.WIDTH))
    axes.add_patch(Rectangle((west, south), east - west, north - south, fill=False))
    corners = [np.array(outline) for outline in shims["outline"]]
    for outline, (_, line) in zip(corners, shims.iterrows(), strict=True):
        axes.add_patch(Polygon(outline, facecolor=style.SKY, edgecolor=style.BLUE))
        middle, (width, height) = outline.mean(axis=0), np.ptp(outline, axis=0)
        look: dict[str, Any] = {"ha": "center", "va": "center", "rotation": 90 if width < height else 0}
        end = f" to {line['thickness_end_mm']:g}" if "thickness_end_mm" in line else ""
        axes.text(middle[0], middle[1], f"{line['patch']}: {line[label]:g}{end}", **look)
    axes.plot(*np.reshape(record["marks"], (-1, 2)).T, "o", color=style.BLACK, fillstyle="none", ms=4)
    ends = np.concatenate([record["bounds"], *corners]).T
    for axis, places in zip((axes.xaxis, axes.yaxis), ends, strict=True):
        axis.set_ticks(ticks := sorted(set(places)), [f"{tick:.6g}" for tick in ticks])
    axes.tick_params(axis="x", rotation=90)
    axes.set(
        xlabel="x, mm", ylabel="y, mm", aspect="equal" if (north - south) / (east - west) > 0.2 else "auto"
    )
    axes.grid(visible=False)
    return drawing
