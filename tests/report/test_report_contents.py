"""Links within a report and from a report to the page, and how wide its tables are."""

import json
import re
from pathlib import Path
from urllib.parse import parse_qs

import pandas as pd
import pytest
from synthetic_results import everything, row, write_rows
from test_page import SCENES

from report.document.blocks import WIDEST, Table, number
from report.document.contents import contents
from report.figures import style
from report.results.reader import read
from report.writers.markdown import write


def resolved(page: str) -> set[str]:
    """What links within a page may lead to: its headings as GitHub names them, and named places."""
    names: list[str] = []
    for heading in re.findall(r"^#+ (.+)$", page, re.MULTILINE):
        slug = re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")
        count = sum(
            name == slug or re.fullmatch(re.escape(slug) + r"-\d+", name) is not None for name in names
        )
        names.append(f"{slug}-{count}" if count else slug)
    return {*names, *re.findall(r'<a id="([^"]+)"></a>', page)}


def columns(page: str) -> list[int]:
    rules = re.findall(r"^\|[:|-]+\|$", page, re.MULTILINE)
    return [rule.count("|") - 1 for rule in rules]


def made(folder: Path) -> tuple[str, pd.DataFrame]:
    results = everything(folder, SCENES)
    lines = map(json.loads, (results / "measurements.jsonl").read_text("utf-8").splitlines())
    write_rows(results, [line | {"key": f"{line['scene']} no={k}"} for k, line in enumerate(list(lines))])
    return write(results).read_text("utf-8"), read(results).cells


def test_contents_scenes_and_rows_can_be_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "DPI", 40)
    page, cells = made(tmp_path)
    links = re.findall(r"\]\(#([^)]+)\)", page)
    assert {"summary", "machine-and-method"} <= set(links)
    assert sum(link.startswith("scene-") for link in links) == len(set(cells["scene"]))
    assert set(links) <= resolved(page)
    rows = [parse_qs(query)["row"][0] for query in re.findall(r"\]\(index\.html#([^)]+)\)", page)]
    assert sorted(rows) == sorted(cells["key"])
    assert len(rows) > 20
    assert page.index("Contents: ") < page.index("## Summary")
    assert len(columns(page)) > 5
    assert max(columns(page)) <= 8


def test_a_short_report_has_no_contents(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "DPI", 40)
    assert (
        "Contents" not in write(write_rows(tmp_path, [row() | {"scene": "hard/supports/1e+00"}])).read_text()
    )


def test_equal_titles_lead_to_a_heading_each() -> None:
    page = "## One, two\n\n## Other\n\n## One, two\n"
    found = re.findall(r"\(#([^)]+)\)", contents(["One, two", "Other", "One, two"]))
    assert found == ["one-two", "other", "one-two-1"]
    assert set(found) == resolved(page)


def test_further_columns_continue_below_with_the_first_repeated() -> None:
    data = pd.DataFrame({f"c{k}": [k] for k in range(12)})
    table = Table("", "", data, [number(f"c{k}", f"c{k}") for k in range(12)], keys=2)
    parts = [part.split("\n")[0].split("|")[1:-1] for part in table.markdown.split("\n\n")]
    headings = [[cell.strip() for cell in part] for part in parts]
    assert all(part[:2] == ["c0", "c1"] and len(part) <= WIDEST for part in headings)
    assert [name for part in headings for name in part[2:]] == [f"c{k}" for k in range(2, 12)]
