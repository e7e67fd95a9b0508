"""Published results: results/published holds one directory per suite, and one of the command `series`.

A suite is measured in results/publishing/<commit>/<suite>, beside what is published, and takes its place when
it is whole. It is done when every row there is of the commit of this code, without changes.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

from problems.errors import Fault, InputError

from . import records, series_file
from .provenance import ROOT, commit
from .schema import SERIES as SERIES_FILE

PUBLISHED = ROOT / "results" / "published"
STAGED = ROOT / "results" / "publishing"
SUITES = ROOT / "harness" / "suites"
#: Made by the command `series`, not by a suite.
SERIES = {"gaps": ("4386/1074", "--cases", "1000", "--sd", "0.2", "--correlation-length", "150")}
#: Published first, in this order; the other suites after them.
FIRST = ("default", "speed", "series", "gaps", "methods", "uncondensed", "scaling", "hard", "hard-full")
LAST = ("paper", "accuracy")
#: For a user's own runs and for the CI.
NOT_PUBLISHED = ("gate", "scenes")
DIGITS = 12  # of a commit, in the name of a folder
#: The answers of a suite are kept, for the gate to judge anew, if they take at most this together; so are the
#: scenes' arrays, for their pictures, of which each may take at most as many kB.
KEPT_MIB, KEPT_SCENE_KB = 5, 500
#: A longer time between two rows is not counted: the run was interrupted.
LONGEST_PAUSE_S = 1200.0


def names() -> list[str]:
    """All that is published, in the order of measurement."""
    others = sorted(path.stem for path in SUITES.glob("*.toml"))
    others = [name for name in others if name not in (*FIRST, *LAST, *NOT_PUBLISHED)]
    return [*FIRST, *others, *LAST]


def chosen(asked: Sequence[str]) -> list[str]:
    """Those asked for, in the order of measurement; all if none is. Raises InputError on an unknown name."""
    known = names()
    unknown = [name for name in asked if name not in known]
    if unknown:
        raise InputError([Fault("NAMES", "name", name, f"one of {', '.join(known)}") for name in unknown])
    return [name for name in known if not asked or name in asked]


def code_to_publish() -> str:
    """The commit of this code. Raises InputError unless the command was called in its work tree, and the code
    is as committed.
    """
    digits, clean = commit()
    where = str(ROOT)
    if clean is None or not (ROOT / ".git").exists():
        raise InputError.one("publish", "code", where, "must be in a clone with git, to name its commit")
    if Path.cwd().resolve() != ROOT:
        raise InputError.one(
            "publish", "folder", str(Path.cwd()), f"the code that runs is in {where}: go there"
        )
    if not clean:
        raise InputError.one("publish", "code", where, "has changes that are not committed")
    return digits


def command(name: str, directory: Path) -> list[str]:
    """The words after `python -m harness` that measure it into DIRECTORY, or go on with that."""
    words = ["series", *SERIES[name]] if name in SERIES else ["run", name]
    return [*words, "--out", str(directory)]


def rows_of(directory: Path) -> list[records.Row]:
    """The rows of a suite or a series; none if there is no such directory."""
    return list(series_file.rows(directory)) or records.read(directory / records.MEASUREMENTS)


def is_of(rows: Sequence[Mapping[str, Any]], digits: str) -> bool:
    """Whether there are rows, and all were measured with that commit, without changes."""
    return bool(rows) and all((row.get("commit"), row.get("clean")) == (digits, True) for row in rows)


def seconds(rows: Sequence[Mapping[str, Any]]) -> float | None:
    """How long the measurement took, by the times of the rows; None if they have none."""
    times = sorted(datetime.fromisoformat(str(row["recorded_at"])) for row in rows if row.get("recorded_at"))
    steps = [(after - before).total_seconds() for before, after in pairwise(times)]
    return sum(step for step in steps if step <= LONGEST_PAUSE_S) if steps else None


def staged(name: str, digits: str) -> Path:
    return STAGED / digits[:DIGITS] / name


def publish(name: str, directory: Path, published: Path) -> None:
    """Let a whole directory take the place of what is published under that name; both on one disk."""
    for unwanted in _unwanted(directory):
        shutil.rmtree(unwanted) if unwanted.is_dir() else unwanted.unlink()
    if (directory / SERIES_FILE).exists():
        series_file.drop_gaps(directory)
    target, old = published / name, directory.with_name(f"{name}.old")
    published.mkdir(parents=True, exist_ok=True)
    if target.exists():
        shutil.rmtree(old, ignore_errors=True)  # of an earlier attempt
        target.rename(old)
    directory.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def _unwanted(directory: Path) -> Iterator[Path]:
    """What is not published: locks, gaps of a series, answers and scenes that are large."""
    yield from directory.glob("**/*.lock")
    large = [path for path in directory.glob("scenes/*.npz") if path.stat().st_size > KEPT_SCENE_KB * 1000]
    yield from large
    for folder in (directory / "answers", directory / "scenes"):
        sizes = [path.stat().st_size for path in folder.glob("*") if path not in large]
        if sum(sizes) > KEPT_MIB * 2**20:
            yield folder
