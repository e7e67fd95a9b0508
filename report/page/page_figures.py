"""The Bokeh figures of a page, as JSON: their looks are here, and plots.js fills in what is asked for.

Bokeh takes half a second to import: the map, which all pages show, and the scripts are kept in the cache.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from problems.storage import digest, load_or_make
from report.results.series_results import Array

if TYPE_CHECKING:
    from bokeh.plotting import figure

PANELS = 12  # scenes whose work and precision are drawn at a time
TOOLS = "pan,wheel_zoom,box_zoom,reset,save"
CURVE_LOOKS = (("#0072B2", "solid"), ("#D55E00", "dashed"))


def scripts() -> str:
    """BokehJS, for a page in one file."""

    def made() -> str:
        from bokeh.resources import Resources

        return "\n".join(Resources(mode="inline", components=["bokeh"], minified=True).js_raw)

    return str(_kept(["scripts"], made))


def map_item(names: list[str]) -> Any:
    """The item of `map_figure`."""
    return _kept(["map", *names], lambda: item(map_figure(names), "map"))


def _kept(what: list[str], make: Callable[[], Any]) -> Any:
    key = digest("page", version("bokeh"), Path(__file__).read_bytes(), what)
    return load_or_make(key, lambda: ({}, {"made": make()}))[1]["made"]


def item(plot: figure, name: str) -> Any:
    """A figure as JSON for `Bokeh.embed.embed_item`.

    Bokeh numbers its models through the process; here they are numbered anew, behind a name, which differs
    among the figures of a page, so that equal data give equal pages.
    """
    from bokeh.embed import json_item

    numbers: dict[str, str] = {}

    def renumbered(value: Any) -> Any:
        match value:
            case dict():
                return {
                    key: numbers.setdefault(inner, f"{name}-{len(numbers)}")
                    if key in ("id", "root_id")
                    else renumbered(inner)
                    for key, inner in value.items()
                }
            case list():
                return [renumbered(inner) for inner in value]
        return value

    return renumbered(json_item(plot))


def map_figure(names: Iterable[str]) -> figure:
    """A field on the contacts, with the fasteners, and a red outline where it is above a threshold.

    A renderer and a colour bar of the same name show each kind of field on each scale; one pair is visible.
    names : of the fields whose values are shown at the pointer.
    """
    from bokeh.models import ColorBar, HoverTool, LinearColorMapper, LogColorMapper, TapTool
    from bokeh.palettes import RdBu11, interp_palette, magma, viridis
    from bokeh.transform import transform

    plot = _figure("x, mm", "y, mm", x_range=(0, 1), y_range=(0, 1))
    palettes = {"gap": viridis(256), "force": magma(256)[::-1], "change": interp_palette(RdBu11, 256)}
    sides = {"xs": "xs", "ys": "ys"}
    outline: dict[str, Any] = {"fill_color": None, "line_color": "edge", "line_width": 1.5}
    empty: dict[str, list[float]] = {name: [] for name in ("x", "y", "value", "edge", *sides, *names)}
    above = plot.patches(**sides, **outline, source=empty, name="above", level="annotation")
    above.nonselection_glyph = None
    for kind, palette in palettes.items():
        for scale, mapper in {"linear": LinearColorMapper, "log": LogColorMapper}.items():
            colours = mapper(palette=palette, low=0.1, high=1.0, nan_color="#dddddd")
            if kind == "force":
                colours.low_color = "white"  # where there is none
            look: dict[str, Any] = dict.fromkeys(("fill_color", "line_color"), transform("value", colours))
            name = f"{kind} {scale}"
            cells = plot.patches(**sides, **look, source=above.data_source, name=name, visible=False)
            cells.nonselection_glyph = None
            plot.add_layout(ColorBar(color_mapper=colours, name=name, visible=False), "right")
    ring: dict[str, Any] = {"size": 7, "line_color": "#ffffff", "fill_color": "#111111"}
    plot.scatter("x", "y", source={"x": [], "y": []}, name="marks", **ring)
    lines = [("x, mm", "@x{0.[00]}"), ("y, mm", "@y{0.[00]}"), ("shown", "@value{0.0000}")]
    lines += [(name, f"@{{{name}}}{{0.0000}}") for name in names]
    plot.add_tools(HoverTool(renderers=[above], tooltips=lines), TapTool(renderers=[above]))
    return plot


def exceedance_figure(curves: dict[str, tuple[Array, Array]]) -> figure:
    """The share of each curve's gaps that exceed t, and an empty dotted line for a contact to be chosen.

    curves : by name t, mm, and the share in %.
    """
    from bokeh.models import HoverTool, PrintfTickFormatter

    plot = _figure(
        "gap t, mm",
        "share with more than t, %",
        max_width=760,
        height=320,
        sizing_mode="stretch_width",
        y_axis_type="log",
    )
    for (name, (gap, share)), (colour, dash) in zip(curves.items(), CURVE_LOOKS, strict=True):
        shown = share > 0
        columns = {"x": gap[shown], "y": share[shown]}
        plot.line("x", "y", source=columns, color=colour, line_dash=dash, line_width=2, legend_label=name)
    dotted: dict[str, Any] = {"color": "#000000", "line_dash": "dotted", "line_width": 2}
    empty: dict[str, list[float]] = {"x": [], "y": []}
    plot.line("x", "y", source=empty, name="contact", legend_label="the contact chosen", **dotted)
    plot.legend.location = "bottom_left"
    plot.yaxis.formatter = PrintfTickFormatter(format="%g")
    lines = [("gap, mm", "@x{0.0000}"), ("share with more, %", "@y{0.000}")]
    plot.add_tools(HoverTool(tooltips=lines, mode="vline"))
    return plot


def precision_figure(errors: tuple[float, float], seconds: tuple[float, float]) -> figure:
    """Seconds against the error reached, with the limit dashed and the reference error bound grey.

    errors, seconds : the ranges, mm and s.
    """
    from bokeh.models import BoxAnnotation, HoverTool, Span, TapTool

    scales: dict[str, Any] = {"x_axis_type": "log", "y_axis_type": "log"}
    ranges: dict[str, Any] = {"x_range": errors, "y_range": seconds}
    plot = _figure("error, mm", "seconds", width=440, height=270, **scales, **ranges)
    plot.add_layout(BoxAnnotation(name="bound", fill_color="#000000", fill_alpha=0.07, line_color=None))
    plot.add_layout(Span(name="limit", dimension="height", line_dash="dashed"))
    columns = ("reached_mm", "seconds", "color", "face", "marker", "angle", "dash", "alpha", "about", "key")
    empty: dict[str, list[float]] = {name: [] for name in columns}
    look: dict[str, Any] = {"line_color": "color", "line_alpha": "alpha"}
    plot.multi_line(
        "reached_mm", "seconds", source=dict(empty), line_dash="dash", line_width=1.6, name="lines", **look
    )
    look |= {"fill_color": "face", "fill_alpha": "alpha", "angle": "angle"}
    markers = plot.scatter(
        "reached_mm", "seconds", source=dict(empty), marker="marker", size=9, name="cells", **look
    )
    plot.add_tools(HoverTool(renderers=[markers], tooltips=[("", "@about")]), TapTool(renderers=[markers]))
    return plot


def _figure(x: str, y: str, **more: Any) -> figure:
    from bokeh.plotting import figure

    plot = figure(x_axis_label=x, y_axis_label=y, tools=TOOLS, **more)
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    return plot
