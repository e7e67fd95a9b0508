"""The page in a browser: its verdicts against the judge's, sorting, filters, the address, the keyboard."""

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlencode

import numpy as np
import pandas as pd
import pytest
from commands import harness
from hostile_texts import HOSTILE, results, solution
from synthetic_results import everything, row, write_rows
from synthetic_results import results as results_of
from synthetic_series import made as made_series
from test_page import DIRECTORIES, SCENES

from report.page.run import run_data
from report.page.write import write
from report.results.reader import read
from report.results.series_results import read as read_series
from report.writers.answer_report import write as write_solution
from report.writers.series_report import write as write_series

pytestmark = pytest.mark.slow
FLAGS = (
    *("headless", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "disable-sync"),
    *("disable-background-networking", "disable-component-update", "window-size=1400,1000"),
)
RANKED = "return ranking(filtered(), Number(STATE.limit)).lines"
SEEN = "[...document.querySelectorAll('#view td[data-key]')]"


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A driver of one without a window or a network; where none is installed, the tests skip."""
    driver = shutil.which("chromedriver")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if not (driver and chromium):
        pytest.skip("no Chromium with its driver is installed (apt install chromium-driver)")
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for flag in (*FLAGS, f"user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(f"--{flag}")
    found = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    found.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})  # else no event of focus
    try:
        yield found
    finally:
        found.quit()


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[pd.DataFrame, Path]:
    """The cells of made-up results, and their page."""
    folder = tmp_path_factory.mktemp("made")
    found = read(everything(folder, SCENES))
    cells = found.cells[found.cells["status"] != "unsupported"]
    return cells, write(folder / "index.html", "Made up", run_data(found), folder)


def opened(driver: Any, page: Path, address: str = "") -> None:
    driver.get("about:blank")
    driver.get(f"{page.as_uri()}#{address}")


def errors(driver: Any) -> list[str]:
    return [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]


def eventually(driver: Any, script: str) -> Any:
    """What the script returns once that is not empty; maps are unpacked after the page is shown."""
    for _ in range(100):
        if found := driver.execute_script(f"return {script}"):
            return found
        time.sleep(0.05)
    raise AssertionError(script)


def judged(cells: pd.DataFrame, limit: float) -> pd.Series:
    """The judge's rule, written once more."""
    known = cells["reference_bound_mm"] <= 0.1 * limit
    verdict = np.where(cells["displacement_error_mm"] <= limit, "within", "outside")
    return pd.Series(np.where(cells["verdict"] == "no_answer", "no_answer", np.where(known, verdict, "?")))


def test_no_view_of_any_page_has_an_error(
    chromium: Any, made: tuple[pd.DataFrame, Path], tmp_path: Path
) -> None:
    folders = [tmp_path / name for name in ("hostile", "solution", "series", "old", "new", "empty")]
    for folder in folders:
        folder.mkdir()
    hostile, answer, series, old, new, empty = folders
    found = read(results(hostile, HOSTILE))
    pages = [made[1], write(hostile / "index.html", str(found.suite["title"]), run_data(found), hostile)]
    pages.append(write(empty / "index.html", "", run_data(results_of(empty, [])), empty))
    write_solution(solution(answer, HOSTILE))
    made_series(series)
    write_series(series)
    for side, seconds in ((old, 1.0), (new, 9.0)):
        write_rows(side, [row(solve_s=seconds), row(solver="gi")])
    harness("compare", old, new, "--out", tmp_path / "compared")
    pages += [answer / "index.html", series / "report" / "index.html", tmp_path / "compared" / "index.html"]
    for page in pages:
        opened(chromium, page)
        for view in chromium.execute_script("return Object.keys(VIEWS)"):
            opened(chromium, page, f"view={view}&node=3&threshold=0.1")
            shown = eventually(chromium, "document.getElementById('view').textContent")
            assert errors(chromium) == [], (page, view, shown)


