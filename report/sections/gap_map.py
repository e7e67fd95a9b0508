"""Maps of the gap between the parts before and after, and of the contact forces."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, PowerNorm

from report.analysis.drawn import middle_scene
from report.document.blocks import Block, Figure, Place, Section, Text
from report.figures import style
from report.figures.answer import CLOSED, RIM, outlined
from report.figures.maps import Array, draw
from report.results.reader import Results

PLACE = Place(410)

TALLEST = 4.5  # inches
BAR: dict[str, Any] = {"aspect": 6, "pad": 0.015, "fraction": 0.05}
RING: dict[str, Any] = {"markersize": 3.2, "markerfacecolor": "none", "markeredgecolor": style.VERMILLION}


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
    upright = height > width  # side by side, else below each other
    drawing = style.figure(TALLEST if upright else 3 * (max(strip, 0.5) + 0.42) + 0.8)
    places = drawing.subplots(*((1, 3) if upright else (3, 1)), sharex=True, sharey=True)
    panels: list[Axes] = list(places)

    gaps = (("gap before", before), ("gap after", after))
    for axes, (title, values) in zip(panels, gaps, strict=False):
        norm = Normalize(min(0.0, float(values.min())), max(float(values.max()), 0.0) or 1.0)
        drawn = draw(axes, nodes, values, norm, "viridis")
        drawing.colorbar(drawn, ax=axes, label="gap, mm", **BAR)
        if len(fasteners):
            axes.plot(*fasteners.T, "o", label="fasteners", **RING)
        axes.set_title(title)
    force = PowerNorm(0.5, 0.0, float(lam.max()) or 1.0)
    drawn = draw(panels[2], nodes, np.where(closed, lam, np.nan), force, "magma_r")
    drawing.colorbar(drawn, ax=panels[2], label="force, N", **BAR)
    panels[2].set_title("contact forces")
    outlined(panels[1], nodes, closed, CLOSED, "closed contacts")
    outlined(panels[2], nodes, closed, RIM, "closed contacts")
    panels[2].set_xlabel("x, mm")
    handles, names = panels[1].get_legend_handles_labels()
    drawing.legend(handles, names, loc="outside lower left", ncols=2)
    caption = (
        f"*Scene {scene} (n = {n}): the gap before and after, and the contact forces.* Each has a scale "
        f"of its own; proportions are true. Outlined: the {closed.sum()} closed contacts"
        + (f"; circles: the {len(fasteners)} fasteners" if len(fasteners) else "")
        + ". The force scale is that of the square root, so that small forces are visible."
    )
    return Figure("gap-map", caption, drawing)
