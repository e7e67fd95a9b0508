"""Where one method overtakes another as more contacts close, and which worst case is longer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import pandas as pd

from report.analysis.seconds import timed
from report.document.blocks import records
from report.document.numbers import counted, significant

from .selection import METHODS, of_method


@dataclass(frozen=True)
class Crossing:
    """From `at` (active share of m) on, `faster` is the faster method; None if one of the two runs around it
    was stopped by the clock, so that it is only known to lie in (low, high).
    """

    low: float
    high: float
    at: float | None
    faster: str

    def __str__(self) -> str:
        if self.at is not None:
            return f"at {100 * self.at:.0f} % {self.faster} becomes faster"
        return f"between {100 * self.low:.0f} and {100 * self.high:.0f} % {self.faster} becomes faster"


@dataclass(frozen=True)
class Pair:
    """Two methods at one size: `shares` of the scenes compared, the crossings, which one is faster at the low
    end, and how many scenes could not be compared.
    """

    n: int
    first: str
    second: str
    shares: list[float]
    crossings: list[Crossing]
    faster_at_low: str
    left_out: int
    keys: list[str]

    def __str__(self) -> str:
        if not self.shares:
            return "not measured"
        low, high = 100 * self.shares[0], 100 * self.shares[-1]
        words = [f"at {low:.0f} % {self.faster_at_low} is faster", *map(str, self.crossings)]
        if not self.crossings:
            words = [f"none: {self.faster_at_low} is faster from {low:.0f} to {high:.0f} %"]
        left_out = f" ({counted(self.left_out, 'scene')} could not be compared)" if self.left_out else ""
        return "; ".join(words) + left_out


def compared(cells: pd.DataFrame, n: int, first: str, second: str) -> Pair:
    """Piecewise linear in the active share, for the logarithm of the seconds per load case."""
    a, b = (_lines(cells, n, name) for name in (first, second))
    both = a.merge(b, left_index=True, right_index=True, suffixes=("_a", "_b")).sort_values("share_a")
    points: list[tuple[float, float, bool]] = []  # share, log(time of second / time of first), exact
    for row in records(both):
        ratio = math.log(row["at_least_b"] / row["at_least_a"])
        # a lower bound decides only if it is the larger of the two
        unknown = (row["cut_a"] and ratio >= 0) or (row["cut_b"] and ratio <= 0)
        if not unknown:
            points.append((row["share_a"], ratio, not (row["cut_a"] or row["cut_b"])))
    crossings = []
    for (x0, r0, exact0), (x1, r1, exact1) in pairwise(points):
        if (r0 > 0) == (r1 > 0):
            continue
        at = x0 + (x1 - x0) * r0 / (r0 - r1) if exact0 and exact1 else None
        crossings.append(Crossing(x0, x1, at, first if r1 > 0 else second))
    scenes = set(_scenes(cells, n, first)) | set(_scenes(cells, n, second))
    faster = "" if not points else first if points[0][1] > 0 else second
    keys = [*both["key_a"], *both["key_b"]]
    shares = [p[0] for p in points]
    return Pair(n, first, second, shares, crossings, faster, len(scenes) - len(points), keys)


def _scenes(cells: pd.DataFrame, n: int, name: str) -> list[str]:
    rows = of_method(cells, name)
    return rows.loc[rows["n"] == n, "scene"].tolist()


def _lines(cells: pd.DataFrame, n: int, name: str) -> pd.DataFrame:
    rows = timed(of_method(cells, name))
    rows = rows[(rows["n"] == n) & (rows["at_least"] > 0) & (rows["m"] > 0)]
    rows = rows.assign(share=rows["active"] / rows["m"]).set_index("scene")
    return rows[["share", "at_least", "cut", "key"]]


@dataclass(frozen=True)
class Worst:
    """The longest time over the scenes of a size; `cut`: only a lower bound; `missing`: scenes with neither
    an answer within the limit nor a time limit reached.
    """

    seconds: float
    cut: bool
    missing: int
    scene: str
    key: str

    def __str__(self) -> str:
        lost = f", {self.missing} without an answer" if self.missing else ""
        return f"{'> ' if self.cut else ''}{significant(self.seconds)} s (scene {self.scene}{lost})"


BETTER = "the better of GI dual and primal"


def worst(cells: pd.DataFrame, n: int, name: str) -> Worst | None:
    """For one of METHODS, or for BETTER: the better form of GI on each scene."""
    if name == BETTER:
        both = pd.concat([of_method(cells, "GI dual"), of_method(cells, "GI primal")])
        rows = timed(both[both["n"] == n]).sort_values(["at_least", "cut"], na_position="last")
        rows = rows.drop_duplicates("scene")
    else:
        rows = timed(of_method(cells, name))
        rows = rows[rows["n"] == n]
    known = rows.dropna(subset=["at_least"])
    if known.empty:
        return None
    row = known.sort_values(["at_least", "cut"]).iloc[-1]
    missing = len(rows) - len(known)
    return Worst(float(row["at_least"]), bool(row["cut"]), missing, str(row["scene"]), str(row["key"]))


def below(mine: Worst | None, other: Worst | None) -> bool | None:
    """Whether one worst case is below the other; None if undecided."""
    if mine is None or other is None:
        return None
    if mine.seconds < other.seconds:
        return None if mine.cut or mine.missing else True
    return None if other.cut or other.missing else False


def at_share(cells: pd.DataFrame, n: int, name: str, share: float) -> tuple[float, bool, list[str]] | None:
    """Seconds at an active share, interpolated like the crossings, whether it is only a lower bound, and the
    rows it is based on; None outside the range of the scenes.
    """
    lines = _lines(cells, n, name).sort_values("share")
    below_it, above = lines[lines["share"] <= share], lines[lines["share"] >= share]
    if below_it.empty or above.empty:
        return None
    low, high = below_it.iloc[-1], above.iloc[0]
    width = float(high["share"] - low["share"])
    weight = 0.0 if width == 0 else (share - float(low["share"])) / width
    logs = (1 - weight) * math.log(low["at_least"]) + weight * math.log(high["at_least"])
    return math.exp(logs), bool(low["cut"] or high["cut"]), [str(low["key"]), str(high["key"])]


def sizes(cells: pd.DataFrame) -> list[int]:
    """Sizes with at least two scenes of the interior-point or the Goldfarb–Idnani method."""
    rows = pd.concat([of_method(cells, name) for name in METHODS])
    counted = rows.groupby("n")["scene"].nunique()
    return sorted(int(n) for n in counted[counted > 1].index.to_list())
