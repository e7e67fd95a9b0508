"""How a measurement on a rung ended: correct or wrong, and whether the solver reported it as solved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

CORRECT, CORRECT_UNCLAIMED = "correct, reported solved", "correct, not reported solved"
WRONG_UNCLAIMED, WRONG_CLAIMED = "wrong, not reported solved", "wrong, reported solved"
NO_ANSWER, UNJUDGED = "no answer", "cannot be judged"


def outcome(row: Mapping[str, Any] | pd.Series[Any]) -> str:
    """Correct: within the row's limit."""
    claimed = row["status"] == "solved"
    match row["verdict"]:
        case "within":
            return CORRECT if claimed else CORRECT_UNCLAIMED
        case "outside":
            return WRONG_CLAIMED if claimed else WRONG_UNCLAIMED
        case "cannot_be_judged":
            return UNJUDGED
    return NO_ANSWER


def with_outcomes(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells on rungs with `ladder`, `rung` and `outcome`, without the forms that a solver does not take."""
    taken = cells[cells["status"] != "unsupported"]
    names = taken["scene"].str.split("/", expand=True)
    return taken.assign(ladder=names[1], rung=names[2], outcome=taken.apply(outcome, axis=1))


def is_correct(cells: pd.DataFrame) -> pd.Series[bool]:
    """Where the answer is correct, whatever the solver reported."""
    return cells["outcome"].isin([CORRECT, CORRECT_UNCLAIMED])
