"""Puts a page together: template, style, scripts, D3 and the data, in one file."""

from __future__ import annotations

from pathlib import Path

import jinja2
from mpld3 import urls  # ships D3

from report.document.escape import plain, quoted, script_json, short

from .packed import Data

HERE = Path(__file__).parent
SCRIPTS = (
    "state",
    "judge",
    "matrix",
    "details",
    "plots",
    "lines",
    "solver",
    "maps",
    "curves",
    "compare",
    "page",
)


def write(path: Path, title: str, data: Data, directory: Path | None = None) -> Path:
    """Write the page and return its path. directory : of the rows, as the page's commands name it."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), autoescape=True, undefined=jinja2.StrictUndefined
    )
    heading = plain(short(title, 150))
    named = data | {"title": heading, "directory": "" if directory is None else _named(directory)}
    content = {
        "title": heading,
        "style": (HERE / "page.css").read_text("utf-8"),
        "data": script_json(named),
        "d3": Path(urls.D3_LOCAL).read_text("utf-8"),
        "scripts": [(HERE / f"{name}.js").read_text("utf-8") for name in SCRIPTS],
    }
    path.write_text(environment.get_template("page.html.j2").render(content), "utf-8")
    return path


def _named(directory: Path) -> str:
    """The directory from here, or its name alone if it lies elsewhere."""
    whole = directory.resolve()
    near = whole.relative_to(Path.cwd()) if whole.is_relative_to(Path.cwd()) else Path(whole.name)
    return str(quoted(near.as_posix()))
