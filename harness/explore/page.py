"""The page in a browser: a gap map with fasteners to drag, sliders, the outcome, a kept plan beside it.

The map and the outcome are those of one stage of the scene, by default the last.

Bokeh's server calls `changed` when a fastener is let go or a slider stops; the answer is drawn at once and
proven right after. If the settings on the page are wrong, the last answer stays, in grey.
"""

import secrets
import shlex
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.layouts import column, row
from bokeh.models import Button, ColorBar, ColumnDataSource, Div, Select, Slider, TextInput
from bokeh.models.mappers import LinearColorMapper
from bokeh.models.tools import PointDrawTool
from bokeh.plotting import figure
from bokeh.server.server import Server

from harness.explore.live_answers import CHANGED, Explorer, LiveAnswer, Settings
from harness.explore.raster import Raster
from harness.results.records import replace_text
from harness.scene.scene_file import edited, refuse_unreadable
from problems.effects.initial_gap import InitialGap
from problems.effects.pressure import Pressure
from problems.errors import InputError
from problems.forms.assembly import Matrix
from problems.scene_files import read_scene
from report.document.numbers import counted, digits_beside, position, upwards
from report.document.verdict_colours import FAIL, PASS

VIEWPORT = '<meta name="viewport" content="width=device-width">'
NOTHING = "rgba(0, 0, 0, 0)"
DIGITS = 3  # of mm, where a fastener is dropped
EXACT = ".12g"  # of a slider: without the rounding of its steps
STALE = 0.35  # opacity of an answer to other settings
WIDE, NARROWEST = 760, 320  # pixels of a map; beside the dials where there is room
TALLEST, LOWEST = 420, 150
PROOF_MS = 50  # after the first change that is not proven: the map comes before


