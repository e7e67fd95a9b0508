"""Reads a results directory into data frames.

`rows` has one row per measurement, `cells` one per scene, solver and settings (CELL of rows.py), with the
repeats merged.
"""

import re
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.results import records
from harness.results.schema import DRAWN, LADDERS, SPARSE
from report.document.escape import plain, quoted
from report.document.numbers import tidy_power
from report.results.rows import cells_of

from .rows import VERSION, frame

MOST_SHOWN = 40  # scenes drawn at random: more have a section of their own alone
FAR_AWAY = 1e15  # mm: no picture is so large
SECONDS = ["build_s", "reference_s", "sparse"]  # of a scene, and what has some of them
LOG = re.compile(r"logs/[\w.+-]+\.txt")


@dataclass(frozen=True, eq=False)
class Results:
    """One directory of results: `rows` and `cells` as above, the rest as read from its files.

    rounds : the rows of ours measured again beside others (suite.py, `beside`), which are not in `rows`.
    outdated : rows of other versions of a solver or of its adapter, set aside when it was measured anew.
    """

    directory: Path
    rows: pd.DataFrame
    cells: pd.DataFrame
    problems: pd.DataFrame
    suite: dict[str, Any] = field(default_factory=dict)
    machines: dict[str, dict[str, Any]] = field(default_factory=dict)
    left_out: int = 0  # rows of equal measurements, and of tolerances tried in a search for one
    rounds: pd.DataFrame = field(default_factory=lambda: frame([]))
    outdated: pd.DataFrame = field(default_factory=lambda: frame([]))
    one_of_several: bool = False  # whether other machines made the rest of the rows

    @property
    def title(self) -> str:
        """The suite's, or of a run on one scene that scene's."""
        scenes = self.rows["scene"].unique()
        if len(scenes) == 1 and "title" in self.problems:
            own = self.problems.loc[self.problems["scene"] == scenes[0], "title"].dropna()
            return f"{scenes[0]}: {own.iloc[-1]}" if len(own) and own.iloc[-1] else str(scenes[0])
        return str(self.suite.get("title") or "Results")

    @property
    def limit(self) -> str:
        """The accuracy required, as text: '1e-7 mm'."""
        limits = sorted(self.rows["limit_asked_mm"].dropna().unique())
        return " / ".join(tidy_power(limit) for limit in limits or [1e-7]) + " mm"

    def scene_arrays(self, scene: str) -> dict[str, NDArray[np.float64]] | None:
        """The arrays of a scene's file; empty if it is damaged, None without a file or contact nodes."""
        path = self.directory / "scenes" / (plain(scene).replace("/", "_") + ".npz")
        try:
            if not path.exists():
                return None
            arrays = records.read_arrays(path)
        except (OSError, ValueError):
            return {}
        if any(array.dtype.kind not in "fiu" for array in arrays.values()):
            return {}
        places = [arrays[name] for name in ("contact_nodes", "fasteners") if name in arrays]
        if not all((abs(each) < FAR_AWAY).all() for each in places):  # NaN, too
            return {}
        return arrays if arrays.get("contact_nodes", np.empty(0)).ndim == 2 else None

    def about(self, what: str) -> "Results":
        """The results on rungs of "ladders", on scenes "drawn" at random, on all "scenes" that are shown
        one by one, or "all"; only these have the runs that a trace stopped, "whole" has all others.
        """
        names, traced = self.rows["scene"].str, self.rows["iteration_limit"].notna()
        masks = {"ladders": names.startswith(LADDERS), "drawn": names.startswith((DRAWN, SPARSE))}
        masks = {name: rows & ~traced for name, rows in masks.items()} | {"whole": ~traced}
        many = masks["drawn"] & (self.rows.loc[masks["drawn"], "scene"].nunique() > MOST_SHOWN)
        others = ~(masks["ladders"] | many | traced)
        rows = self.rows if what == "all" else self.rows[masks.get(what, others)].reset_index(drop=True)
        return self if len(rows) == len(self.rows) else replace(self, rows=rows, cells=cells_of(rows))

    def by_machine(self) -> list["Results"]:
        """The results of each machine, so that no table or mean can mix two of them."""
        names = self.rows["machine"].unique()
        made_by = self.problems["machine"].dropna() if "machine" in self.problems else pd.Series(dtype=object)
        if len(names) == 0 or (len(names) == 1 and made_by.isin(names).all()):
            return [self]

        def part(name: str) -> "Results":
            rows, rounds, outdated = (
                table[table["machine"] == name].reset_index(drop=True)
                for table in (self.rows, self.rounds, self.outdated)
            )
            cells, problems = cells_of(rows), self._problems_of(name)
            own = replace(self, rows=rows, cells=cells, problems=problems, rounds=rounds, outdated=outdated)
            return replace(own, one_of_several=len(names) > 1)

        return [part(name) for name in names]

    def _problems_of(self, machine: str) -> pd.DataFrame:
        """The scenes that a machine made; those of others, or of an unknown one, without their seconds."""
        if "scene" not in self.problems:
            return self.problems
        scenes, made_by = self.problems["scene"], self.problems.reindex(columns=["machine"])["machine"]
        own = made_by == machine
        problems = self.problems[own | ~scenes.isin(scenes[own])]
        return problems.assign(**{name: problems[name].where(own) for name in SECONDS if name in problems})


def read(directory: Path) -> Results:
    """Read a directory, whose suite.toml is no damaged one. Raises FileNotFoundError if it has no
    measurements.jsonl, InputError naming a damaged file; its other files may be missing.
    """
    path = directory / records.MEASUREMENTS
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; a results directory holds measurements.jsonl")
    measured = quoted(records.read(path))
    problems = pd.DataFrame(quoted(records.read(directory / "problems.jsonl")))
    old = quoted(records.read(directory / records.OUTDATED))
    plan = directory / "suite.toml"
    suite = quoted(tomllib.loads(plan.read_text("utf-8-sig"))) if plan.is_file() else {}
    facts = [quoted(records.read_object(file)) for file in sorted(directory.glob("machine*.json"))]
    machines = {str(fact.get("machine", "")): fact for fact in facts}
    rows = frame(measured)
    logs = map(plain, rows["log"])
    rows = rows.assign(
        log=[log if LOG.fullmatch(log) and (directory / log).is_file() else "" for log in logs]
    )
    left_out, again = len(measured) - len(rows), rows["round"] != ""
    rows, rounds = (rows[of].reset_index(drop=True) for of in (~again, again))
    read = rows, cells_of(rows), problems, suite, machines, left_out
    return Results(directory, *read, rounds, frame(old, [*VERSION, "scene_key"]))
