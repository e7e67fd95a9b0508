"""Links within a page."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

from .escape import file_name


def contents(titles: Iterable[str]) -> str:
    """Links to headings of these titles, in one paragraph; equal titles lead to one heading each, in turn."""
    seen: Counter[str] = Counter()
    links = []
    for title in titles:
        anchor = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")  # as GitHub names it
        again = f"-{seen[anchor]}" if seen[anchor] else ""
        seen[anchor] += 1
        links.append(f"[{title}](#{anchor}{again})")
    return " · ".join(links)


def scene_anchor(scene: str) -> str:
    """The name of the place where a scene's table is."""
    return f"scene-{file_name(scene)}"