@pytest.mark.parametrize("directory", DIRECTORIES, ids=lambda path: path.name)
def test_at_their_own_limits_all_published_rows_have_the_judges_verdict(
    chromium: Any, directory: Path, tmp_path: Path
) -> None:
    opened(chromium, write(tmp_path / "index.html", "Published", run_data(read(directory)), directory))
    count, other = chromium.execute_script(
        "const other = CELLS.filter(cell => verdict(cell, Number(STATE.limit)) !== cell.verdict);"
        "return [CELLS.length, other.map(cell => cell.key)]"
    )
    assert count > 20
    assert other == []


@pytest.mark.parametrize("exponent", [3, 7, 8.5, 9, 11, 12])
def test_the_slider_judges_again(chromium: Any, made: tuple[pd.DataFrame, Path], exponent: float) -> None:
    cells, page = made
    opened(chromium, page, "rows=all")
    chromium.execute_script(
        "const s = document.getElementById('limit'); s.value = arguments[0];"
        "s.dispatchEvent(new Event('input', {bubbles: true}))",
        str(exponent),
    )
    limit = float(f"{10**-exponent:.1e}")
    wanted = judged(cells, limit).replace("?", "cannot_be_judged").value_counts().to_dict()
    classes = chromium.execute_script(f"return {SEEN}.map(td => td.className.split(' ')[1])")
    assert pd.Series(classes).value_counts().to_dict() == wanted
    within = chromium.execute_script("return document.getElementById('counts').textContent")
    assert within.startswith(f"{wanted.get('within', 0)} of {len(cells)} ")
    lines = chromium.execute_script(f"{RANKED}.map(line => [line.within, line.rank])")
    assert all((rank == "–") == (within == 0) for within, rank in lines)  # without an answer there is none


def test_a_column_sorts_up_and_down(chromium: Any, made: tuple[pd.DataFrame, Path]) -> None:
    cells, page = made
    opened(chromium, page)
    scene = "4386/1500"
    rows = "[...document.querySelectorAll('#view tbody tr')].map(tr => [...tr.cells]"
    column = rows + f".map(td => td.cell).find(cell => cell && cell.scene === '{scene}')?.label ?? '')"
    of_scene = cells[(cells["scene"] == scene) & (cells["verdict"] == "within")]
    wanted = list(of_scene.sort_values("load_case_s")["label"])
    click = f"document.querySelector('[data-sort=\"scene {scene}\"]').click()"
    chromium.execute_script(click)
    assert chromium.execute_script(f"return {column}")[: len(wanted)] == wanted
    chromium.execute_script(click)
    assert chromium.execute_script(f"return {column}")[-len(wanted) :] == wanted[::-1]


def test_a_click_beside_a_heading_sorts_the_most_within_first(chromium: Any, tmp_path: Path) -> None:
    """Also beside one that stands upright, as of more than eight scenes."""
    from selenium.webdriver import ActionChains

    rows = [row(f"4386/{k:04d}", "a", solve_s=2.0) for k in range(9)]
    rows += [row(f"4386/{k:04d}", "b", verdict="outside", displacement_error_mm=1e-3) for k in range(8)]
    rows += [row("4386/0008", "b")]
    opened(chromium, write(tmp_path / "index.html", "", run_data(results_of(tmp_path, rows))))
    first = "return document.querySelector('#view tbody th .name').textContent"
    sort = "document.querySelector(`[data-sort='{}']`).closest('th')"
    for name, wanted in (("within", "a (dual)"), ("scene 4386/0008", "b (dual)"), ("within", "a (dual)")):
        heading = chromium.execute_script(f"return {sort.format(name)}")
        corner = -heading.size["width"] // 2 + 3, -heading.size["height"] // 2 + 3
        ActionChains(chromium).move_to_element_with_offset(heading, *corner).click().perform()
        assert chromium.execute_script(first) == wanted


