"""The page beside the report: all rows are in it, and no text of theirs is markup."""

import base64
import json
import zlib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hostile_texts import HOSTILE, MADE
from published_runs import DIRECTORIES, SAMPLED
from published_runs import page_of as published_page
from synthetic_results import SIZES, everything, results, row
from synthetic_series import made as made_series

from problems.model.surface import surface_of
from report.figures import node_cells, style
from report.page import answer_page_data, contact_maps, run_page_data
from report.page.page_file import packed, write
from report.page.run_page_data import run_data
from report.results.reader import read
from report.results.series_results import QUANTILES, quantile_maps
from report.results.series_results import read as read_series
from report.writers import comparison_report
from report.writers.series_report import write as write_series

#: `HOSTILE` in Markdown.
LITERAL = r"&lt;b&gt;x&lt;/b&gt;\|\!\[i\](http://e)&#96;c&#96;\$a_b\$ \*e\* \# h�\[31m��"
LARGEST = max(DIRECTORIES, key=lambda path: (path / "measurements.jsonl").stat().st_size)


class Page(HTMLParser):
    """The elements of a page, the text of each script, and the text that is shown."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.shown = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag == "script":
            self.texts.append("")

    def handle_data(self, data: str) -> None:
        if self.cdata_elem == "script":
            self.texts[-1] += data
        else:
            self.shown += data

    @property
    def data(self) -> Any:
        return json.loads(self.texts[0])


def column(data: Any, name: str) -> list[Any]:
    found = data["cells"][name]
    return found if isinstance(found, list) else [found["distinct"][place] for place in found["places"]]


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), "<f4")


def test_every_cell_is_in_the_page_with_all_its_digits(tmp_path: Path) -> None:
    directory = everything(tmp_path / "made", SIZES)
    data = Page(write(tmp_path / "index.html", "", run_data(read(directory))).read_text("utf-8")).data
    cells = read(directory).cells
    cells = cells[cells["status"] != "unsupported"]
    assert len(cells) == 48
    for name in ("scene", "label", "status", "verdict"):
        assert column(data, name) == list(cells[name])
    for name in ("load_case_s", "displacement_error_mm", "iterations"):
        found = np.array(column(data, name), dtype=float)
        np.testing.assert_array_equal(found, cells[name].to_numpy())
    assert {scene["scene"] for scene in data["scenes"]} == set(cells["scene"])


def test_repeats_limits_and_tolerances_of_the_cells(tmp_path: Path) -> None:
    """The bound of a cell is the largest of its repeats; a limit that conditioning eases stays; every row is
    counted, also those of tolerances tried in a search for one.
    """
    rung = {"scene": "hard/made/1", "limit_asked_mm": 1e-7}
    rows = [row(repeat=0, reference_bound_mm=3e-9), row(repeat=1, displacement_error_mm=2e-9)]
    rows += [row() | rung | {"limit_mm": 3e-5}, row(solver="gi") | rung]
    judged = ((7, "outside"), (8, "outside"), (9, "within"))
    rows += [row(solver="a", tolerance=10.0**-k, searched=True, verdict=verdict) for k, verdict in judged]
    data = run_data(results(tmp_path, rows))
    assert column(data, "bound_mm")[0] == 3e-9
    assert column(data, "displacement_error_mm")[0] == 2e-9
    assert column(data, "least_mm") == [None, 3e-5, None, None]
    assert data["banner"]["counts"].startswith("7 rows, 2 of them")


@pytest.mark.parametrize("directory", sorted({*SAMPLED, LARGEST}), ids=lambda path: path.name)
def test_a_published_page_is_small_and_alone(directory: Path, tmp_path: Path) -> None:
    file = published_page(directory)
    assert file.stat().st_size < 3_300_000
    page = Page(file.read_text("utf-8"))
    assert not any({"src", "href"} & set(attributes) for _, attributes in page.elements)
    assert len(column(page.data, "key")) > 20
    if directory == DIRECTORIES[0]:
        again = write(tmp_path / "again.html", "Published", run_data(read(directory)), directory)
        assert again.read_bytes() == file.read_bytes()


@pytest.mark.parametrize(("made", "written"), MADE)
def test_hostile_text_ends_no_script_and_begins_no_element(made: Any, written: Any, tmp_path: Path) -> None:
    """Nor is it too long, or mathematics, for a picture or a heading."""
    endless = "_|\ud800$x_{$ \\frac{1}{0} $"
    hostile = f"{endless}</script><script>alert(1)</script><!--<img src=x>{HOSTILE}{900 * endless}"
    report = written(made(tmp_path, hostile)).read_text("utf-8")
    assert len(report.splitlines()[0]) < 400
    assert LITERAL in report
    for raw in ("<b>", "![i]", "`c`", "$a_b$", "*e*", "\n# h", "\x1b", "\u202e"):
        assert raw not in report
    lines = [line.replace(r"\|", "") for line in report.splitlines() if LITERAL in line and line[0] == "|"]
    assert 1 not in {line.count("|") for line in lines}
    (path,) = tmp_path.rglob("index.html")
    text = path.read_text("utf-8")
    page = Page(text)
    assert [tag for tag, _ in page.elements].count("script") == 3
    assert "img" not in {tag for tag, _ in page.elements}
    assert text.count("</script>") == 3
    assert "</script><script>alert(1)</script>" in page.shown
    assert not any("\ue000" <= character <= "\uf8ff" for character in report + text)


def test_an_array_keeps_four_digits_its_side_of_a_limit_and_what_is_not_finite() -> None:
    """An outline is that of the verdict, however close a gap is to the limit."""
    values = np.random.default_rng(0).normal(size=2000) * 10.0 ** np.arange(-10, 10).repeat(100)
    values[:3] = 0.0, np.nan, np.inf
    for limit in (np.inf, 0.05):
        np.testing.assert_allclose(unpacked(packed(values, limit)), values, rtol=2.0**-12)
    for limit in (0.05, 0.1, 0.0):
        values = limit * (1 + np.array([-1e-4, -1e-12, 0.0, 1e-12, 1e-4]))
        shown = unpacked(packed(values, limit)).astype(float)
        np.testing.assert_array_equal(shown > limit, values > limit)


def test_an_answer_outside_its_own_limit_has_seconds_from_the_scene(tmp_path: Path) -> None:
    """The page may judge it by a looser limit."""
    wrong = {"displacement_error_mm": 5e-7, "verdict": "outside"}
    problem = {"scene": "4386/0052", "build_s": {"condensation": 7.0, "cholesky": 1.0, "Q": 2.0}}
    found = results(tmp_path, [row(**wrong), row(form="sparse", model_s=3.0, **wrong)], problem)
    seconds = column(run_data(found), "scene_s")  # 0.3 to prepare and 1.35 to solve
    assert seconds == pytest.approx([7.0 + 1.0 + 2.0 + 0.3 + 1.35, 3.0 + 0.3 + 1.35])


def test_maps_that_do_not_fit_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    directory = everything(tmp_path, SIZES)
    maps = run_data(read(directory))["maps"]
    assert [each["name"] for each in maps["maps"]] == ["4386/0100", "4386/1500", "11308/2500"]
    assert len(maps["groups"]) == 2  # two scenes have the same contacts
    with np.load(directory / "scenes" / "4386_1500.npz") as arrays:
        np.testing.assert_allclose(
            unpacked(maps["maps"][1]["fields"]["force"]["values"]), arrays["lam"], rtol=2.0**-12
        )
    monkeypatch.setattr(contact_maps, "BUDGET", 40_000)
    (directory / "scenes" / "4386_0100.npz").write_bytes(b"PK torn")
    (made,) = run_data(read(directory))["maps"]["maps"]
    assert made["about"].endswith(" Left out, too large or damaged: 4386/0100, 11308/2500.")


@pytest.mark.usefixtures("without_pictures")
def test_a_series_has_its_quantiles_its_worst_case_and_a_curve_for_each_contact(tmp_path: Path) -> None:
    gaps = made_series(tmp_path)
    write_series(tmp_path)
    (made,) = Page((tmp_path / "report" / "index.html").read_text("utf-8")).data["maps"]["maps"]
    fields = {name: unpacked(field["values"]) for name, field in made["fields"].items()}
    series = read_series(tmp_path)
    for q, values in zip(QUANTILES, quantile_maps(series), strict=False):
        np.testing.assert_allclose(fields[f"{100 * q:g} % quantile"], values, rtol=2.0**-12)
    worst = series.cases["case"][series.cases["max_gap_mm"].idxmax()]
    assert fields[f"case {worst}, the worst"].max() == pytest.approx(gaps.max(), rel=2.0**-12)
    curves = unpacked(made["exceeded"]).reshape(12, -1)
    for share, exceeded in zip(made["shares"], curves[7], strict=True):
        above = 100 * (gaps[:, 7] > exceeded * (1 + 2.0**-11)).mean()
        assert above == pytest.approx(share, abs=100 / len(gaps) + 1e-9)


def test_two_answers_have_both_gaps_and_their_difference_whatever_its_sign() -> None:
    nodes = np.array([(x, y) for y in (0.0, 10.0) for x in (0.0, 10.0, 20.0)])
    answers = [{"contact_nodes": nodes, "gap_after": np.arange(6) * scale} for scale in (0.3, 0.1)]
    pairs = [{"pair": ["a", "b"], "start": 0, "stop": 4}, {"pair": ["b", "c"], "start": 4, "stop": 6}]
    maps = contact_maps.two_answers_maps({"pairs": pairs}, answers)
    fields = maps["maps"][1]["fields"]
    first, second, change = (unpacked(field["values"]) for field in fields.values())
    np.testing.assert_allclose(first, [1.2, 1.5], rtol=2.0**-12)
    np.testing.assert_allclose(second, [0.4, 0.5], rtol=2.0**-12)
    np.testing.assert_allclose(change, [-0.8, -1.0], rtol=2.0**-12)
    colours = fields["second − first"]
    assert [colours["low"], colours["high"]] == pytest.approx([-1.0, 1.0])
    places = [unpacked(maps["groups"][1][name]) for name in ("x", "y")]
    np.testing.assert_array_equal(np.transpose(places), nodes[4:])


def test_of_many_contacts_every_kth_is_in_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contact_maps, "MOST", 1000)
    made = run_data(read(everything(tmp_path, {4386: [100]})))["maps"]["maps"][0]
    assert made["about"].startswith("2193 contacts, one in 3 of which is drawn.")
    assert len(unpacked(made["fields"]["gap before"]["values"])) == 731


def test_the_cells_of_a_map_meet_half_way_between_the_contacts() -> None:
    nodes = np.array([(x, y) for y in (0.0, 10.0) for x in (0.0, 10.0, 40.0)])
    for pairs in (1, 2):  # of parts, whose contacts lie above one another
        cells = node_cells.cells_of(np.tile(nodes, (pairs, 1)))
        assert len(cells) == 6 * pairs
        assert cells[1].tolist() == cells[-5].tolist() == [[5, 0], [25, 0], [25, 5], [5, 5]]


def area(cell: np.ndarray) -> float:
    (x, y), (after, above) = cell.T, np.roll(cell, -1, axis=0).T
    return float(x @ above - y @ after) / 2


@pytest.mark.parametrize("seed", range(4))
def test_the_cells_of_scattered_contacts_are_a_third_of_their_triangles(seed: int) -> None:
    """They turn anticlockwise, share all their sides, and leave a hole open."""
    random = np.random.default_rng(seed)
    X, Y = np.meshgrid(np.arange(12.0), np.arange(9.0))
    nodes = np.column_stack([X.ravel(), Y.ravel()]) + random.uniform(-0.2, 0.2, (108, 2))
    nodes = nodes[np.linalg.norm(nodes - [6, 4], axis=1) > 2]
    triangles = surface_of(nodes).triangles
    corners = nodes[triangles]
    sizes = np.array([area(corner) for corner in corners])
    expected = np.bincount(triangles.ravel(), np.repeat(sizes / 3, 3), minlength=len(nodes))
    cells = node_cells.cells_of(nodes)
    np.testing.assert_allclose([area(cell) for cell in cells], expected, rtol=1e-9)
    rim = node_cells.border(cells, np.ones(len(nodes), dtype=bool))
    edges = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
    alone = [edge for edge in edges if not (edges == edge[::-1]).all(axis=(1, 2)).any()]
    length = sum(np.linalg.norm(end - start) for start, end in alone)
    assert np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1).sum() == pytest.approx(length)


def test_contacts_on_a_line_or_in_one_place_have_cells() -> None:
    assert [area(cell) for cell in node_cells.cells_of(np.array([[0.0, 5], [3, 5], [9, 5]]))] == [9.0] * 3
    twice = np.array([[0.0, 0], [4, 0], [1, 3], [4, 0]])
    cells = node_cells.cells_of(twice)
    assert [area(cell) for cell in cells] == pytest.approx([2.0] * 4)
    places, largest = node_cells.largest_at_places(twice, np.array([1.0, 2, 3, 4]))
    assert dict(zip(map(tuple, places.tolist()), largest.tolist(), strict=True)) == {
        (0, 0): 1, (1, 3): 3, (4, 0): 4,
    }  # fmt: skip


def test_every_marker_of_the_report_has_one_on_the_page() -> None:
    assert {marker for _, marker in [*style.FIXED.values(), *style.SPARE]} <= set(run_page_data.MARKERS)


def test_the_banners_name_the_code(tmp_path: Path) -> None:
    mixed = results(tmp_path, [row(commit="a" * 40), row(solver="gi", commit="b" * 40)])
    assert "mix rows" in run_data(mixed)["banner"]["warnings"][0]
    record = {"method": "newton", "machine": "CPU", "commit": "a" * 40, "recorded_at": "2026-01-02T03:04:05"}
    clean = answer_page_data._banner([record | {"clean": True}])
    assert (clean["machines"], clean["measured"]) == (["CPU"], "2026-01-02 03:04 UTC")
    assert clean["commits"] == "a" * 40 + " (clean)"
    assert not clean["warnings"]
    assert "uncommitted" in answer_page_data._banner([record | {"clean": False}])["warnings"][0]
    assert answer_page_data._banner([{"method": "newton"}])["commits"] == "not recorded"
    rows = pd.DataFrame([record | {"clean": True, "side": "old"}, record | {"clean": False, "side": "new"}])
    both = comparison_report._banner(rows.assign(machine=["CPU", "other"]))
    assert "old: " + "a" * 40 in both["commits"]
    assert [warning.split()[-2] for warning in both["warnings"]] == ["uncommitted", "machine"], both
