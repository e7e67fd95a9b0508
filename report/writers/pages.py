"""The templates of the pages."""

from __future__ import annotations

from pathlib import Path

import jinja2

from report.document.numbers import significant


def template(name: str) -> jinja2.Template:
    """A template of report/writers/templates, with the filter `significant`."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent / "templates")
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["significant"] = significant
    return environment.get_template(name)