def test_the_ranking_is_by_the_share_within_then_by_time(
    chromium: Any, made: tuple[pd.DataFrame, Path]
) -> None:
    cells, page = made
    opened(chromium, page, "limit=1e-9")
    good = cells.assign(good=judged(cells, 1e-9).to_numpy() == "within")
    seconds = good["load_case_s"].where(good["good"])
    slower = np.log(seconds / seconds.groupby(good["scene"]).transform("min"))
    lines = good.assign(slower=np.exp(slower)).groupby("label")
    wanted = lines["good"].mean().sort_values(ascending=False)
    ranked = chromium.execute_script(f"{RANKED}.map(line => [line.name, line.within, line.slower])")
    shares = [wanted[name] for name, *_ in ranked]
    assert shares == sorted(shares, reverse=True)
    means = np.exp(
        np.log(good.assign(slower=np.exp(slower)).set_index("label")["slower"]).groupby("label").mean()
    )
    for name, within, mean in ranked:
        assert within == lines["good"].sum()[name]
        if within:
            assert mean == pytest.approx(means[name])


def test_the_csv_has_the_cells_shown_judged_at_the_limit(
    chromium: Any, made: tuple[pd.DataFrame, Path]
) -> None:
    cells, page = made
    opened(chromium, page, "limit=1e-9&rows=all&form=dual")
    lines = chromium.execute_script(
        "let saved; download = (name, lines) => { saved = lines; };"
        "document.getElementById('csv').click(); return saved"
    )
    table = pd.DataFrame(lines[1:], columns=lines[0]).sort_values(["scene", "label"], ignore_index=True)
    wanted = cells[cells["form"] == "dual"].sort_values(["scene", "label"], ignore_index=True)
    assert list(table["label"]) == list(wanted["label"])
    assert list(table["verdict"]) == list(judged(wanted, 1e-9).replace("?", "cannot_be_judged"))
    np.testing.assert_array_equal(table["load_case_s"].astype(float), wanted["load_case_s"])


def test_filters_a_baseline_and_the_address(chromium: Any, made: tuple[pd.DataFrame, Path]) -> None:
    cells, page = made
    opened(chromium, page)
    chromium.execute_script(
        "const s = document.getElementById('size'); s.value = '11308';"
        "s.dispatchEvent(new Event('change', {bubbles: true}));"
        'document.querySelector(\'[data-pin="newton (dual)"], [data-pin="gi (dual)"]\').click()'
    )
    seen = chromium.execute_script(f"return {SEEN}.map(td => [td.cell.scene, td.cell.label, td.textContent])")
    assert {scene for scene, *_ in seen} == {"11308/2500"}
    assert len(seen) == (cells["n"] == 11308).sum()
    times = cells[cells["n"] == 11308].set_index("label")["load_case_s"]
    shown = {label: text for _, label, text in seen}
    assert float(shown["piqp (dual)"]) == pytest.approx(times["piqp (dual)"] / times["gi (dual)"], rel=0.05)
    address = chromium.current_url.split("#")[1]
    opened(chromium, page, address)
    assert (
        chromium.execute_script(f"return {SEEN}.map(td => [td.cell.scene, td.cell.label, td.textContent])")
        == seen
    )


def test_enter_on_a_cell_opens_its_row_with_the_command(chromium: Any, tmp_path: Path) -> None:
    key = "4386/0052 ipm dual tol=1e-09 threads=2 repeat=0"
    odd = "4386/0052 it's dual tol=1e-09 threads=2 repeat=0"
    rows = [row(key=key), row(solver="it's", key=odd, solve_s=9.0)]
    page = write(tmp_path / "index.html", "", run_data(results_of(tmp_path, rows)), Path("results/made"))
    opened(chromium, page)
    press = "dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], bubbles: true}))"
    command = "return document.querySelector('dialog[open] code').textContent"
    chromium.execute_script("document.querySelector('#view td[tabindex=\"0\"]').focus()")
    chromium.execute_script(f"document.activeElement.{press}", "Enter")
    again = "python -m harness run results/made --key '{}' --out results/again"
    assert chromium.execute_script(command) == again.format(key)
    chromium.execute_script("document.getElementById('row').close()")
    chromium.execute_script("document.querySelector('#view td[tabindex=\"0\"]').focus()")
    chromium.execute_script(f"document.activeElement.{press}", "ArrowDown")
    chromium.execute_script(f"document.activeElement.{press}", "Enter")
    assert chromium.execute_script(command) == again.format(odd.replace("'", "'\\''"))


