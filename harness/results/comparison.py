"""Reads the rows of the two sides of a comparison, refuses those of other problems, and counts lost digits.

The digits lost between two errors of the same measurement are

    log10( max(after, floor) / max(before, floor) ),    floor = max(bound, NEGLIGIBLE · limit)

bound is the error bound of the reference: below it, a difference says nothing about the answers. Neither does
a difference between errors a million times below the limit.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from math import isclose, log10
from pathlib import Path

from problems.errors import Fault, InputError

from .records import Row
from .row_validation import MAX_FAULTS, measured_rows
from .schema import ROUND

#: The fields that a comparison needs.
NEEDED = ("scene", "solver", "form", "tolerance", "status", "verdict")
SAME_LIMIT = 1e-3  # relative; on a rung of a ladder, the limit is computed
NEGLIGIBLE = 1e-6


class Incomparable(InputError):
    """Inputs that are each sound but do not belong together; commands end with an exit code of its own.

    They are of different problems, limits, machines or suites, or an answer has another problem's length.

    Parameters
    ----------
    faults : list of Fault
        Each with the input, its value, and what it should belong to.
    """


@dataclass(frozen=True)
class Side:
    """Rows to compare. name : the directory as the user gave it."""

    name: str
    rows: list[Row]

    @property
    def machines(self) -> set[str]:
        return {str(row.get("machine")) for row in self.rows}


def read_rows(name: str) -> Side:
    """All rows of a directory. Raises InputError."""
    return Side(name, measured_rows(Path(name), NEEDED))


def read_side(name: str, key: str | None = None) -> Side:
    """The rows of a directory to compare: none of a round, and none that a trace stopped.

    With a key, only the row of that key, at the tolerance that the key names; where there is none, those of
    the same measurement in no round or in others, as each directory has rounds of its own. Raises InputError.
    """
    rows = read_rows(name).rows
    if key is None:
        whole = [row for row in rows if not row.get("round") and row.get("iteration_limit") is None]
        refuse_other_options(side := Side(name, whole))
        return side
    wanted, keys = key, [str(row.get("key")) for row in rows]
    if key not in keys:
        wanted, keys = key.partition(ROUND)[0], [one.partition(ROUND)[0] for one in keys]
    pairs = zip(rows, keys, strict=True)
    if not (rows := [row | {"searched": False} for row, one in pairs if one == wanted]):
        raise InputError.one("--key", "key", key, f"the key of a row in {name}")
    return Side(name, rows)


def refuse_other_options(side: Side) -> None:
    """Raise InputError if rows of one measurement have other options: they are no repeats of each other."""
    first: dict[str, str] = {}
    for row in side.rows:
        name, options = measurement(row), json.dumps(row.get("options") or {}, sort_keys=True)
        if first.setdefault(name, options) != options:
            allowed = f"{first[name]}, as in an earlier row of this measurement: these are no repeats"
            raise InputError.one(side.name, f"options of {name}", options, allowed)


def measurement(row: Row) -> str:
    """The measurement of a row, without its repeat: '4386/0107 ipm dual tol=1e-09 threads=2'.

    A tolerance that a search has found is no part of it: 'tol=auto'.
    """
    tolerance = "auto" if row.get("searched") else f"{row['tolerance']:g}"
    words = [row["scene"], row["solver"], row["form"], row.get("variant"), f"tol={tolerance}"]
    batched = row.get("batched_asked", row.get("batched"))  # rows of older versions lack the first
    asked = {"threads": row.get("threads_asked"), "batched": batched, "case": row.get("case")}
    words += [f"{word}={value}" for word, value in asked.items() if value is not None]
    return " ".join(filter(None, words))


def refuse_incomparable(old: Side, new: Side) -> None:
    """Raise Incomparable if both sides have no measurement in common, or differ in a problem or a limit.

    Each such scene or measurement is named.
    """
    before = {measurement(row): row for row in old.rows}
    shared = [(before[name], row) for row in new.rows if (name := measurement(row)) in before]
    if not shared:
        of, others = (sorted({str(row.get("suite")) for row in side.rows}) for side in (old, new))
        allowed = f"no measurement of {old.name} (suite {', '.join(of)}) is in it"
        raise Incomparable.one(new.name, "suite", others, allowed)
    faults = list(dict.fromkeys(fault for pair in shared for fault in _differences(old, new, *pair)))
    if faults:
        raise Incomparable(faults[:MAX_FAULTS])


def _differences(old: Side, new: Side, one: Row, other: Row) -> Iterator[Fault]:
    """The differences of the problem or of the limit between two rows of one measurement."""
    for name in ("scene_key", "n", "m"):
        values = one.get(name), other.get(name)
        if None not in values and values[0] != values[1]:
            allowed = f"another problem than in {old.name}, whose {name} is {values[0]}"
            yield Fault(new.name, f"scene {other['scene']}", values[1], allowed)
            break
    before, after = one.get("limit_mm"), other.get("limit_mm")
    if before and after and not isclose(before, after, rel_tol=SAME_LIMIT):
        allowed = f"another limit than in {old.name}: {before:g} mm"
        yield Fault(new.name, f"limit_mm of {other['scene']}", after, allowed)


def floor_mm(bound_mm: float, limit_mm: float) -> float:
    """The smallest error that counts, mm."""
    return max(bound_mm, NEGLIGIBLE * limit_mm)


def digits_lost(before_mm: float, after_mm: float, floor: float) -> float:
    """The digits lost, negative if digits were gained. floor : positive."""
    return log10(max(after_mm, floor) / max(before_mm, floor))
