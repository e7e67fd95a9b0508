"""Puts a page together in one file: template, style, scripts, Bokeh, the banner and the data in few bytes."""

from __future__ import annotations

import json
import zlib
from base64 import b64encode
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd

from report.analysis.checks import commits_text
from report.document.blocks import Column, records
from report.document.escape import plain, quoted, script_json, short
from report.document.verdict_colours import FAIL, PASS
from report.page.page_figures import scripts
from report.results.series_results import Array

HERE = Path(__file__).parent
SCRIPTS = ("state", "judge", "tables", "plots", "page")
BY_TEMPLATE = ("banner", "headline", "tables", "views", "controls", "limit", "pictures")
BY_BOTH = ("styles", "figures")  # by the template and the scripts
DIGITS = 1 << 11  # what is dropped of a float32's mantissa: 3.6 decimal digits are left
Data = dict[str, Any]


def write(path: Path, title: str, data: Data, directory: Path | None = None) -> Path:
    """Write the page and return its path. directory : of the rows, as the page's commands name it."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), autoescape=True, undefined=jinja2.StrictUndefined
    )
    heading = plain(short(title, 150))
    scripted = {name: value for name, value in data.items() if name not in BY_TEMPLATE}
    scripted["directory"] = "" if directory is None else _named(directory)
    static = {name: data.get(name) or {} for name in (*BY_TEMPLATE, *BY_BOTH)}
    content = {
        **json.loads(script_json(static)),  # texts as they were: the template escapes them
        "title": heading,
        "pass": PASS,
        "fail": FAIL,
        "style": (HERE / "page.css").read_text("utf-8"),
        "data": script_json(scripted),
        "bokeh": scripts(),
        "scripts": [(HERE / f"{name}.js").read_text("utf-8") for name in SCRIPTS],
    }
    path.write_text(environment.get_template("page.html.j2").render(content), "utf-8")
    return path


def choice(name: str, label: str, options: Iterable[tuple[object, str]], views: str) -> Data:
    """A list above some views. options : values and texts, of which the first is chosen; "" chooses all."""
    return {
        "name": name,
        "label": label,
        "options": [[str(value), text] for value, text in options],
        "views": views,
    }


def table_data(title: str, columns: list[Column], data: pd.DataFrame, summary: str = "") -> Data:
    """The data of a table, shown as in a report."""
    lines = [[column.show(line) for column in columns] for line in records(data)]
    return {"title": title, "summary": summary, "heads": [c.heading for c in columns], "lines": lines}


def _named(directory: Path) -> str:
    """The directory relative to the current one, or its name alone if it lies elsewhere."""
    whole = directory.resolve()
    near = whole.relative_to(Path.cwd()) if whole.is_relative_to(Path.cwd()) else Path(whole.name)
    return str(quoted(near.as_posix()))


def banner(rows: pd.DataFrame, counts: str, warnings: Sequence[str], versions: Sequence[str] = ()) -> Data:
    """The machine, code and dates of some rows, as the top of the page shows them.

    rows : with `machine`, `commit`, `clean` and `recorded_at`.
    """
    rows = rows.assign(clean=rows["clean"].astype(float))  # true, false or not known
    times = sorted(time for time in rows["recorded_at"] if time)
    return {
        "machines": [name or "not recorded" for name in rows["machine"].unique()],
        "commits": commits_text(rows) if len(rows) else "",
        "measured": " to ".join(dict.fromkeys([minute(times[0]), minute(times[-1])])) if times else "",
        "versions": versions,
        "counts": counts,
        "warnings": warnings,
    }


def minute(time: str) -> str:
    """'2026-01-02 03:04 UTC'."""
    return f"{time[:16].replace('T', ' ')} UTC"


def column(values: pd.Series[Any]) -> list[Any] | Data:
    """Numbers as they are, missing ones null; texts as their distinct values and the place of each."""
    if pd.api.types.is_numeric_dtype(values.dtype):
        return [None if pd.isna(value) else float(value) for value in values]
    texts = ["" if value is None or value != value else str(value) for value in values]
    distinct = {text: place for place, text in enumerate(dict.fromkeys(texts))}
    return {"distinct": list(distinct), "places": [distinct[text] for text in texts]}


def packed(values: Array, limit: float = np.inf) -> str:
    """An array for a map, of about four digits, each on its side of a limit: base64 of deflated little-endian
    float32.
    """
    bits = values.astype("<f4").view("<u4")
    rounded = (bits + DIGITS // 2) & ~np.uint32(DIGITS - 1)
    shown = np.where(np.isfinite(values), rounded, bits).astype("<u4").view("<f4")
    with np.errstate(over="ignore"):  # of a limit beyond all float32
        nearest = np.float32(limit)
        most = nearest if float(nearest) <= limit else np.nextafter(nearest, np.float32(-np.inf))
        least = np.nextafter(most, np.float32(np.inf))  # above the limit
    return exact(np.where(values > limit, np.maximum(shown, least), np.minimum(shown, most)))


def exact(values: Array) -> str:
    """An array with all digits of a float32, for coordinates: base64 of its deflated bytes."""
    return b64encode(zlib.compress(np.ascontiguousarray(values, "<f4").tobytes(), 9)).decode()
