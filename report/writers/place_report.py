"""Writes the report of a search for a plan of fasteners: report.md with pictures, and plan.csv, order.csv."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from harness.results import records
from report.document.blocks import Block, Column, Figure, Section, Table, Text, facts_table, number, word
from report.document.escape import quoted
from report.document.numbers import (
    beside,
    coordinate,
    counted,
    out_of,
    percent_interval,
    raised,
    significant,
    whole,
)
from report.figures import style
from report.figures.junction_maps import Map, larger_than, map_sheet, rooted
from report.results.series_results import read as read_series
from report.writers.sections_writer import emptied, written
from report.writers.sheet import MESH, Sheet, exactness, origin, write_sheet

FEW = 10  # cases that are named
#: How a plan came about: its name in the table and the picture, and its look.
FAMILIES = {
    "all candidates": ("all candidates", style.BLACK, "o", ""),
    "removal": ("after removal", style.BLUE, ".", "-"),
    "exchange": ("after exchanges, or of all", style.BLACK, "*", ""),
    "own": ("the scene's own", style.GREEN, "D", ""),
    "uniform": ("in the holes nearest to uniform patterns", style.VERMILLION, "s", ""),
}


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md from the record and the series in DIRECTORY. Returns its path."""
    record = quoted(records.read_object(directory / "place.json"))
    steps = pd.DataFrame(record["steps"]).astype({"gap_mm": float})  # NaN where nothing is proven
    title = f"Where fasteners go: {record['title']}"
    with style.applied():
        sections = [Section("The plan", [_summary(record), _families(record, steps)])]
        sections.append(Section("How many fasteners", [_curve(record, steps)]))
        sections.append(Section("Where the gap is left", _maps(record, directory)))
        if record["order"]:
            sections.append(Section("In which order to set them", _order(record)))
    target = emptied(directory / "report")
    page = written(target / "report.md", title, sections)
    write_sheet(target / "sheet.pdf", _sheet(record, title, directory))
    return page


def _sheet(record: dict[str, Any], title: str, directory: Path) -> Sheet:
    said, best = record["said"], record["best"]
    kind = {"PASS": "pass", "FAIL": "fail"}.get(said.partition(":")[0], "")
    solved = read_series(directory / ("plan" if best else "own"))
    facts = _summary(record).data.set_index("what")["value"]
    samples = [f"{name}: {text}." for name, text in facts.items() if ", round" in str(name)]
    sure = [exactness(solved.cases["gap_error_mm"].max(skipna=False)), *samples, MESH]
    picture = directory / "report" / "before-and-after.png"
    about = origin(record), record.get("inputs", {}), [picture] if picture.exists() else []
    tables = [block for block in _order(record) if isinstance(block, Table)] if record["order"] else []
    return Sheet(title, kind, said, sure, *about, tables)


def _summary(record: dict[str, Any]) -> Table:
    best, limit = record["best"], record["limit_mm"]
    share = f"{100 * record['share']:.4g} % of the cases"
    asked = f"the best {record['count']}" if record["count"] else f"the fewest that leave {limit:g} mm"
    after = f", after stage {record['stages'][-1]}" if record["stages"] else ""
    holes = counted(len(record["candidates"]), "hole")
    facts = {
        "asked for": f"{asked} in {share}{after}",
        "candidates": f"{holes}, {significant(record['preload'])} N each",
        "found": record["said"],
    }
    for n, sample in enumerate(record["samples"], start=1):
        said = f"{counted(sample['fasteners'], 'fastener')}: kept by {sample['kept']}, with "
        interval = percent_interval(sample["interval"], 2)
        said += f"{100 * record['confidence']:g} % confidence {interval} of all"
        for what, numbers in (("beyond the limit", sample["failing"]), ("not proven", sample["unproven"])):
            if numbers:
                some = ", ".join(map(str, numbers[:FEW]))
                some += f" and {len(numbers) - FEW} more" if len(numbers) > FEW else ""
                said += f"; {what} in {out_of(len(numbers), sample['cases'], 'case')}: {some}"
        facts[f"{counted(sample['cases'], 'fresh case')}, round {n}"] = said
    if best is not None:
        facts["files"] = "`plan.toml`, a scene; `plan.csv`; `plan/`, its series of load cases"
        facts["lower bound"] = "none is known: this is the best plan found"
    return facts_table("", "*The question and its answer.*", facts)


def _families(record: dict[str, Any], steps: pd.DataFrame) -> Table:
    """The smallest plan of each family that keeps the limit; of one size, the best."""
    limit = np.inf if record["limit_mm"] is None else record["limit_mm"]
    lines = []
    for name, (text, *_) in FAMILIES.items():
        plans = steps[steps["moved"] == name].sort_values(["fasteners", "gap_mm"])
        if record["count"]:
            plans = plans[(plans["fasteners"] == record["count"]) | (name in ("own", "all candidates"))]
        kept = plans if record["count"] else plans[plans["gap_mm"] <= limit]
        if len(plans):
            most = plans[plans["fasteners"] == plans["fasteners"].max()]
            line = (kept if len(kept) else most).iloc[0]
            lines.append({"family": text, **line[["fasteners", "gap_mm"]], "kept": line["gap_mm"] <= limit})
    columns = [word("plan", "family"), number("fasteners", "fasteners", whole)]
    columns.append(number("gap, mm", "gap_mm", beside(limit, raised)))
    if record["limit_mm"] is not None:
        columns.append(Column("within the limit", lambda line: "yes" if line["kept"] else "no", "left"))
    caption = (
        "*Beside plans that cost no search*, in the cases that chose. Of each kind the smallest within the "
        "limit, or its last."
    )
    return Table("families", caption, pd.DataFrame(lines), columns)


