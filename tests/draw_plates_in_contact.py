"""Compares the gaps of two codes on ever finer meshes: the table and the pictures of docs/outside.md.

    python tests/draw_plates_in_contact.py docs/outside     some minutes

Writes a picture per scene of the gallery, and prints a row per scene and mesh.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray
from plates_in_contact import Found, Question, initial_gap, question

from report.figures import maps, style

Array = NDArray[np.float64]

#: Node spacings on our side as fractions of the scene's, and the sides of their triangles, mm.
MESHES = ((1, 25.0), (2, 15.0), (3, 10.0))
DRAWN = 1  # which of them
#: Of each scene, the lines y = const of the picture, mm; of its contacts the first is drawn.
SCENES = {"gallery/measured-gap": (45.0, 105.0), "gallery/three-part-stack": (30.0, 90.0)}
ALL = (*SCENES, "docs/effects.md")


def compared(name: str) -> tuple[Found, Found]:
    """Our answer and theirs on the mesh that is drawn; prints the rows of all."""
    asked = question(name)
    ours, theirs = [], []
    for times, element in MESHES:
        ours.append(asked.ours(times))
        theirs.append(asked.theirs(element, times))
        print(f"{name}: {asked.spacing / times:g} and {element:g} mm computed", file=sys.stderr, flush=True)
    for (times, element), a, b in zip(MESHES, ours, theirs, strict=True):
        figures = (*a.apart(b), *ours[-1].apart(a), *theirs[-1].apart(b))
        cells = [
            f"`{name}`",
            f"{asked.spacing / times:g}",
            f"{element:g}",
            *(f"{100 * d:.2f} %" for d in figures),
        ]
        print("| " + " | ".join(cells) + " |", flush=True)
    return ours[DRAWN], theirs[DRAWN]


def drawn(asked: Question, ours: Array, theirs: Array, lines: tuple[float, ...]) -> Figure:
    """The map of their difference, and below it both gaps along some lines."""
    joint, largest = asked.joint, ours[0].max()
    before = initial_gap(asked.scene).reshape(ours.shape)[0]
    nodes = joint.nodes
    figure = style.figure(5.2)
    upper, lower = figure.subplots(2, 1, height_ratios=(1, 2.2), sharex=True)
    apart = 100 * (theirs[0] - ours[0]) / largest
    limit = float(abs(apart).max())
    norm = TwoSlopeNorm(0.0, -limit, limit)
    drawing = maps.draw(upper, nodes, apart.ravel(), norm, "RdBu_r")
    upper.set_title("difference of the gaps, at the scene's nodes")
    upper.set_aspect("auto")  # above the lines, x for x
    figure.colorbar(drawing, ax=(upper, lower), label="difference, % of the largest gap")
    for y, colour in zip(lines, (style.BLUE, style.VERMILLION), strict=True):
        row = int(np.flatnonzero(joint.y == y)[0])
        lower.plot(joint.x, before[row], color=colour, lw=1.0, ls=":", label=f"y = {y:g} mm: before")
        lower.plot(joint.x, ours[0][row], color=colour, lw=1.6, label="this project")
        marks = {"marker": "o", "markersize": 4.0, "markerfacecolor": "none"}
        lower.plot(joint.x, theirs[0][row], color=colour, ls="", label="scikit-fem and Clarabel", **marks)
        upper.axhline(y, color=colour, lw=1.0)
    lower.set(xlabel="x, mm", ylabel="gap, mm", ylim=(0, None))
    figure.legend(*lower.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def main(folder: str) -> None:
    Path(folder).mkdir(exist_ok=True)
    print("| scene | nodes, mm | triangles, mm | apart: gaps | reactions | ours | ours | theirs | theirs |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in ALL:
        ours, theirs = compared(name)
        if lines := SCENES.get(name):
            with style.applied():
                figure = drawn(question(name), ours.gaps, theirs.gaps, lines)
                figure.savefig(Path(folder) / f"{Path(name).name}.png", dpi=100)


if __name__ == "__main__":
    main(*sys.argv[1:2])
