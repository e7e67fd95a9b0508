"""The section through the largest gap, the view of the parts around it, and the sheet."""

import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from mpl_toolkits.mplot3d import Axes3D

from report.document.blocks import Table, number, word
from report.document.numbers import (
    beside,
    coordinate,
    digits_beside,
    error_beside,
    extent,
    limit_beside,
    nearest,
    percent_interval,
    position,
    proven_to,
    raised,
    significant,
    upwards,
)
from report.figures import style
from report.figures.deformed_faces import deformed_figure
from report.figures.gap_section import section_figure
from report.page.answer_page_data import headline
from report.writers import answer_report, sheet
from report.writers.sheet import LETTERS, exactness, origin, write_sheet

X, Y = np.linspace(0.0, 60.0, 7), np.linspace(0.0, 20.0, 3)
PAIRS = [{"pair": ["a", "b"], "start": 0, "stop": 21}, {"pair": ["b", "tool"], "start": 21, "stop": 42}]


def answer(worst: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Two parts and a tool, the largest gap at that contact; the nodes in any order."""
    random = np.random.default_rng(worst)
    order = random.permutation(21)
    nodes = np.column_stack([np.tile(X, 3), np.repeat(Y, 7)])[order]
    x, after = random.normal(size=42), random.uniform(0, 1, 42)
    after[worst] = 2.0
    rows = np.concatenate([np.column_stack([np.arange(21), np.arange(21, 42)]).ravel(), np.arange(21, 42)])
    arrays = {
        "x": x,
        "gap_after": after,
        "gap_before": after + x + np.concatenate([-x[21:], np.zeros(21)]),
        "contact_nodes": np.tile(nodes, (2, 1)),
        "A_data": np.concatenate([np.tile([1.0, -1.0], 21), np.ones(21)]),
        "A_indices": rows,
        "A_indptr": np.concatenate([np.arange(0, 43, 2), np.arange(43, 64)]),
    }
    return {"m": 42, "pairs": PAIRS}, arrays


@pytest.mark.parametrize("worst", [0, 5, 13, 20, 21, 30, 41])
def test_both_lines_go_through_the_largest_gap(worst: int) -> None:
    record, arrays = answer(worst)
    figure = section_figure(record, arrays)
    assert figure is not None
    place = arrays["contact_nodes"][worst]
    of_pair = slice(0, 21) if worst < 21 else slice(21, 42)
    moved = arrays["x"][of_pair]  # of the first part of the pair
    for axes, axis in zip(figure.axes, (0, 1), strict=True):
        first, second, of_second, was = axes.get_lines()
        on = np.isclose(arrays["contact_nodes"][of_pair][:, 1 - axis], place[1 - axis])
        order = np.argsort(arrays["contact_nodes"][of_pair][on][:, axis])

        def along(values: np.ndarray, on: np.ndarray = on, order: np.ndarray = order) -> np.ndarray:
            return values[of_pair][on][order]

        np.testing.assert_allclose(first.get_xdata(), (X, Y)[axis])
        np.testing.assert_allclose(first.get_ydata(), moved[on][order])
        np.testing.assert_allclose(second.get_ydata() - first.get_ydata(), along(arrays["gap_after"]))
        np.testing.assert_allclose(was.get_ydata() - of_second.get_ydata(), along(arrays["gap_before"]))
        assert (second.get_ydata() - first.get_ydata()).max() == 2.0
    assert figure.axes[1].get_title() == f"along y at x = {coordinate(place[0])} mm"
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert names == [f"{name}, after" for name in PAIRS[worst // 21]["pair"]] + ["gap left", "before"]


def test_scattered_contacts_have_no_section() -> None:
    record, arrays = answer(3)
    arrays["contact_nodes"] = arrays["contact_nodes"] + np.random.default_rng(0).normal(size=(42, 2))
    assert section_figure(record, arrays) is None
    assert section_figure({"m": 0, "pairs": []}, {}) is None


@pytest.mark.parametrize("worst", [13, 30])
@pytest.mark.parametrize("moved", [0.0, 1.0])
def test_the_view_is_of_both_faces(worst: int, moved: float) -> None:
    """Of the pair with the largest gap, its contacts on a grid or not."""
    record, arrays = answer(worst)
    arrays["contact_nodes"] = arrays["contact_nodes"] + moved * np.random.default_rng(0).normal(size=(42, 2))
    figure = deformed_figure(record, arrays)
    assert figure is not None
    own = slice(0, 21) if worst < 21 else slice(21, 42)
    first, second = arrays["x"][own], (arrays["x"] + arrays["gap_after"])[own]
    view: Any = figure.axes[0]
    bar = figure.axes[1]
    assert figure.get_suptitle().endswith("at most 2.00 mm apart")
    assert bar.get_ylim() == (0.0, 2.0)
    low, high = view.get_zlim()
    assert low <= min(first.min(), second.min()) + 0.5
    assert high >= max(first.max(), second.max()) - 0.5
    assert len(view.collections) == 2


def test_what_has_no_area_is_not_drawn() -> None:
    record, arrays = answer(3)
    for along in ([1.0, 0.0], [0.0, 0.0]):
        assert deformed_figure(record, arrays | {"contact_nodes": arrays["contact_nodes"] * along}) is None
    assert deformed_figure({"m": 0, "pairs": []}, {}) is None


def test_no_face_covers_a_bay(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(Axes3D, "plot_surface", lambda axes, *surface, **look: drawn.append(surface))
    nodes = np.array([(x, y) for x in np.arange(21.0) for y in np.arange(11.0) if abs(x - 10) > 4 or y < 4])
    of, zero = np.arange(len(nodes)), np.zeros(len(nodes))
    matrix = {"A_data": 1.0 + zero, "A_indices": of, "A_indptr": np.arange(len(nodes) + 1)}
    arrays = {"x": zero, "gap_after": 1.0 + zero, "contact_nodes": nodes} | matrix
    deformed_figure({"m": len(nodes), "pairs": [PAIRS[0] | {"stop": len(nodes)}]}, arrays)
    for X, Y, Z in drawn:
        np.testing.assert_array_equal(np.isnan(Z), (abs(X - 10) < 5) & (Y > 3))


@pytest.fixture
def pages(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The pages to file that are made."""
    made: list[Any] = []
    begin = sheet._Page.__init__

    def kept(page: Any) -> None:
        begin(page)
        made.append(page)

    monkeypatch.setattr(sheet._Page, "__init__", kept)
    return made


@pytest.mark.parametrize("count", [0, 1, 24, 400])
def test_the_sheet_is_one_page_that_prints_on_a4_and_letter(
    tmp_path: Path, pages: list[Any], count: int
) -> None:
    """Nothing is cut, no text covers another, and each fastener is on it or said to be in a file."""
    record, arrays = answer(8)
    figure = section_figure(record, arrays)
    assert figure is not None
    figure.savefig(tmp_path / "section.png")
    forces = pd.DataFrame(
        [("pin", k + 0.25, 2.0, 9.0 + k) for k in range(count)], columns=["kind", "x", "y", "N"]
    )
    columns = [word("fastener", "kind"), number("x, mm", "x", coordinate), number("y, mm", "y", coordinate)]
    table = Table("fasteners", "*The force in each fastener.*", forces, [*columns, number("force, N", "N")])
    content = sheet.Sheet(
        "A $joint_ of " + LETTERS * "two ",
        "fail",
        "FAIL: limit 0.05 mm, MMMM WWWW between wing and frame" + " at many contacts" * 5,
        [exactness(2e-16)],
        origin({"scene": "here", "commit": "c0ffee", "recorded_at": "2026-01-02T03:04:05"}),
        {"scan.csv": "0123456789abcdef" * 4},
        [tmp_path / "section.png"],
        [table],
        ["E is unusual"],
    )
    write_sheet(tmp_path / "sheet.pdf", content)
    data = (tmp_path / "sheet.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert len(re.findall(rb"/Type /Page\b", data)) == 1
    (page,) = pages
    assert page.figure.get_size_inches() * 25.4 == pytest.approx((210, 279))
    renderer = FigureCanvasAgg(page.figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in page.figure.texts]
    boxes += [axes.get_window_extent(renderer) for axes in page.figure.axes]
    width, height = page.figure.get_size_inches() * page.figure.dpi
    assert all(0 < box.x0 < box.x1 < width and 0 < box.y0 < box.y1 < height for box in boxes)
    for k, first in enumerate(boxes):
        assert not any(first.padded(-1.0).overlaps(second.padded(-1.0)) for second in boxes[k + 1 :])
    texts = [text.get_text() for text in page.figure.texts]
    whole = " ".join(texts)
    for said in ("exact to 0.000001 mm", "scan.csv, SHA-256 0123456789ab.", "2026-01-02 03:04 UTC"):
        assert said in whole
    left = int(more[1]) if (more := re.search(r"(\d+) more: fasteners.csv", whole)) else 0
    assert (left > 0) == (count > 24)
    assert sum(text in {significant(9.0 + k) for k in range(count)} for text in texts) == count - left
    assert ("y, mm: 2" in whole) == (count > 1)  # where all are the same


def test_a_table_with_many_columns_is_no_wider_than_the_page() -> None:
    """As that of stages with many effects that press."""
    names = [f"installed_fasteners {k}, N" for k in range(7)]
    forces = pd.DataFrame([[1000.0 + k for k in range(7)]], columns=names)
    page = sheet._Page()
    page.table(sheet.Printed(Table("stages", "*The stages.*", forces, [number(n, n) for n in names])), 0.5)
    page.figure.set_dpi(400)
    renderer = FigureCanvasAgg(page.figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in page.figure.texts]
    width = page.figure.get_figwidth() * page.figure.dpi
    assert len(boxes) == 15
    assert all(0 < box.x0 < box.x1 < width for box in boxes)
    assert not any(one.overlaps(other) for one, other in combinations(boxes[1:], 2))


def test_many_input_files_leave_room_for_the_origin(tmp_path: Path, pages: list[Any]) -> None:
    """Nor do capital letters and digits, which are wide, cut their hashes off."""
    inputs = {f"{7 * '/SOME/FOLDER'}/WING_{k}.OP4": "0123456789abcdef" * 4 for k in range(1000)}
    content = sheet.Sheet(9 * "LOWER PANEL ", "", "No limit.", [], origin({"scene": "here"}), inputs)
    write_sheet(tmp_path / "sheet.pdf", content)
    (page,) = pages
    texts = page.figure.texts
    assert "and 976 more. Scene: here" in " ".join(text.get_text() for text in texts)
    assert min(text.get_position()[1] for text in texts) > 0
    renderer = FigureCanvasAgg(page.figure).get_renderer()
    assert max(text.get_window_extent(renderer).x1 for text in texts) <= 0.94 * renderer.width


@pytest.mark.filterwarnings("error")
def test_letters_that_the_font_lacks_are_boxes_without_a_warning(tmp_path: Path) -> None:
    write_sheet(tmp_path / "sheet.pdf", sheet.Sheet("翼板", "", "No limit.", [], [], {}))
    with style.applied():
        drawing, axes = style.single(1.0)
        axes.set_title("翼板")
        drawing.savefig(tmp_path / "gap.png")


def test_places_are_rounded_by_the_size_of_the_part_and_a_gap_of_rounding_is_zero() -> None:
    nodes = np.array([[1077.93456, -1e-9], [0.0, 4000.0]])
    assert coordinate(nodes[0, 0]) == "1077.93"
    assert position(nodes[0], nodes) == "(1077.93, 0) mm"
    assert position(nodes[0] / 1e3, nodes / 1e3) == "(1.0779, 0) mm"
    assert extent(np.array([-1.1e-16, 0.73])) == "0 … 0.730"
    assert extent(np.array([-1.1e-6, 0.73])) == "-1.10e-6 … 0.730"


def test_no_bound_is_rounded_down_or_far() -> None:
    for bound in 10 ** np.random.default_rng(0).uniform(-20, 4, 300):
        for digits in range(1, 5):
            for said in (upwards(bound, digits), significant(raised(bound, digits), digits)):
                assert bound <= float(said) <= bound * (1 + 1.001 * 10.0 ** (1 - digits))
    said = [upwards(bound) for bound in (3.21e-16, 3.2e-16, 9.91e-17, 0.0, np.inf)]
    assert said == ["3.3e-16", "3.2e-16", "1.0e-16", "0.0e+00", "inf"]
    assert exactness(1.241e-3) == "The calculation is exact to 0.0013 mm for this model."
    assert (raised(None), raised(np.inf)) == (None, None)


def test_an_interval_of_shares_is_rounded_outwards() -> None:
    assert percent_interval((0.96349, 0.99132)) == "96.3 to 99.2 %"
    assert percent_interval((0.0, 1.0), 2) == "0.00 to 100.00 %"
    assert percent_interval((0.94996, 0.94996), 2) == "94.99 to 95.00 %"


@pytest.mark.parametrize(
    ("rounded", "values", "said"),
    [
        (nearest, (0.0512, 0.05004, 0.05, 0.04999), ["0.0512", "0.05004", "0.0500", "0.0500"]),
        (raised, (0.05121, 0.04991, 0.05, 0.050001), ["0.0513", "0.0500", "0.0500", "0.0501"]),
    ],
)
def test_a_value_is_shown_on_its_side_of_a_limit(rounded: Any, values: Any, said: list[str]) -> None:
    shown = [beside(0.05, rounded)(value) for value in (*values, np.inf, None, np.nan)]
    assert shown == [*said, "inf", "–", "–"]


def test_an_error_is_shown_on_its_side_of_a_limit() -> None:
    errors = [error_beside(1e-7, value) for value in (2e-7, 1.000004e-7, 1e-7, 3.21e-12)]
    assert errors == ["2.000e-07", "1.000004e-07", "1.000e-07", "3.210e-12"]
    assert (limit_beside(None, 1e-7), limit_beside(1.234e-6, 1.2349e-6)) == ("1e-07", "1.235e-06")
    assert error_beside(1.235e-7, 1.2351e-7) == "1.2351e-07"  # three digits are on its side, four are not
    assert [digits_beside(0.123856, 0.1238564, least) for least in (3, 6)] == [3, 7]


def test_what_has_no_finite_error_is_not_proven() -> None:
    said = [proven_to(error, "N") for error in (3.21e-9, 0.0, np.inf, None)]
    assert said == ["proven to 3.3e-09 N", "proven to 0.0e+00 N", "not proven", "not proven"]


def test_the_largest_gap_is_zero_where_it_is_rounding() -> None:
    record, arrays = answer(3)
    for rounding in (-5.6e-17, 5.6e-17):
        closed = arrays | {"gap_after": np.full(42, rounding)}
        assert headline(record, closed)["text"].startswith("The largest gap left is 0 mm, at")
    assert "is 2.00 mm" in headline(record, arrays)["text"]


def test_gaps_without_a_proven_error_are_told_without_a_figure() -> None:
    record, arrays = answer(3)
    check = {"allowed_mm": 0.1, "exceeded": None, "uncertainty_mm": None}
    text = headline(record | {"allowed_gap": check}, arrays)["text"]
    assert text.startswith("CANNOT BE TOLD: limit 0.1 mm, gaps are not proven; the largest gap")


def test_contacts_without_known_forces_are_not_said_to_be_open() -> None:
    record, arrays = answer(3)
    contacts, _ = answer_report._fields(record | {"parts": []}, arrays | {"lam": np.full(42, np.nan)})
    assert isinstance(contacts, Table)
    assert "– of 21" in contacts.markdown
