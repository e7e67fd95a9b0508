"""What all sections have in common: each is left out without its rows, and can be linked to."""

import json
import re
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

import pandas as pd
import pytest
from matplotlib.figure import Figure as Drawing
from matplotlib.image import imread
from synthetic_results import HIGH, LOW, everything, no_answer, results, row, sweep, table, write_rows

from harness.results.schema import OWNERS
from report.document.blocks import WIDEST, Figure, Section, Table, number, word
from report.page.run_page_data import run_data
from report.results.reader import read
from report.sections import (
    SECTIONS,
    accuracy,
    random_scenes,
    series_throughput,
    speed,
    summary,
    time_to_solution,
)
from report.writers.sections_writer import written
from report.writers.suite_report import contents, write

SWEEP = [row(LOW, "a", tolerance=tolerance) for tolerance in (1e-6, 1e-9)]
DUAL, PRIMAL, SPARSE = (row(LOW, "newton", form) for form in ("dual", "primal", "sparse"))
#: Rows without both dense and sparse forms; a case of a series does not count, nor a form that is not taken.
WITHOUT_BOTH = [[DUAL, PRIMAL], [SPARSE], [DUAL, SPARSE | {"case": 3}]]
WITHOUT_BOTH += [[DUAL, SPARSE | {"status": "unsupported"}]]
COUNTED = row(LOW, "newton", details={"products": 15})


def resolved(page: str) -> set[str]:
    """What links within a page may lead to: its headings as GitHub names them."""
    names: list[str] = []
    for heading in re.findall(r"^#+ (.+)$", page, re.MULTILINE):
        slug = re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")
        count = sum(
            name == slug or re.fullmatch(re.escape(slug) + r"-\d+", name) is not None for name in names
        )
        names.append(f"{slug}-{count}" if count else slug)
    return set(names)


@pytest.mark.parametrize(
    ("section", "rows"),
    [
        *((of, SWEEP) for of in (accuracy.costs, accuracy.tolerances)),
        (speed.machine, [row(LOW, "newton")]),  # without benchmarks
        (summary.advice, [row(LOW, "a"), row(HIGH, "a")]),  # one method alone
        (speed.methods, [COUNTED, row(LOW, "piqp")]),  # one that counts is no comparison
        *((time_to_solution.section, rows) for rows in WITHOUT_BOTH),
    ],
)
def test_without_its_rows_there_is_no_section(tmp_path: Path, section: Any, rows: list[Any]) -> None:
    assert section(results(tmp_path, rows)) is None


def every_kind() -> list[dict[str, Any]]:
    """Rows for every section."""
    rows = [each for each in sweep() if each["solver"] in ("honest", "late")]
    rows += [row(LOW, "osqp", variant=version, solver_version=version) for version in ("1.0", "1.1")]
    for n, form in product((1170, 2522, 4386), ("dual", "sparse")):
        size = {"scene": f"scaling/{n}", "n": n, "m": n // 2}
        rows.append(row(LOW, "newton", form, cholesky_s=0.1, product_s=0.1, data_mib=100.0) | size)
    drawn = ("drawn/4386/", "drawn/superelements/", "sparse/slabs/20-")
    for k, (owner, solver) in product(range(3), zip(OWNERS, ("newton", "active-set", "piqp"), strict=True)):
        figures = {"owner": owner, "active": 300 + k, "details": {"products": 3}, "objective": -1.0}
        for scene in ("hard/steep/", "outside/membrane/", *drawn):
            rows.append(row(LOW, solver, **figures) | {"scene": f"{scene}{2**k}"})
        rows.append(row(HIGH, solver, case=k, warm=k > 0, owner=owner))
        rows.append(row(LOW, solver, "sparse", owner=owner, repeat=k, beside_round="2026", model_s=0.1))
        rows.append(row(HIGH, solver, variant=f"stopped at {2**k}", iteration_limit=2**k, owner=owner))
    return [*rows, row(LOW, "active-set", "sparse", owner="textbook", round="2026")]


UNPROVEN = {"verdict": "cannot_be_judged", "reference_bound_mm": None}
WRONG = {"verdict": "outside", "displacement_error_mm": 1e-3}
FAILURES: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "none": lambda r: {},
    "all outside": lambda r: WRONG if r["verdict"] == "within" else {},
    "no answer": lambda r: no_answer("crashed"),
    "nothing judged": lambda r: UNPROVEN if r["verdict"] != "no_answer" else {},
    "no answer at one size": lambda r: no_answer("crashed") if r["n"] == 4386 else {},
    "one method alone": lambda r: {} if r["solver"] == "newton" else no_answer("memory_limit"),
}


@pytest.mark.parametrize("failure", FAILURES)
def test_every_section_bears_failures(tmp_path: Path, failure: str) -> None:
    write_rows(tmp_path, [row(LOW, "piqp", "sparse", solver_version="0.9")])
    (tmp_path / "measurements.jsonl").rename(tmp_path / "measurements.outdated.jsonl")
    rows = [each | FAILURES[failure](each) for each in every_kind()]
    found = results(tmp_path, rows, {"scene": "hard/steep/1", "title": "made up"})
    parts = {about: found.about(about) for about in {about for about, _ in SECTIONS}}
    made = [of(parts[about]) for about, of in SECTIONS]
    assert all(made) or failure != "none"
    sections = [section for section in made if section]
    titles = {section.title for section in sections}
    assert {"Summary", "Series of load cases", "Every solver on every scene"} <= titles
    assert ("Error within a solve" in titles) == (failure in ("none", "all outside", "one method alone"))
    blocks = [block for section in sections for block in section.blocks]
    tables = [block.markdown for block in blocks if not isinstance(block, Figure)]
    assert not {"nan", "inf"} & set(re.findall(r"\w+", "\n".join(tables).lower()))
    assert len(run_data(found)["cells"]["key"]["places"]) == len(found.about("whole").cells)


