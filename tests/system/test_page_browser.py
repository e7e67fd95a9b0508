"""The page in a browser: its verdicts against the judge's, sorting, filters, the address, the keyboard."""

import itertools
import time
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlencode

import numpy as np
import pandas as pd
import pytest
from commands import harness
from hostile_texts import HOSTILE, results, solution
from published_runs import SAMPLED, page_of
from synthetic_results import SIZES, everything, row, write_rows
from synthetic_results import results as results_of
from synthetic_series import made as made_series

from harness.results.series_file import write_contacts
from report.page.answer_page_data import two_answers_data
from report.page.contact_maps import SHARES
from report.page.page_file import write
from report.page.run_page_data import run_data
from report.results.reader import read
from report.results.series_results import read as read_series
from report.writers.answer_report import write as write_solution
from report.writers.series_report import write as write_series

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blank_pictures")]
LOADS = itertools.count()
SEEN = "[...document.querySelectorAll('#tables td[data-key]')]"
NAMED = r"td.title.split('\n')[0].split(' on ')"  # label and scene
#: The figure that has a renderer of a name.
ROOT = "Bokeh.documents.map(made => made.roots()[0]).find(root => root.renderers.some(r => r.name === '{}'))"
#: The place in the window of an item of the renderer of a name.
PLACE = """
const [name, x, y, place] = arguments, root = ROOT, view = Bokeh.index.find_one(root);
const {data} = root.renderers.find(each => each.name === name).data_source;
const box = view.canvas_view.el.getBoundingClientRect(), {x_scale, y_scale} = view.frame;
return [box.left + x_scale.compute(data[x][place]), box.top + y_scale.compute(data[y][place])];
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[pd.DataFrame, Path]:
    """The cells of made-up results, and their page."""
    folder = tmp_path_factory.mktemp("made")
    found = read(everything(folder, SIZES))
    cells = found.cells[found.cells["status"] != "unsupported"]
    return cells, write(folder / "index.html", "Made up", run_data(found), folder)


def page_with(folder: Path, rows: list[dict[str, Any]], directory: Path | None = None) -> Path:
    """The page of these rows. directory : of the rows, as the page's commands name it."""
    return write(folder / "index.html", "", run_data(results_of(folder, rows)), directory)


def opened(driver: Any, page: Path, address: str = "") -> None:
    """Load a page anew, and wait for it: Chromium's driver may return before its scripts have run.

    Through about:blank instead the driver hangs once in a hundred times.
    """
    load = f"?{next(LOADS)}"
    driver.get(f"{page.as_uri()}{load}#{address}")
    eventually(driver, f"location.search === '{load}' && document.readyState === 'complete'")


def errors(driver: Any) -> list[str]:
    return [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]


def eventually(driver: Any, script: str) -> Any:
    """What the script returns once that is not empty; maps are unpacked after the page is shown."""
    for _ in range(100):
        if found := driver.execute_script(f"return {script}"):
            return found
        time.sleep(0.05)
    raise AssertionError(script)


def chosen(driver: Any, name: str, value: str) -> None:
    """Set a control of the page."""
    driver.execute_script(
        "form.elements[arguments[0]].value = arguments[1]; form.dispatchEvent(new Event('input'))",
        name,
        value,
    )


def pointed(driver: Any, name: str, x: str, y: str, place: int) -> tuple[Any, str]:
    """A click on an item of a renderer, and the tooltip there. x, y : the columns of its place."""
    from selenium.webdriver import ActionChains

    root = ROOT.format(name)
    source = f"{root}?.renderers.find(each => each.name === '{name}').data_source"
    eventually(driver, f"{source}?.data.{x}.length && Bokeh.index.find_one({root})?.frame != null")
    time.sleep(0.5)  # until it is drawn
    left, top = driver.execute_script(PLACE.replace("ROOT", root), name, x, y, place)
    mouse = ActionChains(driver)
    for beside in (2, 0):  # the first move enters the figure
        mouse.w3c_actions.pointer_action.move_to_location(round(left) + beside, round(top))
    mouse.perform()
    tips = "[...document.querySelectorAll('.bk-Tooltip')].map(tip => tip.shadowRoot ?? tip)"
    script = f"{tips}.map(tip => tip.querySelector('.bk-tooltip-content').textContent).join('')"
    text = eventually(driver, script)
    return mouse.click(), str(text)


