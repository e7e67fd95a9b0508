"""The rows of the suite `paper`, found by what was run – solver, form, options –, whatever its name."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd

from report.analysis.standings import TIE, seconds_text
from report.document.blocks import Column, Table
from report.document.numbers import as_number, significant
from report.results.reader import Results

Row = dict[str, Any]
ByScene = dict[str, Row]

SCALING = "scaling/"  # scenes of one joint at several sizes; all others are of the paper's problems

#: Options of `ipm` that are not given.
DEFAULTS: dict[str, Any] = {
    "start": "algorithm_5",
    "scheme": "algorithm_3",
    "preconditioner": "V",
    "ordering": "lexicographic",
    "cg_tolerance": 1e-3,
    "theta": 0.995,
    "sigma": 0.1,
}
OPEN_LAST = {"ordering": "open_last"}
#: The methods that section 6 compares; the second of them the paper does not have.
METHODS = ("IPM", "IPM, open gaps last", "GI dual", "GI primal")
FORMS = METHODS[2:]
BETTER = "the better GI"  # of both forms, on each scene
#: The ways to solve the Newton systems: options of `ipm`.
SYSTEMS: dict[str, dict[str, Any]] = {
    "V = I": {"preconditioner": "none"},
    "U alone": {"preconditioner": "U"},
    "V = U + √D": {},
    "V = U + √D, open gaps last": OPEN_LAST,
    "splitting": {"preconditioner": "splitting"},
    "direct Cholesky": {"preconditioner": "direct"},
}


@dataclass(frozen=True)
class Study:
    """`rows`: one per scene and setting of the paper's problems, by n and active contacts, with the tightest
    of several tolerances; `scaling`: those of the scaling scenes; `problems`: a record per scene.

    Each row has the columns of the report's cells, None where missing; of the seconds per load case,
    `at_least` (None if nothing is known), `cut` if that is a lower bound, and `shown`, the same as text;
    `asked`, all options of `ipm`; `method`, one of METHODS, "" for other variants of `ipm`, else as reports
    call it.
    """

    rows: list[Row]
    scaling: list[Row]
    problems: list[Row]

    def ipm(self, **changed: Any) -> ByScene:
        """The rows of `ipm` whose options are DEFAULTS except for `changed`."""
        return {r["scene"]: r for r in self.rows if r["solver"] == "ipm" and r["asked"] == DEFAULTS | changed}

    def of(self, method: str, n: int | None = None) -> ByScene:
        """The rows of one of METHODS, or of BETTER."""
        if method == BETTER:
            rows = [r for name in FORMS for r in self.of(name, n).values()]
            rows.sort(key=lambda r: (r["at_least"] is None, r["at_least"] or 0.0, r["cut"]), reverse=True)
            return {r["scene"]: r for r in rows}  # the last one stays
        return {r["scene"]: r for r in self.rows if r["method"] == method and n in (None, r["n"])}

    @property
    def sizes(self) -> list[int]:
        """The sizes with at least two scenes of METHODS."""
        scenes = {(r["n"], r["scene"]) for r in self.rows if r["method"] in METHODS}
        return sorted({int(n) for n, _ in scenes if sum(n == other for other, _ in scenes) > 1})


def timed(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells with `at_least`: seconds per load case if the answer is within the limit; for a run ended by the
    time limit or an iteration limit, the time it had taken by then; else missing. `cut` : whether it is only
    that lower bound.
    """
    within = cells["verdict"] == "within"
    late = (cells["status"] == "time_limit") & ~within
    spent = (cells["status"] == "iteration_limit") & ~within
    at_least = cells["load_case_s"].where(within | spent, cells["time_limit_s"].where(late))
    return cells.assign(at_least=at_least, cut=(late | spent) & at_least.notna())


