"""The requirements on the preconditioner: relative to V = I, and late in the iteration."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from report.document.blocks import records

from .cg import SYSTEMS, Counts, counts
from .selection import first, ipm

RATIO = 20  # V = I over V, CG iterations summed over a solve, at least
LATE = 40  # CG iterations per system in the second half of a solve, at most
ORDERINGS = ("V = U + √D", "V = U + √D, open gaps last")


@dataclass(frozen=True)
class Ratio:
    """The CG iterations of V = I and of V on one scene, and the two rows."""

    scene: str
    n: int
    none: Counts
    V: Counts
    keys: list[str]

    @property
    def value(self) -> float:
        return self.none.total / max(self.V.total, 1)

    @property
    def met(self) -> bool | None:
        """None: undecided, because a solve was stopped."""
        reached = self.value >= RATIO
        undecided = (self.V.cut and reached) or (self.none.cut and not reached)
        return None if undecided else reached

    def __str__(self) -> str:
        more = "≥ " if self.none.cut else ""
        V = f"{'≥ ' if self.V.cut else ''}{self.V.total}"
        return f"scene {self.scene} {more}{self.none.total} / {V} = {more}{self.value:.0f}"


def ratios(cells: pd.DataFrame, ordering: str = "V = U + √D") -> list[Ratio]:
    """One per scene with counts of both V = I and V."""
    found = []
    for scene in cells["scene"].unique():
        of_scene = cells[cells["scene"] == scene]
        rows = [first(ipm(of_scene, **SYSTEMS[name])) for name in ("V = I", ordering)]
        none, V = (counts(row) for row in rows)
        if none and V and rows[0] and rows[1]:
            keys = [rows[0]["key"], rows[1]["key"]]
            found.append(Ratio(str(scene), int(rows[0]["n"]), none, V, keys))
    return found


def ratio_target(cells: pd.DataFrame) -> list[str]:
    """One sentence per size."""
    by_size: dict[int, list[Ratio]] = {}
    for ratio in ratios(cells):
        by_size.setdefault(ratio.n, []).append(ratio)
    sentences = []
    for n, of_size in sorted(by_size.items()):
        met = [ratio.met for ratio in of_size]
        verdict = "not met" if False in met else "not decided" if None in met else "met"
        evidence = "; ".join(map(str, of_size))
        asked = f"At most 1/{RATIO} of the CG iterations of V = I, n = {n}"
        sentences.append(f"{asked}: **{verdict}** ({evidence}).")
    return sentences


def largest_late(cells: pd.DataFrame) -> dict[str, dict[int, tuple[int, str, str]]]:
    """By ordering and size: the largest count in the second half of a solve, with its scene and row."""
    found: dict[str, dict[int, tuple[int, str, str]]] = {}
    for name in ORDERINGS:
        for row in records(ipm(cells, **SYSTEMS[name])):
            of_row = counts(row)
            if of_row is None:
                continue
            at_size = found.setdefault(name, {})
            here = (of_row.late, row["scene"], row["key"])
            at_size[int(row["n"])] = max(at_size.get(int(row["n"]), (-1, "", "")), here)
    return found


def late_target(cells: pd.DataFrame) -> list[str]:
    """One sentence per size, for the better of the two orderings, with both figures."""
    late = largest_late(cells)
    sentences = []
    for n in sorted({n for of_sizes in late.values() for n in of_sizes}):
        here = {name: late[name][n] for name in late if n in late[name]}
        verdict = "met" if min(here.values())[0] <= LATE else "not met"
        evidence = "; ".join(f"{name}: {count} (scene {scene})" for name, (count, scene, _) in here.items())
        sentences.append(
            f"With the better ordering at most {LATE} CG iterations late in the solve, n = {n}: "
            f"**{verdict}** (largest: {evidence})."
        )
    return sentences