def _curve(record: dict[str, Any], steps: pd.DataFrame) -> Figure:
    drawing, axes = style.single(3.4)
    for name, (text, colour, marker, line) in FAMILIES.items():
        plans = steps[steps["moved"] == name].sort_values("fasteners")
        if len(plans):
            look: dict[str, Any] = {"marker": marker, "linestyle": line, "color": colour, "ms": 5}
            # The search may have found a uniform plan, too: it stays visible.
            look |= {"ms": 9, "zorder": 2} if name == "uniform" else {"zorder": 3}
            axes.plot(plans["fasteners"], plans["gap_mm"], label=text, **look)
    if record["limit_mm"] is not None:
        axes.axhline(record["limit_mm"], color=style.GREY, linewidth=1, label="the limit")
    axes.set(xlabel="fasteners", ylabel="largest gap, mm", xlim=(0, None), yscale="log")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    style.plain_log(axes.yaxis)
    drawing.legend(loc="outside right upper")
    share = f"{100 * record['chosen_by_share']:.4g} % of the {counted(record['cases'], 'case')}"
    caption = f"*The gap against the number of fasteners*: the largest in {share} that chose, proven."
    return Figure(
        "gap-against-fasteners", caption, drawing, steps.drop(columns=["plan", "failing", "unproven"])
    )


def _maps(record: dict[str, Any], directory: Path) -> list[Block]:
    """The gap that the share of the fresh cases keeps at each contact, before and after."""
    shown, share = [], record["share"]
    names = {"own": f"the scene's own {len(record['own'])}"}
    if record["best"]:
        names["plan"] = f"the plan of {record['best']['fasteners']}"
    for name, text in names.items():
        series = read_series(directory / name)
        count = series.facts["cases"]
        if record["samples"]:
            numbers = record["samples"][-1]["numbers"]
            count = len(numbers)
            series = replace(series, cases=series.cases[series.cases["case"].isin(numbers)])
        place, last = share * (count - 1), len(series.cases) - 1  # those without an answer have the largest
        if series.nodes is None or place > last:
            return [Text("No picture: some cases have no answer.")]
        pieces = [np.quantile(some, place / max(last, 1), axis=0) for some in series.of_contacts()]
        shown.append((text, series.nodes, np.concatenate(pieces), series.marks))
    scale = rooted("gap, mm", "viridis", *(values for _, _, values, _ in shown))
    limit = np.inf if record["limit_mm"] is None else record["limit_mm"]
    maps = [
        Map(text, nodes, gap, scale, [larger_than(limit, gap)], marks) for text, nodes, gap, marks in shown
    ]
    of = f"{'fresh ' * bool(record['samples'])}cases"
    caption = f"*The gap at each contact that {100 * share:.4g} % of the {of} keep*, before and after."
    table = pd.DataFrame({"x_mm": shown[0][1][:, 0], "y_mm": shown[0][1][:, 1]})
    table = table.assign(**{f"{name}_mm": gap for name, (_, _, gap, _) in zip(names, shown, strict=True)})
    return [Figure("before-and-after", caption, map_sheet(maps, 1)[0], table)]


def _order(record: dict[str, Any]) -> list[Block]:
    places: list[tuple[float, float]] = []
    lines, holes = [], zip(map(tuple, record["candidates"]), record["names"], strict=True)
    labels = {place: label for place, label in holes if label}
    for step in record["order"]:
        new = [tuple(place) for place in step["plan"] if tuple(place) not in places]
        places += new
        x, y = new[0] if new else (np.nan, np.nan)
        at = dict(zip(("at_x_mm", "at_y_mm"), step["worst_at"], strict=True))
        at |= {"name": labels.get((x, y), "")} if labels else {}
        lines.append({"set": step["fasteners"], "x_mm": x, "y_mm": y, "gap_mm": step["gap_mm"]} | at)
    table = pd.DataFrame(lines)
    drawing, axes = style.single(3.0)
    axes.plot(table["set"], table["gap_mm"], color=style.BLUE, marker="o", ms=4)
    axes.set(xlabel="fasteners set", ylabel="largest gap, mm", ylim=(0, None))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    columns = [number("set", "set", whole), *([word("hole", "name")] if labels else [])]
    columns += [number(f"{axis}, mm", f"{axis}_mm", coordinate) for axis in "xy"]
    columns.append(number("gap after it, mm", "gap_mm", beside(record["limit_mm"] or 0.0, raised)))
    caption = "*The order that keeps the gap small*: the reverse of removing what is needed least."
    return [
        Figure("gap-while-setting", "*The largest gap after each fastener.*", drawing),
        Table("order", caption, table, columns),
    ]
