"""Time against the number of active contacts, as in the paper's Figures 5 to 7."""

from __future__ import annotations

from report.analysis.drawn import best_tolerances, omission_note, tolerance_note, with_rivals
from report.document.blocks import Figure, Place, Section
from report.figures import style, times_panel
from report.figures.lines import styles_of
from report.results.reader import Results

PLACE = Place(320)

PANEL = 3.0  # inches


def section(results: Results) -> Section | None:
    cells = best_tolerances(results)
    sizes = cells.groupby(["n", "m"], dropna=False)
    cells = cells[sizes["active"].transform("nunique") > 1]
    cells = with_rivals(cells, sizes["method"].transform("nunique"))
    if cells["load_case_s"].notna().sum() == 0:
        return None
    panels = [*cells.groupby(["n", "m"], dropna=False)]
    styles = styles_of(results, cells)
    drawing = style.figure(PANEL * len(panels) + 0.3)
    places = drawing.subplots(len(panels), 1, squeeze=False)[:, 0]
    for axes, ((n, m), of_size) in zip(places, panels, strict=True):
        times_panel.panel(axes, of_size, styles)
        axes.set_ylabel("time per load case, s")
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
