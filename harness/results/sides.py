"""The rows of the two sides of a comparison, and whether they can be compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isclose
from pathlib import Path

from problems.errors import Fault, InputError

from .incomparable import Incomparable
from .kinds import MAX_FAULTS, refuse_wrong_kinds
from .records import MEASUREMENTS, OUTDATED, Row, read

#: What a comparison needs of a row.
NEEDED = ("scene", "solver", "form", "tolerance", "status", "verdict")
SAME_LIMIT = 1e-3  # relative; on a rung of a ladder, the limit is computed
FEWEST_DIGITS = 4  # of a commit


@dataclass(frozen=True)
class Side:
    """Rows to compare. name : as the user gave it, DIR or DIR@COMMIT."""

    name: str
    rows: list[Row]

    @property
    def machines(self) -> set[str]:
        return {str(row.get("machine")) for row in self.rows}


def read_side(name: str, key: str | None = None) -> Side:
    """The rows of DIR, or of DIR@COMMIT: those that this commit measured, also where `run` has set them aside
    since; with a key, only the row of that key. Raises InputError.
    """
    directory, at, commit = name.rpartition("@")
    if Path(name).is_dir() or not at:
        directory, at = name, ""
    path = Path(directory) / MEASUREMENTS
    if not path.is_file():
        raise InputError.one("DIR", "directory", name, f"has no {path.name}; `run` creates one")
    files = (path.with_name(OUTDATED), path) if at else (path,)
    rows: list[Row] = []
    for file in files:
        found = read(file)
        refuse_wrong_kinds(file, found, needed=NEEDED)
        rows += found
    if not rows:
        raise InputError.one("DIR", "directory", name, f"{path.name} has no row yet")
    if at:
        known = sorted({str(row["commit"])[:12] for row in rows if row.get("commit")})
        rows = [row for row in rows if str(row.get("commit")).startswith(commit)]
        if len(commit) < FEWEST_DIGITS or len({row["commit"] for row in rows}) != 1:
            allowed = f"a commit of these rows, at least {FEWEST_DIGITS} digits: {', '.join(known) or 'none'}"
            raise InputError.one(directory, "commit", commit, allowed)
    if key is not None and not (rows := [row for row in rows if row.get("key") == key]):
        raise InputError.one("--key", "key", key, f"the key of a row in {name}")
    return Side(name, rows)


def batched(row: Row) -> int | None:
    """How many load cases were solved at once; older rows call it `together`."""
    found = row.get("batched", row.get("together"))
    return None if found is None else int(found)


def measurement(row: Row) -> str:
    """What a row is of, its repeat apart: '4386/0107 ipm dual tol=1e-09 threads=2'."""
    words = [row["scene"], row["solver"], row["form"], row.get("variant"), f"tol={row['tolerance']:g}"]
    asked = {"threads": row.get("threads_asked"), "batched": batched(row), "case": row.get("case")}
    words += [f"{word}={value}" for word, value in asked.items() if value is not None]
    return " ".join(filter(None, words))


def refuse_incomparable(old: Side, new: Side) -> None:
    """Raise Incomparable, naming each scene or measurement, if both sides have nothing in common, or if a
    scene is another problem, or a limit another one.
    """
    before = {measurement(row): row for row in old.rows}
    shared = [(before[name], row) for row in new.rows if (name := measurement(row)) in before]
    if not shared:
        of = sorted({str(row.get("suite")) for row in old.rows})
        allowed = f"no measurement of {old.name} (suite {', '.join(of)}) is in it"
        raise Incomparable.one(
            new.name, "suite", sorted({str(row.get("suite")) for row in new.rows}), allowed
        )
    faults = list(dict.fromkeys([*_other_problems(old, new, shared), *_other_limits(old, new, shared)]))
    if faults:
        raise Incomparable(faults[:MAX_FAULTS])


def _other_problems(old: Side, new: Side, shared: Sequence[tuple[Row, Row]]) -> Iterator[Fault]:
    for one, other in shared:
        for name in ("scene_key", "n", "m"):
            values = one.get(name), other.get(name)
            if None not in values and values[0] != values[1]:
                allowed = f"another problem than in {old.name}, whose {name} is {values[0]}"
                yield Fault(new.name, f"scene {other['scene']}", values[1], allowed)
                break


def _other_limits(old: Side, new: Side, shared: Sequence[tuple[Row, Row]]) -> Iterator[Fault]:
    for one, other in shared:
        before, after = one.get("limit_mm"), other.get("limit_mm")
        if before and after and not isclose(before, after, rel_tol=SAME_LIMIT):
            allowed = f"another limit than in {old.name}: {before:g} mm"
            yield Fault(new.name, f"limit_mm of {other['scene']}", after, allowed)
