"""Time against the number of active contacts, as in the paper's Figures 5 to 7."""

from __future__ import annotations

from report.analysis.drawn import best_tolerances, omission_note, tolerance_note
from report.document.blocks import Figure, Place, Section
from report.figures import style, times_panel
from report.figures.lines import styles_of
from report.results.reader import Results

PLACE = Place(320)

PANEL = 3.0  # inches


def section(results: Results) -> Section | None:
    cells = best_tolerances(results)
    cells = cells[cells.groupby("n")["active"].transform("nunique") > 1]
    if cells["load_case_s"].notna().sum() == 0:
        return None
    sizes = sorted(cells["n"].unique())
    styles = styles_of(results, cells)
    drawing = style.figure(PANEL * len(sizes) + 0.3)
    for axes, n in zip(drawing.subplots(len(sizes), 1, squeeze=False)[:, 0], sizes, strict=True):
        of_size = cells[cells["n"] == n]
        times_panel.panel(axes, of_size, styles)
        axes.set_ylabel("time per load case, s")
        m = of_size["m"].iloc[0]
        axes.set_title(f"n = {n:.0f}" + (f", m = {m:.0f}" if m > 0 else ""), pad=5)
    axes.set_xlabel("active contacts")
    handles = [*style.legend_entries(styles), *times_panel.entries(cells)]
    drawing.legend(handles=handles, loc="outside right upper", handlelength=3.2)
    caption = (
        "*Seconds per load case (set-up + solve + form) against the active contacts*: the number below, the "
        f"percentage of m above.{tolerance_note(results)}{style.forms_text(cells)} "
        + times_panel.MARKS.format(limit=results.limit)
        + omission_note(results)
    )
    return Section("Time against active contacts", [Figure("time-active", caption, drawing)])
