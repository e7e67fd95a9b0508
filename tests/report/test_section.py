"""The section through the largest gap, the view of the parts around it, and the page of PDF."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from report.document.numbers import extent, position
from report.figures.deformed_faces import deformed_figure
from report.figures.gap_section import section_figure
from report.writers.answer_pdf import LETTERS, write_pdf

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
    arrays["contact_nodes"] = arrays["contact_nodes"] * [1.0, 0.0]
    assert deformed_figure(record, arrays) is None
    assert deformed_figure({"m": 0, "pairs": []}, {}) is None


@pytest.mark.parametrize("count", [0, 3, 400])
def test_the_page_to_file_is_one_page(tmp_path: Path, count: int) -> None:
    record, arrays = answer(8)
    forces = [
        {"kind": "fasteners", "pair": ["a", "b"], "x": k, "y": 2.0, "force_N": 9.0} for k in range(count)
    ]
    record |= {"title": "A $joint_ of " + LETTERS * "two ", "scene": "here", "scene_key": "0" * 64, "n": 42}
    record |= {"method": "newton", "fasteners": forces, "grid": {"said": "Nothing is known"}, "steps": {}}
    check = {"exceeded": True, "allowed_mm": 0.05, "contacts": [1], "share": 0.02, "pairs": ["a – b"]}
    record |= {"unusual": ["E is unusual"], "recorded_at": "2026-01-02T03:04:05"}
    arrays |= {"nodes": arrays["contact_nodes"]}
    record |= {"allowed_gap": check, "commit": "c0ffee"}
    figure = section_figure(record, arrays)
    assert figure is not None
    figure.savefig(tmp_path / "section.png")
    write_pdf(tmp_path / "answer.pdf", record, arrays, [tmp_path / "section.png"])
    content = (tmp_path / "answer.pdf").read_bytes()
    assert content.startswith(b"%PDF")
    assert len(re.findall(rb"/Type /Page\b", content)) == 1


def test_places_are_rounded_by_the_size_of_the_part_and_a_gap_of_rounding_is_zero() -> None:
    nodes = np.array([[1077.93456, -1e-9], [0.0, 4000.0]])
    assert position(nodes[0], nodes) == "(1077.93, 0) mm"
    assert position(nodes[0] / 1e3, nodes / 1e3) == "(1.0779, 0) mm"
    assert extent(np.array([-1.1e-16, 0.73])) == "0 … 0.730"
    assert extent(np.array([-1.1e-6, 0.73])) == "-1.10e-6 … 0.730"
