"""Every figure of a document that comes from the published rows, computed from them again."""

import re
from functools import cache
from pathlib import Path

import pytest

from harness.results.schema import STEPS
from report.document.blocks import Table
from report.document.numbers import listed, power, raised, significant, tidy_power
from report.results.reader import Results, read
from report.sections import speed
from report.sections.series_throughput import compared
from solvers.registry import modules
from studies.publish import NAMES, PUBLISHED, SERIES, minutes, rows_of, write_index

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
SUITES = [name for name in NAMES if (PUBLISHED / name / "measurements.jsonl").is_file()]
MEASURED_SERIES = [name for name in SERIES if (PUBLISHED / name).is_dir()]
RANGE = 1.15  # of a suite's time, stated to measured; or two minutes


@cache
def results(suite: str) -> Results:
    return read(PUBLISHED / suite)


def text(page: str) -> str:
    """Without the ends of lines."""
    return " ".join((ROOT / page).read_text("utf-8").split())


def test_the_speed_of_the_readme_is_the_table_of_the_index() -> None:
    """Which is that of the rows."""
    index = (PUBLISHED / "index.md").read_text("utf-8")
    table = index.partition("## How fast is it?\n\n")[2].strip()
    assert table.startswith("| question ")
    for page in ("README.md", "docs/speed.md"):
        assert f"\n\n{table}\n\n" in (ROOT / page).read_text("utf-8"), page


def settings_of(library: str) -> list[str]:
    """The lines of docs/libraries.md of a library: form, setting, seconds of all steps at the loosest
    tolerance that suffices, and that tolerance; or the limit that stopped it; or that none suffices.
    """
    rows = results("libraries").rows
    lines = []
    for (form, variant), cell in rows[rows["solver"] == library].groupby(["form", "variant"], sort=False):
        within = cell[cell["verdict"] == "within"]
        late, full = (cell[cell["status"] == status] for status in ("time_limit", "memory_limit"))
        said, at = "no tolerance suffices", "–"
        if len(within):
            best = within.loc[within["tolerance"].idxmax()]
            said, at = significant(best[list(STEPS)].sum(), 3), tidy_power(best["tolerance"])
        elif len(late):
            said = f"more than {significant(late['time_limit_s'].max(), 2)}"
        elif len(full):
            said = f"more than {full['memory_limit_mib'].max() / 2**10:g} GiB"
        lines.append(f"| {form} | {variant or 'as set'} | {said} | {at} |")
    return lines


def test_the_settings_of_the_libraries_are_those_of_the_rows() -> None:
    page = (ROOT / "docs/libraries.md").read_text("utf-8")
    said = {
        part.split("`")[0]: part[part.index("\n| form") :].split("\n\n")[0].splitlines()[3:]
        for part in page.split("\n## `")[1:]
    }
    assert said == {library: settings_of(library) for library in said}
    assert set(said) == set(results("libraries").rows["solver"])


def test_the_rates_of_a_series_are_those_of_the_rows() -> None:
    """Load cases per second of the fastest line with two threads, and the fastest library's seconds."""
    rows = compared(results("series").rows.query("threads_asked == 2 and case.notna()"))
    later = rows.groupby(["n", "solver", "variant"])["later_s"].median().groupby("n").min()
    first, *others = (f"{significant(1 / s, 2)} at {n:.0f}" for n, s in later.items())
    first = first.replace(" at ", " load cases per second at n = ")
    library = listed([significant(s, 2) for s in rows.groupby("n")["library_s"].first().tolist()])
    said = f"{listed([first, *others])}; a case of the fastest library takes {library} s"
    assert said in text("docs/series.md")


def test_the_series_of_the_page_is_the_published_one() -> None:
    rows = rows_of(PUBLISHED / "gaps")
    spent = sum(row.get(step) or 0.0 for row in rows for step in ("setup_s", "solve_s", "form_s"))
    within, bound = sum(row["verdict"] == "within" for row in rows), max(row["bound_mm"] for row in rows)
    said = (
        f"{len(rows)} random load cases on {SERIES['gaps'][0]}: {within} proven to be within "
        f"{power(raised(bound, 2), 2)} mm, {significant(len(rows) / spent, 2)} per second, the proof included"
    )
    assert said in text("docs/series.md")
    assert f"series {' '.join(SERIES['gaps'])} --out" in text("docs/series.md")


def test_the_methods_of_the_page_are_those_of_the_report_without_what_was_removed() -> None:
    section = speed.methods(results("methods"))
    assert section is not None
    (table,) = (block.markdown for block in section.blocks if isinstance(block, Table))
    lines = table.splitlines()
    head, there = lines[:2], [line for line in lines[2:] if line.split()[1] in modules()]
    assert there
    assert "\n".join([*head, *there]) + "\n" in (ROOT / "docs/methods.md").read_text("utf-8")


