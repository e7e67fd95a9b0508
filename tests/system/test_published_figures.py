"""Every figure of a document that comes from the published rows, computed from them again."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from harness.results.published import SERIES, names, rows_of, seconds
from report.document.numbers import listed
from report.results.reader import Results, read
from report.writers import headlines
from report.writers.published import write_index
from solvers.registry import modules

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
        ("docs/series.md", "series", headlines.series_sentence),
        ("docs/methods.md", "methods", headlines.methods_advice),
    ],
)
def test_what_a_page_says_is_what_the_rows_say(
    page: str, suite: str, sentence: Callable[[Results], str]
) -> None:
    said = " ".join(sentence(results(suite)).split())
    assert said
    assert said in text(page)


def test_the_table_of_methods_is_that_of_the_rows_without_what_was_removed() -> None:
    lines = headlines.methods_table(results("methods")).splitlines()
    head, there = lines[:2], [line for line in lines[2:] if line.split()[1] in modules()]
    assert there
    assert "\n".join([*head, *there]) + "\n" in (ROOT / "docs/methods.md").read_text("utf-8")


def test_how_fast_it_is_from_the_scene_on() -> None:
    """The seconds at most, and how many times as long others take at least, at each size."""
    said = headlines.road_sentence(results("uncondensed"))
    found = re.findall(r"([\d.]+), ([\d.]+) and ([\d.]+)", said)
    seconds_, sizes, condensed, library = (list(numbers) for numbers in found)
    assert f"at most {listed(seconds_)} s at n = {listed(sizes)}." in text("README.md")
    assert f"takes at least {listed(library)} times as long." in text("README.md")
    for n, s, own, other in zip(sizes, seconds_, condensed, library, strict=True):
        assert f"| {n} | {s} s | {own} times as long | {other} times as long |" in text("docs/speed.md")


def test_on_how_many_problems_from_the_literature_clarabel_is_faster() -> None:
    rows = results("outside").rows
    rows = rows[(rows["form"] == "sparse") & (rows["verdict"] == "within")]
    steps = ["model_s", "convert_s", "prepare_s", "setup_s", "solve_s", "form_s"]
    spent = rows.assign(s=rows[steps].sum(axis=1)).pivot_table("s", "scene", "solver", "median")
    both = spent[["clarabel", "newton"]].dropna()
    said = re.search(
        r"On the (\w+) scenes that both solve .* faster than `newton` on (\d+)", text("docs/outside.md")
    )
    assert said is not None
    assert (said[1], int(said[2])) == ("ten", (both["clarabel"] < both["newton"]).sum())
    assert len(both) == 10


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
    """The time of a suite in the table of docs/suites.md; None if the table calls its times estimates."""
    page = (ROOT / "docs" / "suites.md").read_text("utf-8")
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
