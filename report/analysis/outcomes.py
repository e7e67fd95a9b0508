"""How a measurement on a rung ended: right or wrong, and whether the solver knew."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

RIGHT, DOUBTED = "right, called solved", "right, not called solved"
KNEW, LIED = "wrong, not called solved", "wrong, called solved"
NONE, UNJUDGED = "no answer", "cannot be judged"


def outcome(row: Mapping[str, Any] | pd.Series[Any]) -> str:
    """Right is within the row's limit."""
    said_solved = row["status"] == "solved"
    match row["verdict"]:
        case "within":
            return RIGHT if said_solved else DOUBTED
        case "outside":
            return LIED if said_solved else KNEW
        case "cannot_be_judged":
            return UNJUDGED
    return NONE


def with_outcomes(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells on rungs with `ladder`, `rung` and `outcome`, without the forms that a solver does not take."""
    taken = cells[cells["status"] != "unsupported"]
    names = taken["scene"].str.split("/", expand=True)
    return taken.assign(ladder=names[1], rung=names[2], outcome=taken.apply(outcome, axis=1))


def holds(cells: pd.DataFrame) -> pd.Series[bool]:
    """Where the answer is right, whatever was said of it."""
    return cells["outcome"].isin([RIGHT, DOUBTED])
