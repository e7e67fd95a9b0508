"""`python -m studies.paper DIR`: writes DIR/study/study.md from the results of the suite `paper` in DIR."""

from __future__ import annotations

import sys
from pathlib import Path

from report.figures import style

from . import claims, figures5_7, table1, table2, table3, table4
from .page import Page
from .rows import study


def write(directory: Path) -> Path:
    """Returns the path of the page. Raises FileNotFoundError, ValueError."""
    found = study(directory)
    page = Page(directory / "study", "The paper's claims, tables and figures, beside its published numbers")
    with style.applied():
        for part in (claims, table1, table2, table3, table4, figures5_7):
            part.write(found, page)
    return page.write()


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(write(Path(name)))
