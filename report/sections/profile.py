"""The performance profile: how often a solver is within a factor of the fastest."""

import pandas as pd

from report.analysis.standings import best_tolerances, shown
from report.document.blocks import Figure, Section
from report.figures import style
from report.figures.line_charts import styles_of
from report.results.reader import Results

FEWEST = 3  # scenes
HEIGHT = 3.6  # inches
CAPTION = (
    "*Performance profile* (Dolan and Moré, 2002), with the best tolerance on each scene. Read it so: the "
    "height of a curve at τ is the share of its scenes that the solver answers within {} in at most τ times "
    "the seconds of the fastest, preparation included. At τ = 1 that is the share on which it is the "
    "fastest, at the right end the share that it answers at all. Its scenes are those it was measured on. "
    "Shown, and compared with the fastest among them, are methods run on at least half of the scenes."
)


def section(results: Results) -> Section | None:
    cells = shown(best_tolerances(results.cells))
    lines = profile(cells)
    if cells["scene"].nunique() < FEWEST or lines.empty:
        return None
    styles = styles_of(cells)
    drawing, (axes,) = style.panels(1, HEIGHT, style.legend_entries(styles))
    end = 1.1 * lines["ratio"].max()
    for method, line in lines.groupby("method"):
        steps, shares = [*line["ratio"], end], [*line["share"], line["share"].max()]
        axes.plot(steps, shares, **styles[str(method)] | {"drawstyle": "steps-post"})
    axes.set(xscale="log", xlim=(0.97, end), ylim=(0, 1.03), xlabel="τ", ylabel="share of the scenes")
    style.plain_log(axes.xaxis)
    return Section("Performance profile", [Figure("profile", CAPTION.format(results.limit), drawing, lines)])


def profile(cells: pd.DataFrame) -> pd.DataFrame:
    """The ratios of `total_s` to the fastest on a scene, by method, ascending, each with the share of the
    scenes measured on which the method's ratio is at most that.
    """
    cells = cells.assign(scenes=cells.groupby("method")["scene"].transform("nunique"))
    good = cells[cells["verdict"] == "within"]
    ratio = good["total_s"] / good.groupby("scene")["total_s"].transform("min")
    lines = good[["method", "scene", "scenes"]].assign(ratio=ratio)
    lines = lines.sort_values(["method", "ratio"], ignore_index=True)
    return lines.assign(share=(lines.groupby("method").cumcount() + 1) / lines["scenes"])