class Page:
    """One tab."""

    def __init__(
        self, explorer: Explorer, source: str, limit_mm: float, first: LiveAnswer, document: Any
    ) -> None:
        self.explorer, self.source, self.document = explorer, source, document
        self.answer, self.first, self.pending = first, first.settings, None
        assembly = explorer.data.assembly
        assert assembly.contact_nodes is not None  # of a joint
        self.places: Matrix = assembly.contact_nodes
        self.raster = Raster.of(self.places)
        self.colours = LinearColorMapper(
            palette="Viridis256", low=0.0, high=limit_mm, high_color=FAIL, nan_color=NOTHING
        )
        self.cells = ColumnDataSource({"gap": [self.raster.image(first.gap)]})
        self.kept_cells = ColumnDataSource(dict(self.cells.data))
        self.fasteners = ColumnDataSource(_columns(first.settings))
        self.kept_fasteners = ColumnDataSource(_columns(first.settings))
        self.outcome, self.kept_outcome, self.fault = (Div(sizing_mode="stretch_width") for _ in range(3))
        names = [one.stage for one in first.stages]
        self.stage = Select(title="after stage", value=first.stage, options=names, visible=bool(names))
        self.stage.on_change("value", lambda attr, old, new: self.show())
        self.sliders = self._sliders(first.settings, limit_mm)
        self.path = TextInput(title="scene file", value=str(Path(source).stem) + "-moved.toml")
        self.fasteners.on_change("data", self.changed)
        for slider in self.sliders.values():
            slider.on_change("value_throttled", self.changed)
        document.title = f"{explorer.scene.title}: where do the fasteners go?"
        document.template = f"{{% block preamble %}}{VIEWPORT}{{% endblock %}}"
        document.add_root(self._layout())
        self.show()
        self.keep()

    def _sliders(self, settings: Settings, limit_mm: float) -> dict[str, Slider]:
        made = {"limit": _slider("limit, mm", limit_mm), "preload": _slider("preload, N", settings.preload)}
        for k, gap in enumerate(self.explorer.scene.effects_of(InitialGap)):
            where = "" if gap.between is None else f" {' – '.join(gap.between)}"
            made[f"mean {k}"] = _slider(f"mean gap{where}, mm", settings.means[k])
        for k, effect in enumerate(self.explorer.scene.effects_of(Pressure)):
            made[f"pressure {k}"] = _slider(f"pressure on {effect.part}, N/mm²", effect.value)
        return made

    def _layout(self) -> Any:
        keep, save = Button(label="Keep this plan"), Button(label="Save as a scene")
        keep.on_click(self.keep)
        save.on_click(self.save)
        hint = Div(text="Drag a fastener. Click on the map to add one; select and Backspace removes it.")
        now = self._map("now", self.cells, self.fasteners, draws=True)
        then = self._map("kept", self.kept_cells, self.kept_fasteners, draws=False)
        dials = column(self.stage, *self.sliders.values(), self.path, row(keep, save), hint)
        wide = {"flex": f"1 1 {NARROWEST}px", "max-width": f"{WIDE}px"}
        maps = column(self.outcome, now, self.fault, self.kept_outcome, then, styles=wide)
        return row(maps, dials, styles={"flex-wrap": "wrap"}, sizing_mode="stretch_width")

    def _map(self, title: str, cells: ColumnDataSource, fasteners: ColumnDataSource, draws: bool) -> Any:
        low, high = self.raster.low, self.raster.high
        ratio = (high[1] - low[1]) / (high[0] - low[0])
        height = int(np.clip(WIDE * ratio + 60, LOWEST, TALLEST))
        plot = figure(
            title=title,
            max_width=WIDE,
            sizing_mode="stretch_width",
            height=height,
            x_range=(low[0], high[0]),
            y_range=(low[1], high[1]),
            x_axis_label="x, mm",
            y_axis_label="y, mm",
            tools="pan,wheel_zoom,reset",
            tooltips=None,
        )
        plot.toolbar.logo = None
        place = {"x": low[0], "y": low[1], "dw": high[0] - low[0], "dh": high[1] - low[1]}
        made = plot.image("gap", **place, source=cells, color_mapper=self.colours)
        if draws:
            self.gaps = made
        plot.add_layout(ColorBar(color_mapper=self.colours, title="gap, mm"), "right")
        marks = plot.scatter("x", "y", source=fasteners, size=11, fill_color="white", line_color="black")
        marks.nonselection_glyph = None  # the others stay as they are
        if draws:
            tool = PointDrawTool(renderers=[marks], empty_value=0.0)
            plot.add_tools(tool)
            plot.toolbar.active_tap = tool
        return plot

    @property
    def settings(self) -> Settings:
        """The settings that the page shows."""
        data = self.fasteners.data
        places = ((float(x), float(y)) for x, y in zip(data["x"], data["y"], strict=True))
        values = {name: float(format(slider.value, EXACT)) for name, slider in self.sliders.items()}
        means, pressures = (
            tuple(value for name, value in values.items() if name.startswith(f"{what} "))
            for what in ("mean", "pressure")
        )
        return Settings(tuple(map(self.rounded, places)), values["preload"], means, pressures)

    def rounded(self, place: tuple[float, float]) -> tuple[float, float]:
        """A place rounded to the micrometre; a place of the scene's own fasteners unchanged."""
        x, y = place
        return place if place in self.first.places else (round(x, DIGITS), round(y, DIGITS))

    def changed(self, attr: str, old: object, new: object) -> None:
        """Answer what the page asks for, or say what is wrong with it."""
        self.colours.high = float(self.sliders["limit"].value)
        try:
            if self.settings != self.answer.settings:
                self.answer = self.explorer.answer(self.settings, self.answer)
                if self.pending is None:
                    self.pending = self.document.add_timeout_callback(self.prove, PROOF_MS)
        except InputError as error:
            self.fault.text = "<br>".join(escape(str(fault)) for fault in error.faults)
            self.gaps.glyph.global_alpha = STALE
            return
        self.fault.text = ""
        self.gaps.glyph.global_alpha = 1.0
        self.show()

    def prove(self) -> None:
        """Say how sure the answer is; the map stays, as no change would be seen in it."""
        self.pending = None
        self.answer = self.explorer.proven(self.answer)
        self.say()

    @property
    def shown(self) -> LiveAnswer:
        """The answer of the stage that the page shows."""
        chosen = (one for one in self.answer.stages if one.stage == self.stage.value)
        return next(chosen, self.answer)

    def show(self) -> None:
        self.cells.data = {"gap": [self.raster.image(self.shown.gap)]}
        self.say()

    def say(self) -> None:
        self.outcome.text = outcome(self.shown, self.places, float(self.sliders["limit"].value))

    def keep(self) -> None:
        """Show this plan beside those to come."""
        if self.answer.error_mm is None:
            self.prove()
        self.kept_cells.data = dict(self.cells.data)
        self.kept_fasteners.data = _columns(self.answer.settings)
        self.kept_outcome.text = f"Kept: {self.outcome.text}"

    def save(self) -> None:
        """Write the settings as a scene, and say how to solve it."""
        path = Path(self.path.value)
        try:
            if not self.settings.places:
                raise InputError.one("page", "fasteners", 0, "at least one, in a scene that has them")
            if path.suffix != ".toml":
                raise InputError.one("page", "scene file", str(path), "a name that ends in .toml")
            if path.exists():
                raise InputError.one("page", "scene file", str(path), "exists: name another")
            if read_scene(self.source).key != self.explorer.scene.key:
                allowed = "has changed since it was read: start explore again"
                raise InputError.one("page", "scene", self.source, allowed)
            text = edited(self.source, path.parent, self.settings.write_to, CHANGED)
            refuse_unreadable(text, path)  # now, in the words of `validate`
            replace_text(path, text)
        except (InputError, OSError) as error:
            faults = error.faults if isinstance(error, InputError) else [error]
            self.fault.text = "<br>".join(escape(str(fault)) for fault in faults)
            return
        limit = self.sliders["limit"].value
        out = shlex.quote(f"results/{path.stem}")
        command = f"python -m harness solve {shlex.quote(str(path))} --allow-gap {limit:g} --out {out}"
        self.fault.text = f"Saved. <code>{escape(command)}</code>"


