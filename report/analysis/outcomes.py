"""How a measurement on a rung ended: correct or wrong, and whether the solver reported it as solved."""

from __future__ import annotations

import pandas as pd

CORRECT, CORRECT_UNCLAIMED = "correct, reported solved", "correct, not reported solved"
WRONG_UNCLAIMED, WRONG_CLAIMED = "wrong, not reported solved", "wrong, reported solved"
NO_ANSWER, UNJUDGED = "no answer", "cannot be judged"
#: By verdict, and whether the solver reported it as solved. Correct: within the row's limit.
OUTCOMES = {
    ("within", True): CORRECT,
    ("within", False): CORRECT_UNCLAIMED,
    ("outside", False): WRONG_UNCLAIMED,
    ("outside", True): WRONG_CLAIMED,
    ("no_answer", False): NO_ANSWER,
    ("cannot_be_judged", False): UNJUDGED,
    ("cannot_be_judged", True): UNJUDGED,
}


def with_outcomes(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells on rungs with `ladder`, `rung` and `outcome`, without the forms that a solver does not take."""
    taken = cells[cells["status"] != "unsupported"]
    names = taken["scene"].str.split("/", expand=True)
    ends = zip(taken["verdict"], taken["status"] == "solved", strict=True)
    return taken.assign(
        ladder=names[1], rung=names[2], outcome=[OUTCOMES.get(end, NO_ANSWER) for end in ends]
    )
