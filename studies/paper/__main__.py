"""`python -m studies.paper DIR`: writes DIR/study/study.md from the results of the suite `paper` in DIR."""

from __future__ import annotations

import sys
from pathlib import Path

from report.figures import style
from report.writers.pages import emptied, written

from . import claims, figures5_7, table1, table2, table3, table4
from .rows import study

TITLE = "The paper's claims, tables and figures, beside its published numbers"


def write(directory: Path) -> Path:
    """Returns the path of the page. Raises FileNotFoundError, ValueError."""
    found = study(directory)
    with style.applied():
        made = [part.section(found) for part in (claims, table1, table2, table3, table4, figures5_7)]
    target = emptied(directory / "study") / "study.md"
    return written(target, TITLE, [section for section in made if section])


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(write(Path(name)))