def judged(cells: pd.DataFrame, limit: float) -> pd.Series:
    """The judge's rule, written once more."""
    known = cells["reference_bound_mm"] <= 0.1 * limit
    verdict = np.where(cells["displacement_error_mm"] <= limit, "within", "outside")
    return pd.Series(np.where(cells["verdict"] == "no_answer", "no_answer", np.where(known, verdict, "?")))


def test_no_view_has_an_error(chromium: Any, made: tuple[pd.DataFrame, Path], tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("hostile", "solution", "series", "old", "new", "empty")]
    for folder in folders:
        folder.mkdir()
    hostile, answer, series, old, new, empty = folders
    found = read(results(hostile, HOSTILE))
    pages = [made[1], write(hostile / "index.html", str(found.suite["title"]), run_data(found), hostile)]
    pages.append(page_with(empty, [], empty))
    write_solution(solution(answer, HOSTILE))
    made_series(series)
    write_series(series)
    for side, seconds in ((old, 1.0), (new, 9.0)):
        write_rows(side, [row(solve_s=seconds), row(solver="gi")])
    harness("compare", old, new, "--out", tmp_path / "compared")
    pages += [answer / "index.html", series / "report" / "index.html", tmp_path / "compared" / "index.html"]
    errors(chromium)  # of other tests
    for page in pages:
        opened(chromium, page)
        views = chromium.execute_script(
            "return [...form.querySelectorAll('[name=view]')].map(each => each.value)"
        )
        for view in views or [""]:
            opened(chromium, page, f"view={view}&node=3&threshold=0.1&scale=log")
            shown = eventually(chromium, "document.querySelector('main, body').textContent")
            assert errors(chromium) == [], (page, view, shown[:200])


@pytest.mark.parametrize("directory", SAMPLED, ids=lambda path: path.name)
def test_published_rows_have_the_judges_verdict(chromium: Any, directory: Path) -> None:
    opened(chromium, page_of(directory))
    count, other = chromium.execute_script(
        "filtered(); const other = CELLS.filter(cell => cell.judged !== cell.verdict);"
        "return [CELLS.length, other.map(cell => cell.key)]"
    )
    assert count > 20
    assert other == []


def test_the_slider_judges_again(chromium: Any, made: tuple[pd.DataFrame, Path]) -> None:
    cells, page = made
    opened(chromium, page, "lines=label")
    for exponent in (3, 7, 8.5, 9, 11, 12):
        chosen(chromium, "limit", str(exponent))
        limit = float(f"{10**-exponent:.1e}")
        wanted = judged(cells, limit).replace("?", "cannot_be_judged").value_counts().to_dict()
        classes = chromium.execute_script(f"return {SEEN}.map(td => td.className.split(' ')[0])")
        assert pd.Series(classes).value_counts().to_dict() == wanted, exponent
        counted = chromium.execute_script("return form.elements.counts.textContent")
        assert f": {wanted.get('within', 0)} of {len(cells)} " in counted
        lines = chromium.execute_script("return ranking(filtered()).map(line => [line.within, line.rank])")
        assert all((rank is None) == (within == 0) for within, rank in lines)  # none without an answer


