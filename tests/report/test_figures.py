"""The figures: colours told apart by all readers, the size of wrong answers, what stands beside what."""

import json
import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb
from synthetic_results import results, row

from problems.ladders import ladders
from report.figures import style
from report.figures.junction_maps import CLOSED, LARGER, MARK, RIM
from report.page.run_page_data import _look
from report.sections.ladders import COUNTED, ladder_map, with_outcomes
from solvers.registry import owner_of, solver_names

NAMED = {"floating", "loads", "parts"}  # ladders whose rungs are words
#: Vision without one kind of cone, in linear RGB: Machado, Oliveira, Fernandes, IEEE TVCG 15:1291-1298, 2009.
SIGHT = {
    "normal": "1 0 0  0 1 0  0 0 1",
    "no red cones": "0.152286 1.052583 -0.204868  0.114503 0.786281 0.099216  -0.003882 -0.048116 1.051998",
    "no green cones": "0.367322 0.860646 -0.227968  0.280085 0.672501 0.047413  -0.01182 0.04294 0.968881",
    "no blue cones": "1.255528 -0.076749 -0.178779  -0.078411 0.930809 0.147602  0.004733 0.691367 0.3039",
}


def lab(colour: str, sight: str) -> np.ndarray:
    """CIE 1976 L*a*b* of a colour as seen."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.array(SIGHT[sight].split(), dtype=float).reshape(3, 3) @ linear, 0, 1)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    t = np.array(to_xyz) @ seen / (0.9505, 1.0, 1.089)
    f = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIGHT)
def test_the_colours_of_our_solvers_are_told_apart(sight: str) -> None:
    names = [name for name in style.FIXED if owner_of(name) != "library"]
    colours = {name: lab(style.FIXED[name][0], sight) for name in names}
    near = {pair: np.linalg.norm(colours[pair[0]] - colours[pair[1]]) for pair in combinations(names, 2)}
    assert len(near) >= 21
    assert min(near.values()) > 20, near  # about 2 is just noticeable


def test_any_number_of_solvers_look_different_and_keep_their_looks() -> None:
    assert set(style.FIXED) <= set(solver_names())
    names = [*solver_names(), *(f"mine-{k}" for k in range(100))]
    pairs = style.looks(names)
    assert len(set(pairs.values())) == len(names)
    assert all(pair not in style.FIXED.values() for pair in (style.looks(["mine-1"])["mine-1"], *style.SPARE))
    alike = combinations([*style.FIXED.values(), *style.SPARE], 2)
    colours = [(to_rgb(one), to_rgb(other)) for (one, mark), (other, same) in alike if mark == same]
    assert min(np.linalg.norm(np.subtract(*pair)) for pair in colours) > 0.2
    fixed = {name: pairs[name] for name in style.FIXED}
    assert fixed == style.FIXED


@pytest.mark.parametrize("form", style.LOOKS)
def test_any_number_of_variants_look_different_also_on_the_page(form: str) -> None:
    """The page has neither the sizes nor the filled parts of markers."""
    for count in (1, 2, 5, 12, 40):
        methods = [f"piqp ({form}) {k:02d}" for k in range(count)]
        styles = style.line_styles(pd.DataFrame({"solver": "piqp", "form": form, "method": methods}))
        assert [*styles] == methods
        assert len({json.dumps(_look(look)) for look in styles.values()}) == count
        assert styles[methods[0]]["color"] == style.FIXED["piqp"][0].lower()


def test_a_legend_beside_a_panel_is_whole() -> None:
    """A run of all solvers in all forms has more methods than a panel is high."""
    handles = style.legend_entries({f"method {k}": {"marker": "o"} for k in range(60)})
    with style.applied():
        drawing, _ = style.panels(1, 3.0, handles)
        drawing.draw_without_rendering()
        (legend,) = drawing.legends
        box = legend.get_window_extent()
    assert 0 <= box.y0 < box.y1 <= drawing.bbox.height


def test_every_ladder_of_numbers_says_what_its_rungs_count() -> None:
    assert set(ladders("hard/")) == set(COUNTED) | NAMED


@pytest.mark.parametrize(
    ("error", "shown"), [(3e-6, "1"), (9e-5, "2"), (2.1e-3, "4"), (1e200, "∞"), (math.inf, "∞")]
)
def test_a_wrong_answer_on_a_rung_says_by_how_much(tmp_path: Path, error: float, shown: str) -> None:
    figures = {"displacement_error_mm": error, "limit_mm": 1e-6, "limit_asked_mm": 1e-7}
    line = row(verdict="outside", **figures) | {"scene": "hard/conditioning/1e+10"}
    cells = with_outcomes(results(tmp_path, [line]).cells)
    (axes,) = ladder_map(cells, list(cells["label"]), {"conditioning": ["1e+10"]}).axes
    assert {shown, "cond(K)", "conditioning"} <= {text.get_text() for text in axes.texts}
    assert axes.get_xticklabels()[0].get_text() == "1e+10"


def test_what_is_larger_than_allowed_looks_like_nothing_else() -> None:
    others = [lab(colour, "normal") for colour in (MARK, CLOSED, RIM)]
    assert min(np.linalg.norm(lab(LARGER, "normal") - other) for other in others) > 40
