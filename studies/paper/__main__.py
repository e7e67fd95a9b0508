"""`python -m studies.paper DIR`: writes DIR/study/study.md from the results of the suite `paper` in DIR."""

from __future__ import annotations

import sys
from pathlib import Path

from report.figures import style
from report.results.reader import read
from report.writers.sections_writer import emptied, written

from . import claims, figures5_7, table3, tables
from .rows import study_of

TITLE = "The paper's claims, tables and figures, beside its published numbers"

SECTIONS = (
    claims.section,
    tables.cg_iterations,
    tables.starting_points,
    table3.section,
    tables.test_problems,
    figures5_7.section,
)


def write(directory: Path) -> Path:
    """Returns the path of the page. Raises FileNotFoundError, ValueError."""
    found = study_of(read(directory))
    with style.applied():
        made = [section(found) for section in SECTIONS]
    target = emptied(directory / "study", "study.md") / "study.md"
    return written(target, TITLE, [section for section in made if section])


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(write(Path(name)))