def study_of(results: Results) -> Study:
    """Raises ValueError if several machines made the rows."""
    if results.rows["machine"].nunique() > 1:
        raise ValueError(f"{results.directory}: times of several machines cannot be compared")
    cells = timed(results.cells[results.cells["status"] != "unsupported"])
    cells = cells.sort_values(["tolerance", "threads_asked"], ascending=[True, False], kind="stable")
    rows: dict[tuple[str, ...], Row] = {}
    for row in _records(cells.sort_values(["n", "active", "scene"], kind="stable")):
        row |= {name: row.get(name) or {} for name in ("options", "details")}
        row["asked"] = {key: row["options"].get(key, default) for key, default in DEFAULTS.items()}
        row |= {"method": _method(row), "shown": seconds_text(row)}
        setting = json.dumps(row["asked"]) if row["solver"] == "ipm" else row["variant"]
        rows.setdefault((row["scene"], row["solver"], row["form"], setting), row)
    scaling = [row for row in rows.values() if row["scene"].startswith(SCALING)]
    others = [row for row in rows.values() if not row["scene"].startswith(SCALING)]
    return Study(others, scaling, _records(results.problems))


def _records(frame: pd.DataFrame) -> list[Row]:
    rows = frame.astype(object).to_dict("records")
    return [{str(key): None if value != value else value for key, value in row.items()} for row in rows]


def _method(row: Row) -> str:
    if row["solver"] == "gi":
        return f"GI {row['form']}"
    if row["solver"] != "ipm":
        return str(row["method"])
    changed = {key: value for key, value in row["asked"].items() if value != DEFAULTS[key]}
    return "IPM" if not changed else METHODS[1] if changed == OPEN_LAST else ""


@dataclass(frozen=True)
class Counts:
    """CG iterations by outer iteration. `cut`: stopped before the last system was solved."""

    predictor: Sequence[int]
    corrector: Sequence[int]
    cut: bool = False

    @property
    def total(self) -> int:
        return sum(self.predictor) + sum(self.corrector)

    @property
    def largest(self) -> int:
        return max(*self.predictor, *self.corrector)

    @property
    def late(self) -> int:
        """The largest in the second half of the outer iterations."""
        half = len(self.predictor) // 2
        return max([*self.predictor[half:], *self.corrector[half:]])

    def __str__(self) -> str:
        return f"{'≥ ' * self.cut}{self.total}"


def counts(row: Mapping[str, Any] | None) -> Counts | None:
    """The CG iterations of a run; None if it ended before it could report them."""
    cg = row["details"].get("cg") if row else None
    if row is None or not cg or not cg["predictor"]:
        return None
    return Counts(cg["predictor"], cg.get("corrector", []), row["status"] == "iteration_limit")


LARGE = 1e5  # numbers from here on have a power of ten


def table(name: str, caption: str, lines: Sequence[Mapping[str, Any]], keys: int = 1) -> Table:
    """keys : the columns that a table repeats where it continues below."""
    frame = pd.DataFrame(lines, dtype=object)
    texts = {key: all(isinstance(cell, str) for cell in frame[key]) for key in lines[0]}
    columns = [Column(key, partial(_shown, key=key), "left" if texts[key] else "right") for key in lines[0]]
    return Table(name, caption, frame, columns, keys)


def _shown(line: Mapping[str, Any], key: str) -> str:
    cell = line[key]
    if isinstance(cell, str):
        return cell.replace("|", r"\|")
    number = as_number(cell)
    whole = number is not None and number.is_integer() and abs(number) < LARGE
    return f"{number:.0f}" if whole else significant(number)


#: For each case (a scene, a size, a form …) whether the claim holds there, None if the rows leave that open,
#: and the figures that decide it.
Evidence = Iterator[tuple[str, bool | None, str]]


def pairs(a: ByScene, b: ByScene) -> list[tuple[Row, Row]]:
    """Rows on the same scenes, both with a time or a lower bound of it."""
    pairs = [(a[scene], b[scene]) for scene in a if scene in b]
    return [(mine, other) for mine, other in pairs if mine["at_least"] and other["at_least"]]


def clearly_faster(a: Row, b: Row) -> bool | None:
    """Whether a is faster than b; None if they take about as long, or a lower bound leaves it open."""
    if TIE * a["at_least"] < b["at_least"]:
        return None if a["cut"] else True
    if TIE * b["at_least"] < a["at_least"]:
        return None if b["cut"] else False
    return None


def merged(rows: Iterable[Row], how: Callable[[list[float]], float]) -> Row:
    """The seconds of several rows as one."""
    rows = list(rows)
    return {"at_least": how([row["at_least"] for row in rows]), "cut": any(row["cut"] for row in rows)}


def against(mine: Row, other: Row) -> str:
    a, b = (f"{'> ' * row['cut']}{significant(row['at_least'])}" for row in (mine, other))
    return f"{a} against {b} s"