def test_the_limit_of_the_rows_is_that_of_the_page_with_all_its_digits(chromium: Any, tmp_path: Path) -> None:
    """1.24e-7 mm is 1.2e-7 in two digits, and 1.26e-7 mm 1.3e-7."""
    for limit, error, verdict in ((1.24e-7, 1.22e-7, "within"), (1.26e-7, 1.28e-7, "outside")):
        judged_at = {"limit_mm": limit, "limit_asked_mm": limit}
        rows = [row(displacement_error_mm=error, verdict=verdict, **judged_at)]
        opened(chromium, page_with(tmp_path, rows))
        assert chromium.execute_script("return filtered().map(cell => cell.judged)") == [verdict]
        before = chromium.execute_script("return at('limit')")
        chosen(chromium, "limit", "12")
        assert chromium.execute_script("return filtered().map(cell => cell.judged)") == ["cannot_be_judged"]
        chosen(chromium, "limit", before)
        assert chromium.execute_script("return filtered().map(cell => cell.judged)") == [verdict]


def test_bounds_are_rounded_upwards(chromium: Any, tmp_path: Path) -> None:
    opened(chromium, page_with(tmp_path, [row()]))
    script = "return [3.201e-16, 3.2e-16, 9.999e-9, null].map(bound => number(raised(bound)))"
    assert chromium.execute_script(script) == ["3.21e-16", "3.2e-16", "1e-8", "–"]


def test_an_answer_without_seconds_is_within_the_limit_all_the_same(chromium: Any, tmp_path: Path) -> None:
    rows = [row(setup_s=0.0, solve_s=0.0, form_s=0.0), row(solver="gi")]
    rows.append(row(solver="gi", scene="4386/1074", verdict="outside", displacement_error_mm=1e-6))
    opened(chromium, page_with(tmp_path, rows))
    script = "return ranking(filtered()).map(line => [line.name, line.within, line.scenes, line.rank])"
    assert chromium.execute_script(script) == [["ipm (dual)", 1, 1, 1], ["gi (dual)", 1, 2, 2]]


def test_a_column_sorts_up_and_down(chromium: Any, made: tuple[pd.DataFrame, Path]) -> None:
    """Cells that are not within the limit stay last, either way up."""
    cells, page = made
    opened(chromium, page)
    scene = "4386/1500"
    of_scene = cells[(cells["scene"] == scene) & (cells["verdict"] == "within")]
    wanted = list(of_scene.sort_values("load_case_s")["label"])
    sort = f"[...document.querySelectorAll('th button')].find(each => each.textContent.startsWith('{scene}'))"
    column = (
        f"return {SEEN}.map(td => {NAMED}).filter(names => names[1] === '{scene}').map(names => names[0])"
    )
    chromium.execute_script(f"{sort}.click()")
    assert chromium.execute_script(column)[: len(wanted)] == wanted
    chromium.execute_script(f"{sort}.click()")
    assert chromium.execute_script(column)[: len(wanted)] == wanted[::-1]


def test_the_ranking_is_by_share_then_by_time(chromium: Any, made: tuple[pd.DataFrame, Path]) -> None:
    cells, page = made
    opened(chromium, page, "limit=9&lines=label")
    good = cells.assign(good=judged(cells, 1e-9).to_numpy() == "within")
    seconds = good["load_case_s"].where(good["good"])
    slower = np.log(seconds / seconds.groupby(good["scene"]).transform("min"))
    lines = good.assign(slower=slower).groupby("label")
    ranked = chromium.execute_script(
        "return ranking(filtered()).map(line => [line.name, line.within, line.slower])"
    )
    shares = [lines["good"].mean()[name] for name, *_ in ranked]
    assert shares == sorted(shares, reverse=True)
    for name, within, mean in ranked:
        assert within == lines["good"].sum()[name]
        if within:
            assert mean == pytest.approx(np.exp(lines["slower"].mean()[name]))


def test_filters_a_baseline_and_the_address(chromium: Any, made: tuple[pd.DataFrame, Path]) -> None:
    cells, page = made
    opened(chromium, page)
    chosen(chromium, "n", "11308")
    chosen(chromium, "base", "gi (dual)")
    script = f"return {SEEN}.map(td => [...{NAMED}, td.textContent])"
    seen = chromium.execute_script(script)
    assert {scene for _, scene, _ in seen} == {"11308/2500"}
    assert len(seen) == (cells["n"] == 11308).sum()
    times = cells[cells["n"] == 11308].set_index("label")["load_case_s"]
    shown = {label: text for label, _, text in seen}
    assert float(shown["piqp (dual)"]) == pytest.approx(times["piqp (dual)"] / times["gi (dual)"], rel=0.05)
    address = chromium.current_url.split("#")[1]
    opened(chromium, page, address)
    assert chromium.execute_script(script) == seen


