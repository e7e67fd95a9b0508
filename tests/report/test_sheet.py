"""The maps of an answer: in true proportions, and nothing is cut off or lies over something else."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from report.figures import style
from report.figures.answer_maps import answer_figures

KINDS = ("fasteners", "installed_fasteners", "clamps")


def figures(width: float, height: float, parts: int, kinds: int, name: str = "part") -> dict[str, Figure]:
    """The pictures of a made-up answer on a junction of 4 × 3 nodes; forces of 1500 N, a gap of −0.001 mm."""
    X, Y = np.meshgrid(np.linspace(0, width, 4), np.linspace(0, height, 3))
    nodes = np.column_stack([X.ravel(), Y.ravel()])
    names = [f"{name} {k}" for k in range(parts)]
    spans = [{"start": 12 * k, "stop": 12 * k + 12} for k in range(parts)]
    outline = {"outline": [0.0, width, -height, height], "clamped": ["south"]}
    contacts = np.tile(np.linspace(0.0, 1.0, 12), parts - 1)
    record = {
        "m": 12 * (parts - 1),
        "parts": [
            {"name": name, "supports": [[width, 0.0]]} | span | outline
            for name, span in zip(names, spans, strict=True)
        ],
        "pairs": [{"pair": names[k : k + 2]} | spans[k] for k in range(parts - 1)],
        "marks": {kind: [[0.0, 0.0], [width, height]] for kind in KINDS[:kinds]},
    }
    arrays = {
        "x": np.linspace(-1000.0, 1000.0, 12 * parts),
        "lam": np.where(contacts > 0.5, 1500.0 * contacts, 0.0),
        "gap_before": contacts,
        "gap_after": contacts - 0.001,
        "nodes": np.tile(nodes, (parts, 1)),
        "contact_nodes": np.tile(nodes, (parts - 1, 1)),
    }
    return answer_figures(record, arrays)


def texts_of(figure: Figure) -> list[Text]:
    """Titles, names and numbers of the axes, the legend; numbers beyond the ends of an axis are not drawn."""
    texts = [text for legend in figure.legends for text in legend.get_texts()]
    for axes in figure.axes:
        texts.append(axes._left_title)  # type: ignore[attr-defined]
        for axis in (axes.xaxis, axes.yaxis):
            texts.append(axis.label)
            low, high = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                if low <= tick.get_loc() <= high:
                    texts += [tick.label1, tick.label2]
    return [text for text in texts if text.get_visible() and text.get_text()]


@pytest.mark.parametrize(
    ("width", "height", "parts", "kinds", "name"),
    [
        (4000.0, 400.0, 2, 1, "wing"),
        (4000.0, 160.0, 2, 3, "thin"),
        (20.0, 160.0, 2, 3, "strip"),
        (100.0, 1600.0, 3, 3, "a part with a rather long name"),
        (1000.0, 1000.0, 3, 0, "plate"),
        (12.0, 9.0, 5, 2, "small"),
    ],
)
def test_nothing_is_cut_or_covered(width: float, height: float, parts: int, kinds: int, name: str) -> None:
    drawn = figures(width, height, parts, kinds, name)
    assert list(drawn) == ["gap", "forces", "displacement"]
    for figure in drawn.values():
        with style.applied():
            figure.draw_without_rendering()
            renderer = FigureCanvasAgg(figure).get_renderer()
            whole = figure.get_tightbbox(renderer)
            texts = [text.get_window_extent(renderer) for text in texts_of(figure)]
            frames = [axes.get_window_extent(renderer) for axes in figure.axes]
        wide, tall = figure.get_size_inches()
        assert min(whole.x0, whole.y0) >= 0
        assert whole.x1 <= wide
        assert whole.y1 <= tall
        for first, second in combinations([*texts, *frames], 2):
            assert not first.padded(-1.0).overlaps(second)
        if not kinds and figure is not drawn["displacement"]:
            named = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
            assert named == ["closed contacts"]


def test_proportions_are_true() -> None:
    for width, height in ((4000.0, 400.0), (20.0, 160.0), (1000.0, 1000.0)):
        for figure in figures(width, height, 2, 1).values():
            for axes in (axes for axes in figure.axes if axes.get_xlabel()):  # not the colour bars
                (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
                box = axes.get_window_extent()
                assert box.height / box.width == pytest.approx((north - south) / (east - west))


def test_nodes_on_a_line_have_a_picture() -> None:
    """A user's own matrices may have such coordinates."""
    nodes = np.column_stack([np.linspace(0.0, 9.0, 4), np.zeros(4)])
    part = {"name": "rod", "start": 0, "stop": 4, "outline": [0.0, 9.0, 0.0, 0.0]}
    part |= {"clamped": [], "supports": []}
    record = {"m": 0, "parts": [part], "pairs": [], "marks": {}}
    arrays = {"x": np.arange(4.0), "lam": np.empty(0), "nodes": nodes}
    (figure,) = answer_figures(record, arrays).values()
    axes, _ = figure.axes
    assert np.ptp(axes.get_xlim()) == pytest.approx(9.0)
    assert np.ptp(axes.get_ylim()) > 0
