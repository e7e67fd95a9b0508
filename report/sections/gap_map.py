"""Maps of the gap between the parts before and after, and of the contact forces."""

from __future__ import annotations

import numpy as np

from report.document.blocks import Block, Figure, Section, Text
from report.figures.maps import CLOSED, RIM, Array, Map, drawn, rooted
from report.results.reader import Results


def section(results: Results) -> Section | None:
    """Of the scene with the median number of active contacts, of the largest size with such a file."""
    for _, of_size in sorted(results.cells.drop_duplicates("scene").groupby("n"), reverse=True):
        scenes = of_size.sort_values(["active", "scene"])["scene"].tolist()
        scene = scenes[len(scenes) // 2]
        arrays = results.scene_arrays(scene)
        if arrays is not None:
            unread = Text(f"The file of scene {scene} could not be read.")
            block: Block = _figure(scene, arrays) if arrays else unread
            return Section("The gap before and after", [block])
    return None


def _figure(scene: str, arrays: dict[str, Array]) -> Figure:
    nodes, before, after, lam = (arrays[k] for k in ("contact_nodes", "gap_before", "gap_after", "lam"))
    marks = {"fasteners": arrays["fasteners"].tolist()} if len(arrays.get("fasteners", ())) else {}
    closed, gap = lam > 0, rooted("gap, mm", "viridis", before, after)
    force = rooted("force, N", "magma_r", lam)
    maps = [
        Map("gap before", nodes, before, gap, (), marks),
        Map("gap after", nodes, after, gap, [(closed, CLOSED, "closed contacts")], marks),
        Map(
            "contact forces", nodes, np.where(closed, lam, np.nan), force, [(closed, RIM, "closed contacts")]
        ),
    ]
    caption = (
        f"*Scene {scene}: the gap before and after, and the contact forces*, in true proportions; "
        f"{closed.sum()} contacts are closed."
    )
    return Figure("gap-map", caption, drawn(maps, 3)[0])