def test_enter_on_a_cell_opens_its_row_with_the_command(chromium: Any, tmp_path: Path) -> None:
    key = "4386/0052 ipm dual tol=1e-09 threads=2 repeat=0"
    odd = "4386/0052 it's dual tol=1e-09 threads=2 repeat=0"
    rows = [row(key=key), row(solver="it's", key=odd, solve_s=9.0)]
    page = page_with(tmp_path, rows, Path("results/made"))
    opened(chromium, page)
    again = "python -m harness run results/made --key '{}' --out results/again"
    for place, name in enumerate((key, odd.replace("'", "'\\''"))):
        chromium.execute_script(
            f"{SEEN}[{place}].focus(); document.activeElement.dispatchEvent("
            "new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}))"
        )
        command = chromium.execute_script("return dialog.querySelector('code').textContent")
        assert command == again.format(name)
        chromium.execute_script("dialog.close()")


def test_a_marker_tells_of_its_measurement_and_opens_its_row(chromium: Any, tmp_path: Path) -> None:
    """What the solver's name has of markup is text in both."""
    rows = [row(solver="<b>bold</b>", key="4386/0052 bold")]
    opened(chromium, page_with(tmp_path, rows), "view=precision")
    click, tooltip = pointed(chromium, "cells", "reached_mm", "seconds", 0)
    assert "<b>bold</b> (dual) on 4386/0052" in tooltip
    click.perform()
    assert "4386/0052 bold" in eventually(chromium, "dialog.open && dialog.textContent")


@pytest.mark.parametrize("pairs", [1, 2])
def test_a_map_of_a_series_has_its_worst_case_and_curves(chromium: Any, tmp_path: Path, pairs: int) -> None:
    """Of contacts of two pairs that lie above one another, both are of the largest gap."""
    gaps, contact = made_series(tmp_path), 7
    here = [contact]
    if pairs == 2:
        nodes = np.array([(x, y) for _ in range(2) for y in (0.0, 1.0) for x in (0.0, 1.0, 2.0)])
        write_contacts(tmp_path, {"m": np.array(12), "contact_nodes": nodes})
        here = [1, contact]
    write_series(tmp_path)
    opened(chromium, tmp_path / "report" / "index.html")
    click, tooltip = pointed(chromium, "above", "x", "y", contact)
    assert f"shown: {np.quantile(gaps[:, here], 0.95, axis=0).max():.4f}" in tooltip
    click.perform()
    about = "document.getElementById('about-map').textContent"
    eventually(chromium, f"{about}.includes('x = 1, y = {2 - pairs} mm')")
    curve = f"{ROOT.format('contact')}.renderers.find(each => each.name === 'contact').data_source.data.x"
    shown = eventually(chromium, f"{curve}.length && [...{curve}]")
    above = np.quantile(gaps[:, here], 1 - np.array(SHARES), axis=0).max(axis=1)
    assert shown == pytest.approx(above, rel=2.0**-11)
    worst = read_series(tmp_path).cases.sort_values("max_gap_mm")["case"].iloc[-1]
    chosen(chromium, "field", f"case {worst}, the worst")
    eventually(chromium, f"{about}.includes('case {worst}, the worst, mm')")


