"""Which measurements became slower beside the other solvers of their run: `gate --max-slowdown R`.

Seconds of two machines cannot be compared, but what other solvers take on the same scene in the same run can.
With t the median seconds per load case over the repeats, and t' that in the baseline,

    S = (t / t') / F,    F the median of t / t' over the other solvers' measurements on the scene.

A measurement is slower if S > R and, beyond the noise of the repeats in both runs,

    min t / max t'  >  F⁺,    F⁺ the median of max t / min t' over the same others.

Three repeats on each side are needed: all new ones are slower by chance once in 20 times. If all solvers on a
scene become slower alike, nothing is reported. The two runs may be of two machines, but each of one alone.
"""

from math import inf

import pandas as pd

from harness.results.comparison import Incomparable, Side, measurement
from problems.errors import InputError
from report.analysis.comparison import ENOUGH, compared
from report.results.rows import frame

NEEDED = f"{ENOUGH} repeats of two solvers on its scene, in both runs"


def slowdowns(old: Side, new: Side, limit: float) -> dict[str, float | None]:
    """S of each measurement whose time can be compared; None if it is not slower. limit : R.

    Raises InputError if no time can be compared; Incomparable if a side has rows of several machines.
    """
    for side in (old, new):
        if len(side.machines) > 1:
            allowed = "one machine for all rows of a side: name the directory of one machine's run"
            raise Incomparable.one(side.name, "machine", sorted(side.machines), allowed)
    frames = [frame([row | {"measurement": measurement(row)} for row in side.rows]) for side in (old, new)]
    table = compared(frames[0], frames[1], True, inf, limit)
    table = table[(table[["repeats_old", "repeats_new"]].min(axis=1) >= ENOUGH) & table["ratio"].notna()]
    beside: list[pd.DataFrame] = []
    for _, of_scene in table.groupby("scene_new"):
        for solver, own in of_scene.groupby("solver_new"):
            others = of_scene[of_scene["solver_new"] != solver]
            if len(others):
                middle = others[["ratio", "ratio_most"]].median()
                own = own.assign(ratio_other=middle["ratio"], ratio_most_other=middle["ratio_most"])
                beside.append(own.set_index("measurement"))
    if not beside:
        raise InputError.one("--max-slowdown", "factor", limit, f"{NEEDED}: --repeat {ENOUGH}")
    lines = pd.concat(beside)
    S = lines["ratio"] / lines["ratio_other"]
    slower = (limit < S) & (lines["ratio_least"] > lines["ratio_most_other"])
    names = map(str, lines.index)
    return {name: float(s) if more else None for name, s, more in zip(names, S, slower, strict=True)}
