"""Figures 3 and 4: the node grids of problems 1 and 3, and the gap remaining with three fasteners."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from report.analysis.paper.selection import SCALING, is_paper
from report.document.blocks import Block, Figure, Place, Section, Text
from report.figures import style
from report.figures.maps import Array, draw
from report.results.printed import TABLE_4
from report.results.reader import Results

PLACE = Place(260)

PROBLEMS = (1, 3)  # those of Figure 3
SHARE = 0.15  # of the strip's length that is shown
FASTENERS = 3  # of Figure 4


def section(results: Results) -> Section | None:
    if not is_paper(results):
        return None
    blocks = [block for block in (_grids(results), _gap(results)) if block]
    return Section("Figures 3 and 4: node grids and gap", blocks) if blocks else None


def _scenes(results: Results, n: int) -> list[str]:
    cells = results.cells
    of_size = cells.loc[(cells["n"] == n) & ~cells["scene"].str.startswith(SCALING), "scene"]
    return sorted(set(of_size))


def _grids(results: Results) -> Block | None:
    sizes = {problem: n for problem, n, *_ in TABLE_4}
    found = {}
    for problem in PROBLEMS:
        arrays = (results.scene_arrays(scene) for scene in _scenes(results, sizes[problem]))
        nodes = next((a["contact_nodes"] for a in arrays if a), None)
        if nodes is not None:
            found[problem] = nodes
    if not found:
        return None
    drawing = style.figure(3.2)
    panels: list[Axes] = list(drawing.subplots(1, len(found), sharex=True, sharey=True, squeeze=False)[0])
    for axes, (problem, nodes) in zip(panels, found.items(), strict=True):
        left = nodes[:, 0].min()
        near = nodes[nodes[:, 0] <= left + SHARE * np.ptp(nodes[:, 0])]
        axes.plot(*near.T, "s", markersize=2.2, color="black")
        axes.set(aspect="equal", xlabel="x, mm", title=f"problem {problem}: {len(nodes)} nodes per part")
        axes.grid(visible=False)
    panels[0].set_ylabel("y, mm")
    missing = [f" Problem {p}: no file of its nodes." for p in PROBLEMS if p not in found]
    caption = (
        f"*The nodes of the junction* (Figure 3 of the paper): the first {SHARE:.0%} of the strip's length, "
        "true proportions. The two differ only in the density of the nodes." + "".join(missing)
    )
    return Figure("paper-figure3", caption, drawing)


def _gap(results: Results) -> Block | None:
    """Problem 3 with three fasteners: the remaining gap."""
    for scene in _scenes(results, TABLE_4[-1][1]):
        arrays = results.scene_arrays(scene)
        if arrays and len(arrays.get("fasteners", ())) == FASTENERS:
            return _drawn(scene, arrays)
    if not _scenes(results, TABLE_4[-1][1]):
        return None
    return Text(f"Figure 4: the scene of problem 3 with {FASTENERS} fasteners was not measured.")


def _drawn(scene: str, arrays: dict[str, Array]) -> Figure:
    nodes, before, after = (arrays[name] for name in ("contact_nodes", "gap_before", "gap_after"))
    width, height = np.ptp(nodes, axis=0)
    drawing = style.figure(7.6 * max(height / width, 0.07) + 0.8)
    axes = drawing.add_subplot()
    norm = Normalize(min(0.0, float(after.min())), float(max(after.max(), before.max(), 1e-12)))
    drawn = draw(axes, nodes, after, norm, "viridis")
    look = {"markersize": 5, "markerfacecolor": "none", "markeredgecolor": style.VERMILLION}
    axes.plot(*arrays["fasteners"].T, "o", **look)  # type: ignore[arg-type]
    axes.set_xlabel("x, mm")
    drawing.colorbar(drawn, ax=axes, label="gap, mm", aspect=8, pad=0.015, fraction=0.05)
    least, most = before.min(), before.max()
    initial = f"constant {most:g} mm" if np.isclose(least, most) else f"{least:.2g} to {most:.2g} mm"
    caption = (
        f"*The gap between the parts with {FASTENERS} fasteners installed* (Figure 4 of the paper), scene "
        f"{scene}: initial gap {initial}, {(arrays['lam'] > 0).sum()} closed contacts; circles: fasteners."
    )
    return Figure("paper-figure4", caption, drawing)
