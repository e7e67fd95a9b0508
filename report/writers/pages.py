"""The templates of the pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2

from report.document.escape import markdown, short, wrapped
from report.document.numbers import significant


def rendered(name: str, **content: Any) -> str:
    """A page from report/writers/templates, in which quoted text is spelled out for Markdown.

    Filters: significant, short, wrapped.
    """
    loader = jinja2.FileSystemLoader(Path(__file__).parent / "templates")
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"significant": significant, "short": short, "wrapped": wrapped}
    return markdown(environment.get_template(name).render(content))
