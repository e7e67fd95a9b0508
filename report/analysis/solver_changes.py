"""A comparison of two runs, solver by solver."""

from __future__ import annotations

import numpy as np
import pandas as pd

from .comparison import BETTER, MISSING, WORSE


def by_solver(table: pd.DataFrame) -> pd.DataFrame:
    """One line per solver: its measurements on both sides, how many became worse or better, the digits lost
    in the median and at most, and the geometric mean of the ratios of times.
    """
    both = table[(table[["verdict_old", "verdict_new"]] != MISSING).all(axis=1)]
    lines = []
    for solver, own in both.groupby("solver_new"):
        ratios = own["ratio"].dropna()
        lines.append(
            {
                "solver": solver,
                "measurements": len(own),
                "worse": int(own["kind"].isin(WORSE).sum()),
                "better": int((own["kind"] == BETTER).sum()),
                "digits_lost": own["digits_lost"].median(),
                "most_digits_lost": own["digits_lost"].max(),
                "ratio": float(np.exp(np.log(ratios).mean())) if len(ratios) else np.nan,
            }
        )
    return pd.DataFrame(lines)
