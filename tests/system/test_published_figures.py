"""Every figure of a document that comes from the published rows, computed from them again."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from harness.results.published import SERIES, names, rows_of, seconds
from report.results.reader import Results, read
from report.writers import headlines
from report.writers.published import write_index

ROOT = Path(__file__).parents[2]
PUBLISHED = ROOT / "results" / "published"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
SUITES = [name for name in names() if (PUBLISHED / name / "measurements.jsonl").is_file()]
RANGE = 1.15  # of a suite's time, stated to measured; or two minutes


@cache
def results(suite: str) -> Results:
    return read(PUBLISHED / suite)


def text(page: str) -> str:
    """Without the ends of lines."""
    return " ".join((ROOT / page).read_text("utf-8").split())


@pytest.mark.parametrize(
    ("page", "suite", "sentence"),
    [
        ("README.md", "speed", headlines.ratio_sentence),
        ("README.md", "speed", headlines.contact_sentence),
        ("README.md", "uncondensed", headlines.road_sentence),
        ("docs/series.md", "series", headlines.series_sentence),
        ("docs/methods.md", "methods", headlines.methods_advice),
        ("docs/methods.md", "methods", headlines.methods_table),
    ],
)
def test_what_a_page_says_is_what_the_rows_say(
    page: str, suite: str, sentence: Callable[[Results], str]
) -> None:
    said = " ".join(sentence(results(suite)).split())
    assert said
    assert said in text(page)


def test_the_series_of_the_page_is_the_published_one() -> None:
    assert headlines.gaps_sentence(PUBLISHED / "gaps") in text("docs/series.md")
    assert f"series {' '.join(SERIES['gaps'])} --out" in text("docs/series.md")


def test_the_index_is_that_of_the_rows(tmp_path: Path) -> None:
    for directory in PUBLISHED.iterdir():
        if directory.is_dir():
            (tmp_path / directory.name).symlink_to(directory)
    index = write_index(tmp_path).read_text("utf-8")
    assert (PUBLISHED / "index.md").read_text("utf-8") == index, "python -m harness report results/published"
    assert index.count("\n") > 30


def stated_minutes(suite: str) -> float | None:
    """The time of a suite in the README's table; None if the table calls its times estimates."""
    page = (ROOT / "README.md").read_text("utf-8")
    if "| time on two cores, estimated |" in page:
        return None
    line = re.search(rf"^\| `{suite}` \|.*\| (?:(\d+) h ?)?(?:(\d+) min)? \|$", page, re.MULTILINE)
    return 60 * int(line[1] or 0) + int(line[2] or 0)


@pytest.mark.parametrize("suite", SUITES)
def test_the_time_of_a_suite_is_that_of_its_rows(suite: str) -> None:
    """An estimate until all that is published names its commit."""
    rows = rows_of(PUBLISHED / suite)
    stated, taken = stated_minutes(suite), seconds(rows)
    if stated is None:
        assert any(row.get("commit") is None for name in SUITES for row in rows_of(PUBLISHED / name))
        return
    assert abs(stated - taken / 60) <= 2 or 1 / RANGE <= stated / (taken / 60) <= RANGE, taken / 60


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_quotes_no_commit_but_the_published(page: Path) -> None:
    quoted = re.findall(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{7,40}\b", page.read_text("utf-8"))
    known = (
        {str(row.get("commit")) for name in SUITES for row in rows_of(PUBLISHED / name)} if quoted else set()
    )
    for digits in quoted:
        assert known, digits
        assert all(commit.startswith(digits) for commit in known), digits