def outcome(answer: LiveAnswer, places: Matrix, limit_mm: float) -> str:
    """PASS or FAIL, the largest gap with its place, and how sure that is."""
    k = int(answer.gap.argmax())
    gap, place = float(answer.gap[k]), position(places[k], places)
    e = answer.error_mm
    proven = e is not None and np.isfinite(e)
    sure = "…" if e is None else f"every gap within {upwards(e)} mm, proven" if proven else "not proven"
    untold = e is not None and not abs(gap - limit_mm) > e
    word = "cannot be told" if untold else "PASS" if gap <= limit_mm else "FAIL"
    colour = {"PASS": PASS, "FAIL": FAIL}.get(word, "#666666")
    digits = digits_beside(limit_mm, gap, least=6)
    above = np.count_nonzero(answer.gap > limit_mm)
    after = f"after {escape(answer.stage)}: " if answer.stage else ""
    return (
        f'<b style="color:{colour};font-size:130%">{word}</b> {after}largest gap '
        f'<b id="gap">{gap:.{digits}g}</b> mm at {place}; '
        f"{above} of {len(answer.gap)} contacts above {limit_mm:g} mm; "
        f"{counted(len(answer.settings.places), 'fastener')}, {np.count_nonzero(answer.lam)} closed contacts "
        f"carry {answer.lam.sum():.4g} N. {sure}"
    )


def serve(
    explorer: Explorer, source: str, limit_mm: float, first: LiveAnswer, ready: Callable[[str], None]
) -> None:
    """Serve pages to this machine alone, under an address that nobody can guess, until interrupted."""
    token = secrets.token_urlsafe(16)
    application = Application(
        FunctionHandler(lambda document: Page(explorer, source, limit_mm, first, document))
    )
    server = Server({f"/{token}": application}, address="127.0.0.1", port=0, use_index=False)
    server.start()
    ready(f"http://localhost:{server.port}/{token}")
    try:
        server.io_loop.start()
    finally:
        server.stop()


def _slider(title: str, value: float) -> Slider:
    """From 0 to three times the value, or to minus three times a negative one."""
    end = 3 * value or 1.0
    low, high = sorted((0.0, end))
    return Slider(title=title, start=low, end=high, value=value, step=abs(end) / 300, format="0.[0000]")


def _columns(settings: Settings) -> dict[str, list[float]]:
    return {"x": [x for x, _ in settings.places], "y": [y for _, y in settings.places]}