def test_scenes_ladders_and_drawn_scenes_have_sections_of_their_own(tmp_path: Path) -> None:
    found = results(tmp_path, [row(LOW, "a")])
    assert random_scenes.section(found.about("drawn")) is None
    assert found.about("ladders").rows.empty
    text = write(write_rows(tmp_path / "failed", [row(LOW, "a", **no_answer("crashed"))])).read_text("utf-8")
    titles = ["Summary", "Every solver on every scene", "Machine and method"]
    assert re.findall("^## (.*)", text, re.M) == titles
    assert not [*(tmp_path / "failed" / "report").glob("*.png")]
    assert "Contents" not in text  # of a short report
    assert "Nothing was measured" in write(write_rows(tmp_path / "empty", [])).read_text("utf-8")


def test_a_whole_report_has_every_section_its_pictures_and_links_that_lead_somewhere(tmp_path: Path) -> None:
    folder = everything(tmp_path, {4386: [107, 1074], 6112: [1500]})
    lines = map(json.loads, (folder / "measurements.jsonl").read_text("utf-8").splitlines())
    write_rows(folder, [line | {"key": f"{line['scene']} no={k}"} for k, line in enumerate([*lines])])
    page, whole = write(folder).read_text("utf-8"), read(folder)
    parts = [(of, whole.about(about)) for about, of in SECTIONS]
    made = [of(part) for of, part in parts if len(part.rows)]
    assert re.findall("^## (.*)", page, re.M) == [section.title for section in made if section]
    for name in re.findall(r"!\[.*?\]\((.*?)\)", page):
        assert imread(folder / "report" / name)[..., :3].std() > 0.05, f"{name} is blank"
    assert (
        "Initial gap of 0.6 mm, pressed by fasteners, 1074 active contacts (49 % of 2193), cond(K) = 2.63e6"
        in page
    )
    assert not {"nan", "none"} & set(re.findall(r"\w+", page.lower().replace("none on every", "")))
    links = re.findall(r"\]\(#([^)]+)\)", page)
    assert {"summary", "machine-and-method"} <= set(links) <= resolved(page)
    rows = [parse_qs(query)["row"][0] for query in re.findall(r"\]\(index\.html#([^)]+)\)", page)]
    assert sorted(rows) == sorted(whole.cells["key"])
    assert page.index("Contents: ") < page.index("## Summary")
    rules = re.findall(r"^\|[:|-]+\|$", page, re.MULTILINE)
    assert len(rules) > 5
    assert max(rule.count("|") - 1 for rule in rules) <= WIDEST


def test_equal_titles_lead_to_a_heading_each() -> None:
    page = "## One, two\n\n## Other\n\n## One, two\n"
    found = re.findall(r"\(#([^)]+)\)", contents(["One, two", "Other", "One, two"]))
    assert found == ["one-two", "other", "one-two-1"]
    assert set(found) == resolved(page)


def test_a_text_that_is_not_known_is_a_dash() -> None:
    assert [word("title", "title").show({"title": text}) for text in ("", None, float("nan"))] == ["–"] * 3


def test_further_columns_continue_below_with_the_first_repeated() -> None:
    data = pd.DataFrame({f"c{k}": [k] for k in range(12)})
    table = Table("", "", data, [number(f"c{k}", f"c{k}") for k in range(12)], keys=2)
    parts = [part.split("\n")[0].split("|")[1:-1] for part in table.markdown.split("\n\n")]
    headings = [[cell.strip() for cell in part] for part in parts]
    assert all(part[:2] == ["c0", "c1"] and len(part) <= WIDEST for part in headings)
    assert [name for part in headings for name in part[2:]] == [f"c{k}" for k in range(2, 12)]


def test_blocks_of_two_sections_have_no_file_in_common(tmp_path: Path) -> None:
    data = pd.DataFrame({"a": [1]})
    sections = [Section(title, [Table("same", "", data, [number("a", "a")])]) for title in ("One", "Two")]
    with pytest.raises(ValueError, match=r"same\.csv would be written by the sections 'One' and 'Two'"):
        written(tmp_path / "report.md", "Both", sections)
    assert not [*tmp_path.iterdir()]


def test_a_picture_is_no_taller_than_what_can_be_drawn_and_shown(tmp_path: Path) -> None:
    """As of a trace on a hundred scenes."""
    tall = Drawing(figsize=(0.1, 500.0))
    written(tmp_path / "report.md", "", [Section("", [Figure("tall", "", tall)])])
    assert imread(tmp_path / "tall.png").shape[0] < 2**16


def test_a_series_without_an_answer_has_no_seconds_per_assembly(tmp_path: Path) -> None:
    rows = [row(case=k, warm=k > 0, **no_answer("crashed")) for k in range(2)]
    (line,) = table(series_throughput.section(results(tmp_path, rows))).data.to_dict("records")
    assert pd.isna(line["once_s"])
