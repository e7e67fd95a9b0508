"""The same joint with two plans of fasteners: which gap is left, and is it small enough?

    python examples/will_it_close.py [FILE.png]      draws the maps of docs/decide.md into FILE.png

It calls `python -m harness solve three-fasteners.toml fourteen-fasteners.toml --allow-gap 0.05` on the scenes
beside this file and reads the tables that the command writes.

Prints the largest gap that fourteen fasteners leave, mm.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

PLANS = ("three-fasteners", "fourteen-fasteners")
ALLOWED_MM = 0.05
RED, GREEN = "#C0392B", "#1E8449"


def solved(directory: Path) -> list[tuple[pd.DataFrame, pd.DataFrame]]:
    """Of each plan the tables of its contacts and its fasteners."""
    scenes = [str(Path(__file__).with_name(f"{plan}.toml")) for plan in PLANS]
    words = ["solve", *scenes, "--allow-gap", str(ALLOWED_MM), "--out", str(directory)]
    subprocess.run([sys.executable, "-m", "harness", *words], check=True, stdout=subprocess.DEVNULL)
    folders = [directory / "first", directory / "second"]
    return [(pd.read_csv(d / "contacts.csv"), pd.read_csv(d / "fasteners.csv")) for d in folders]


def draw(plans: list[tuple[pd.DataFrame, pd.DataFrame]], file: Path) -> None:
    """One map per plan on one scale; too large a gap is outlined."""
    figure = Figure(figsize=(8.0, 3.5), layout="constrained")
    every = figure.subplots(len(plans), 1, sharex=True)
    for name, axes, (contacts, fasteners) in zip(PLANS, every, plans, strict=True):
        gap = contacts.pivot_table(index="y_mm", columns="x_mm", values="gap_after_mm")
        passed = gap.to_numpy().max() <= ALLOWED_MM
        shown = axes.pcolormesh(gap.columns, gap.index, gap, vmin=0.0, vmax=0.15, cmap="Blues")
        axes.contour(gap.columns, gap.index, gap, [ALLOWED_MM], colors=RED, linewidths=1.3)
        axes.plot(fasteners["x_mm"], fasteners["y_mm"], "o", ms=5, mfc="white", mec="black", clip_on=False)
        axes.set(aspect="equal", ylabel="y, mm")
        said = f"{name.replace('-', ' ')}: largest gap {gap.to_numpy().max():.3f} mm"
        axes.set_title(said, loc="left", fontsize=10)
        word, colour = ("PASS", GREEN) if passed else ("FAIL", RED)
        axes.set_title(word, loc="right", fontsize=14, fontweight="bold", color=colour)
    every[-1].set_xlabel("x, mm")
    figure.colorbar(shown, ax=every, label=f"gap, mm; red line: {ALLOWED_MM} mm", shrink=0.9)
    figure.savefig(file, dpi=110)


def main(file: Path | None = None) -> float:
    with TemporaryDirectory() as folder:
        plans = solved(Path(folder))
    if file:
        draw(plans, file)
    return float(np.max(plans[1][0]["gap_after_mm"]))


if __name__ == "__main__":
    print(f"{main(Path(sys.argv[1]) if len(sys.argv) > 1 else None):.6f}")
