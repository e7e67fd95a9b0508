"""What the directory of a series of load cases holds.

The gaps stay on disk, so that memory grows with the number of cases only by a few figures per case.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.results.schema import CASES, GAPS
from report.document.escape import quoted

Array = NDArray[np.float64]

FIGURES = (
    *("max_gap_mm", "mean_gap_mm", "gap_error_mm", "bound_mm", "displacement_error_mm"),
    *("setup_s", "solve_s", "form_s"),
)


@dataclass(frozen=True)
class Series:
    """A series. cases : those with an answer, in order; gaps : (cases, m), mm, on disk; code : the `commit`
    of each case, and whether it was `clean`.
    """

    facts: dict[str, Any]
    counts: dict[str, int]
    cases: pd.DataFrame
    gaps: NDArray[np.float32]
    nodes: Array | None
    fasteners: Array
    swept: list[str]
    code: pd.DataFrame


def read(directory: Path) -> Series:
    """Raises FileNotFoundError if the directory has no series."""
    facts = quoted(json.loads((directory / "series.json").read_text("utf-8")))
    count = facts["cases"]  # of this series; an earlier, longer one may have left rows of others
    rows: dict[int, tuple[Any, ...] | None] = {}
    verdicts: dict[int, str] = {}
    swept: list[str] = []
    code: dict[int, tuple[str, bool | None]] = {}
    for row in _rows(directory / CASES):  # of equal cases the last
        case = row["case"]
        if case >= count:
            continue
        verdicts[case], rows[case] = row["verdict"], None
        code[case] = row.get("commit") or "", row.get("clean")
        if row.get("max_gap_mm") is not None:
            swept = swept or [key for key in row if "." in key]
            rows[case] = (case, *(row.get(name) for name in FIGURES), *(row[key] for key in swept))
    kept = [row for row in rows.values() if row]
    swept = quoted(swept)
    cases = pd.DataFrame(kept, columns=["case", *FIGURES, *swept], dtype=float)
    cases = cases.astype({"case": int}).sort_values("case").reset_index(drop=True)
    with np.load(directory / "contacts.npz") as arrays:
        m = int(arrays["m"])
        nodes = arrays.get("contact_nodes")
        fasteners = arrays.get("fasteners", np.zeros((0, 2)))
    path = directory / GAPS
    stored = path.stat().st_size // (4 * m) if path.exists() else 0
    gaps = np.memmap(path, np.float32, "r", shape=(stored, m)) if stored else np.zeros((0, m), np.float32)
    made = pd.DataFrame(quoted(list(map(list, code.values()))), columns=["commit", "clean"])
    return Series(facts, quoted(Counter(verdicts.values())), cases, gaps, nodes, fasteners, swept, made)


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    if not path.exists():
        return
    with path.open("rb") as file:
        for line in file:
            if line.endswith(b"\n"):
                yield json.loads(line)