def test_a_map_of_a_series_has_its_worst_case_and_curves(chromium: Any, tmp_path: Path) -> None:
    gaps = made_series(tmp_path)
    write_series(tmp_path)
    opened(chromium, tmp_path / "report" / "index.html", "node=7")
    eventually(chromium, "document.querySelectorAll('#exceedance circle').length")
    chromium.execute_script("document.querySelector('#exceedance circle').focus()")
    tip = chromium.execute_script("return document.getElementById('tip').textContent")
    assert float(tip.split("exceed ")[1].split()[0]) == pytest.approx(gaps[:, 7].min(), rel=0.01)
    assert "x = 1 mm, y = 1 mm" in eventually(chromium, "document.getElementById('exceedance').textContent")
    worst = read_series(tmp_path).cases.sort_values("max_gap_mm")["case"].iloc[-1]
    chromium.execute_script("document.getElementById('about-map').textContent = ''")
    chromium.execute_script("document.getElementById('worst').click()")
    assert f"case {worst}, mm" in eventually(chromium, "document.getElementById('about-map').textContent")


def test_the_address_names_the_open_row(chromium: Any, tmp_path: Path) -> None:
    keys = ["4386/0052 gi tol=1e-9", "4386/0052 ipm tol=1e-9"]
    rows = [row(solver=key.split()[1], key=key) for key in keys]
    page = write(tmp_path / "index.html", "", run_data(results_of(tmp_path, rows)))
    dialog = "document.getElementById('row')"
    opened(chromium, page, urlencode({"row": keys[1]}))
    assert keys[1] in chromium.execute_script(f"return {dialog}.open ? {dialog}.textContent : ''")
    chromium.execute_script(f"{dialog}.close()")
    assert eventually(chromium, "!location.hash.includes('row=')")
    chromium.execute_script(f"{SEEN}.find(td => td.dataset.key === arguments[0]).click()", keys[0])
    assert parse_qs(chromium.execute_script("return location.hash.slice(1)"))["row"] == [keys[0]]


def test_a_ladder_says_where_a_solver_breaks(chromium: Any, tmp_path: Path) -> None:
    rungs = {"1e+00": "within", "1e-02": "no_answer", "1e-04": "within"}
    rows = [row(verdict=verdict) | {"scene": f"hard/supports/{name}"} for name, verdict in rungs.items()]
    rows.append(row() | {"scene": "hard/refinement/08"})
    opened(chromium, write(tmp_path / "index.html", "", run_data(results_of(tmp_path, rows))), "view=solver")
    text = chromium.execute_script("return document.getElementById('breaks').textContent")
    assert text == "Breaks at supports/1e-02. Correct on every rung of refinement."


def test_all_rungs_are_in_one_view(chromium: Any, tmp_path: Path) -> None:
    rows = [
        row(solver=solver) | {"scene": f"hard/{ladder}/{rung:03d}"}
        for ladder in ("supports", "units", "loads", "parts")
        for rung in range(27)
        for solver in ("ipm", "gi")
    ]
    opened(chromium, write(tmp_path / "index.html", "", run_data(results_of(tmp_path, rows))))
    assert chromium.execute_script(f"return {SEEN}.length") == len(rows)
    assert chromium.execute_script(
        "const box = document.querySelector('.scroll'); return box.scrollWidth <= box.clientWidth"
    )