def test_a_map_has_the_largest_value_at_a_place_and_the_colours_asked_for(
    chromium: Any, tmp_path: Path
) -> None:
    """Contacts lie above one another; a change of 0 ends the colours, as any other does; x to 0.01 mm."""
    nodes = np.array([(x, y) for _ in range(2) for y in (0.0, 500.0, 900.0) for x in (0.0, 1077.93, 2000.0)])
    second = np.concatenate([np.arange(9.0), np.arange(9.0)[::-1]]) - 6
    record = {"scene": "a", "title": "b", "method": "c", "m": 18}
    record |= {"pairs": [{"pair": ["d", "e"], "start": 0, "stop": 18}]}
    arrays = [{"contact_nodes": nodes, "gap_before": gap, "gap_after": gap} for gap in (0 * second, second)]
    answers = [(record, each) for each in arrays]
    page = write(tmp_path / "index.html", "", two_answers_data(answers, answers))
    opened(chromium, page, urlencode({"view": "maps", "field": "second − first", "low": 0}))
    _, tooltip = pointed(chromium, "above", "x", "y", 4)
    assert "x, mm: 1077.93" in tooltip
    script = (
        "const plot = ROOT, shown = plot.renderers.find(each => each.name === 'change linear');"
        "return [[...shown.data_source.data.value], shown.glyph.fill_color.transform.low]"
    )
    shown = chromium.execute_script(script.replace("ROOT", ROOT.format("above")))
    assert shown == [2 * [2.0, 1.0, 0.0, -1.0, -2.0, -1.0, 0.0, 1.0, 2.0], 0.0]


def test_the_address_names_the_open_row(chromium: Any, tmp_path: Path) -> None:
    keys = ["4386/0052 gi tol=1e-9", "4386/0052 ipm tol=1e-9"]
    rows = [row(solver=key.split()[1], key=key) for key in keys]
    page = page_with(tmp_path, rows)
    opened(chromium, page, urlencode({"row": keys[1]}))
    assert keys[1] in chromium.execute_script("return dialog.open ? dialog.textContent : ''")
    chromium.execute_script("dialog.close()")
    assert eventually(chromium, "!location.hash.includes('row=')")
    chromium.execute_script(f"{SEEN}.find(td => td.dataset.key === arguments[0]).click()", keys[0])
    assert parse_qs(chromium.execute_script("return location.hash.slice(1)"))["row"] == [keys[0]]


def test_a_row_is_of_the_machine_that_is_named_or_chosen(chromium: Any, tmp_path: Path) -> None:
    names, key = ("One CPU", "Other CPU"), "4386/0052 ipm"
    rows = [row(key=key, machine=name, solve_s=1.0 + k) for k, name in enumerate(names)]
    page = page_with(tmp_path, rows)
    shown = "return dialog.open ? [...dialog.querySelectorAll('td')].map(td => td.textContent) : []"
    for name, other in (names, names[::-1]):
        opened(chromium, page, urlencode({"row": key, "machine": name}))
        found = chromium.execute_script(shown)
        assert (name in found, other in found) == (True, False)
        opened(chromium, page)
        chosen(chromium, "machine", name)
        chromium.execute_script(f"{SEEN}[0].click()")
        assert name in chromium.execute_script(shown)


def test_a_ladder_says_where_a_solver_breaks(chromium: Any, tmp_path: Path) -> None:
    rungs = {"1e+00": "within", "1e-02": "no_answer", "1e-04": "outside"}
    rows = [row(verdict=verdict) | {"scene": f"hard/supports/{name}"} for name, verdict in rungs.items()]
    rows.append(row() | {"scene": "hard/refinement/08"})
    opened(chromium, page_with(tmp_path, rows), "view=solver")
    text = chromium.execute_script("return document.getElementById('breaks').textContent")
    assert text == "Breaks at supports/1e-02."


def test_all_rungs_are_in_one_view(chromium: Any, tmp_path: Path) -> None:
    rows = [
        row(solver=solver) | {"scene": f"hard/{ladder}/{rung:03d}"}
        for ladder in ("supports", "units", "loads", "parts")
        for rung in range(27)
        for solver in ("ipm", "gi")
    ]
    opened(chromium, page_with(tmp_path, rows))
    assert chromium.execute_script(f"return {SEEN}.length") == len(rows)
    assert chromium.execute_script("return box.scrollWidth <= box.clientWidth")
