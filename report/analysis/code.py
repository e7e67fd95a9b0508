"""Which code the rows were measured with, and what to know before comparing them."""

from __future__ import annotations

import pandas as pd

from harness.results.provenance import commit
from report.document.numbers import counted, listed

DIGITS = 10  # of a commit, in sentences


def commits(rows: pd.DataFrame) -> dict[str, int]:
    """The number of rows by commit; '' counts those that do not record it."""
    return {str(name): int(count) for name, count in rows["commit"].value_counts(sort=False).items()}


def code_warnings(rows: pd.DataFrame) -> list[str]:
    """One sentence per reason to doubt that the rows are of one code, and of the code that is running."""
    found: list[str] = []
    counts = commits(rows)
    if len(counts) > 1:
        names = [f"{_short(name)} ({counted(count, 'row')})" for name, count in counts.items()]
        found.append(f"The tables mix rows measured with different code: {listed(names)}.")
    elif "" in counts:
        found.append("No row records the commit it was measured with.")
    changed = int((rows["clean"] == 0).sum())
    if changed:
        which = f"{counted(changed, 'row')} {_was(changed)}"
        found.append(f"{which} measured with uncommitted changes to that commit.")
    found += _solvers(rows)
    other = sum(count for name, count in counts.items() if name not in ("", commit()[0]))
    if other:
        which = "All rows were" if other == len(rows) else f"{other} of {len(rows)} rows {_was(other)}"
        found.append(f"{which} measured with older code than the code that drew this report.")
    return found


def _solvers(rows: pd.DataFrame) -> list[str]:
    """A solver and the part of the project that calls it have one code in all rows."""
    codes = rows[rows["solver_code"] != ""].groupby("solver")["solver_code"].nunique()
    mixed = [str(solver) for solver in codes.index[codes > 1]]
    return [f"The tables mix rows of different code of {listed(mixed)}."] if mixed else []


def commits_text(rows: pd.DataFrame) -> str:
    """The commits in full, each with the state of the tree: '0123… (clean)'."""
    states = rows["clean"].map({1.0: " (clean)", 0.0: " (with uncommitted changes)"}).fillna("")
    words = rows["commit"].where(rows["commit"] != "", "not recorded") + states
    return listed([str(text) for text in words.unique()])


def _was(number: int) -> str:
    return "was" if number == 1 else "were"


def _short(name: str) -> str:
    hexadecimal = len(name) == 40 and set(name) <= set("0123456789abcdef")
    return f"commit {name[:DIGITS]}" if hexadecimal else name or "a commit that is not recorded"