def test_on_how_many_problems_from_the_literature_clarabel_is_faster() -> None:
    rows = results("outside").rows
    rows = rows[(rows["form"] == "sparse") & (rows["verdict"] == "within")]
    steps = ["model_s", "convert_s", "prepare_s", "setup_s", "solve_s", "form_s"]
    spent = rows.assign(s=rows[steps].sum(axis=1)).pivot_table("s", "scene", "solver", "median")
    both = spent[["clarabel", "newton"]].dropna()
    pattern = r"On the (\w+) scenes that both solve .* faster than `newton` on (\d+)"
    said = re.search(pattern, text("docs/outside.md"))
    assert said is not None
    assert (said[1], int(said[2])) == ("ten", (both["clarabel"] < both["newton"]).sum())
    assert len(both) == 10


def test_the_suite_measured_twice_has_the_same_verdicts_and_these_ratios() -> None:
    """docs/machine.md: the median over the scenes of solve time to newton's, each from its own rows."""
    first, again = (results(name).rows.set_index("key").sort_index() for name in ("default", "default-again"))
    assert list(first.index) == list(again.index)
    assert list(first["verdict"]) == list(again["verdict"])
    long = first["solve_s"] > 1
    slower = (again["solve_s"] / first["solve_s"])[long]
    least, most = significant(slower.min(), 2), significant(slower.max(), 2)
    said = f"{least} to {most} times as long, {slower.median():.2f} in the median"
    assert said in text("docs/machine.md")
    sides = []
    for rows in (first, again):
        within = rows[rows["verdict"] == "within"]
        spent = within.pivot_table("solve_s", "scene", ["solver", "form"])
        sides.append(spent.div(spent["newton", "dual"], axis=0).median())
    for (solver, form), group in first.groupby(["solver", "form"]):
        count = f"{(group['verdict'] == 'within').sum()} of {len(group)}"
        ratios = [significant(side[solver, form], 2) if (solver, form) in side else "–" for side in sides]
        line = " | ".join([f"| `{solver}`", form, count, count, *ratios])
        assert f"\n{line} |\n" in (ROOT / "docs/machine.md").read_text("utf-8")


def test_how_large_it_can_get_is_extrapolated_from_the_rows() -> None:
    """N and b are counted; the rest is of the rows of newton in the sparse form."""
    rows = results("scaling").rows.query("solver == 'newton' and form == 'sparse'").set_index("n")
    table = (ROOT / "docs/large.md").read_text("utf-8").partition("| n | N | b |")[2].partition("\n\n")[0]
    lines = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    assert len(lines) == 4
    for n, N, b, *said in lines:
        row, (size, width) = rows.loc[int(n.replace(" ", ""))], (float(t.replace(" ", "")) for t in (N, b))
        prepared, solved, peak = row["prepare_s"], row["solve_s"], row["peak_rss_mib"] / 1024
        rates = (1e9 * prepared / (size * width**2), 1e9 * solved / (size * width))
        figures = (prepared, rates[0], solved, rates[1], peak)
        for written, figure in zip(said, figures, strict=True):
            assert float(written) == pytest.approx(figure, rel=0.05), n


def test_the_index_is_that_of_the_rows(tmp_path: Path) -> None:
    for directory in PUBLISHED.iterdir():
        if directory.is_dir():
            (tmp_path / directory.name).symlink_to(directory)
    index = write_index(tmp_path).read_text("utf-8")
    assert (PUBLISHED / "index.md").read_text("utf-8") == index, "python -m studies.publish --index"
    assert index.count("](") == len(SUITES) + len(MEASURED_SERIES) + 1  # the paper's study


@pytest.mark.parametrize("suite", SUITES)
def test_the_time_of_a_suite_is_that_of_its_rows(suite: str) -> None:
    page, taken = (ROOT / "docs" / "suites.md").read_text("utf-8"), minutes(rows_of(PUBLISHED / suite))
    line = re.search(rf"^\| `{suite}` \|.*\| (?:(\d+) h ?)?(?:(\d+) min)? \|$", page, re.MULTILINE)
    stated = 60 * int(line[1] or 0) + int(line[2] or 0)
    assert taken is not None
    assert abs(stated - taken) <= 2 or 1 / RANGE <= stated / taken <= RANGE, taken


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_quotes_no_commit_but_the_published(page: Path) -> None:
    quoted = re.findall(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{7,40}\b", page.read_text("utf-8"))
    known = {str(row.get("commit")) for name in SUITES if quoted for row in rows_of(PUBLISHED / name)}
    for digits in quoted:
        assert any(commit.startswith(digits) for commit in known), digits
