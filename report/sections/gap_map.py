"""Maps of the gap between the parts before and after, and of the contact forces."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, PowerNorm

from report.analysis.drawn import middle_scene
from report.document.blocks import Block, Figure, Place, Section, Text
from report.figures import style
from report.figures.maps import Array, draw, grid_of, outline
from report.results.reader import Results

PLACE = Place(410)


def section(results: Results) -> Section | None:
    for n in reversed(results.sizes):
        scene = middle_scene(results, n)
        arrays = results.scene_arrays(scene) if scene else None
        if scene and arrays is not None:
            unread = Text(f"The file of scene {scene} could not be read.")
            block: Block = _figure(scene, n, arrays) if arrays else unread
            return Section("The gap before and after", [block])
    return None


def _figure(scene: str, n: int, arrays: dict[str, Array]) -> Figure:
    nodes, before, after, lam = (arrays[k] for k in ("contact_nodes", "gap_before", "gap_after", "lam"))
    fasteners = arrays.get("fasteners", np.empty((0, 2)))
    closed = lam > 0
    width, height = np.ptp(nodes, axis=0)
    strip = 7.6 * height / width  # inches
    drawing = style.figure(3 * (max(strip, 0.5) + 0.42) + 0.5)
    panels: list[Axes] = list(drawing.subplots(3, 1, sharex=True, sharey=True))

    widest = float(max(before.max(), after.max(), 0.0))
    gap = Normalize(min(0.0, float(after.min())), widest or 1.0)
    force = PowerNorm(0.5, 0.0, float(lam.max()) or 1.0)
    draw(panels[0], nodes, before, gap, "viridis")
    gaps = draw(panels[1], nodes, after, gap, "viridis")
    forces = draw(panels[2], nodes, np.where(closed, lam, np.nan), force, "magma_r")
    drawing.colorbar(gaps, ax=panels[:2], label="gap, mm", aspect=14, pad=0.015, fraction=0.05)
    drawing.colorbar(forces, ax=panels[2], label="force, N", aspect=6, pad=0.015, fraction=0.05)
    if grid := grid_of(nodes):
        for axes, colour in ((panels[1], "white"), (panels[2], "#444444")):
            axes.add_collection(LineCollection(outline(grid, closed), colors=colour, linewidths=0.9))
    for axes in panels[:2]:
        axes.plot(*fasteners.T, "o", markersize=3.2, markerfacecolor="none", markeredgecolor=style.VERMILLION)
    panels[0].set_title("gap before")
    panels[1].set_title("gap after")
    panels[2].set_title("contact forces")
    panels[2].set_xlabel("x, mm")
    caption = (
        f"*Scene {scene} (n = {n}): the gap before and after, and the contact forces.* Both gaps share one "
        f"scale; proportions are true. Outlined: the {closed.sum()} closed contacts"
        + (f"; circles: the {len(fasteners)} fasteners" if len(fasteners) else "")
        + ". The force scale is that of the square root, so that small forces are visible."
    )
    return Figure("gap-map", caption, drawing)
