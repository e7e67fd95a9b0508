"""The directories of published runs, and their pages."""

from pathlib import Path

from filelock import FileLock
from sample_size import ASKED

from problems import storage
from report.page.page_file import write
from report.page.run_page_data import run_data
from report.results.reader import read
from studies.publish import PUBLISHED

DIRECTORIES = sorted(path.parent for path in PUBLISHED.glob("*/measurements.jsonl"))
#: Every third of them, or with RIVETBENCH_LONG all.
SAMPLED = DIRECTORIES[:: 1 if ASKED else 3]


def page_of(directory: Path) -> Path:
    """Written once for all processes of pytest-xdist."""
    page = storage.root() / "pages" / f"{directory.name}.html"
    page.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(page.with_suffix(".lock")):
        if not page.exists():
            write(page, "Published", run_data(read(directory)), directory)
    return page
