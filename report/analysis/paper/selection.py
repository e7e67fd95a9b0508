"""The rows of the paper's methods, found by what was run (solver, form, options)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from report.document.blocks import records
from report.results.reader import Results

SUITE = "paper"
SCALING = "scaling/"  # scenes of one joint at several sizes; all others belong to the paper's problems

#: The options of `ipm` that are not given.
DEFAULTS: dict[str, Any] = {
    "start": "algorithm_5",
    "scheme": "algorithm_3",
    "preconditioner": "V",
    "ordering": "lexicographic",
    "cg_tolerance": 1e-3,
    "theta": 0.995,
    "sigma": 0.1,
}

#: The four methods that the paper's section 6 is about: name → solver, form, options.
METHODS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "IPM": ("ipm", "dual", {}),
    "IPM, open gaps last": ("ipm", "dual", {"ordering": "open_last"}),
    "GI dual": ("gi", "dual", {}),
    "GI primal": ("gi", "primal", {}),
}


def is_paper(results: Results) -> bool:
    return results.suite.get("name") == SUITE and not results.cells.empty


def asked(options: object) -> dict[str, Any]:
    """All options of the interior-point method, those not given by their default."""
    given = options if isinstance(options, Mapping) else {}
    return {key: given.get(key, default) for key, default in DEFAULTS.items()}


def cells_of_paper(results: Results) -> pd.DataFrame:
    """The cells of the plan: one per scene, solver, form and variant, with the tightest of several tolerances
    and the largest of several thread counts; always with `options` and `details`.
    """
    cells = results.cells[results.cells["status"] != "unsupported"]
    cells = cells.assign(options=_dicts(cells, "options"), details=_dicts(cells, "details"))
    ordered = cells.sort_values(["tolerance", "threads"], ascending=[True, False], kind="stable")
    single = ordered.drop_duplicates(["scene", "solver", "form", "variant"])
    return single.sort_values(["n", "active", "scene"], kind="stable").reset_index(drop=True)


def _dicts(cells: pd.DataFrame, name: str) -> pd.Series[Any]:
    """A column of dictionaries, empty if there is none."""
    column = cells[name] if name in cells else [None] * len(cells)
    found = [value if isinstance(value, dict) else {} for value in column]
    return pd.Series(found, index=cells.index, dtype=object)


def ipm(cells: pd.DataFrame, **changed: Any) -> pd.DataFrame:
    """The interior-point cells whose options are the defaults except for `changed`, one per scene."""
    wanted = DEFAULTS | changed
    chosen = [
        s == "ipm" and asked(o) == wanted for s, o in zip(cells["solver"], cells["options"], strict=True)
    ]
    return cells[np.array(chosen, dtype=bool)].drop_duplicates("scene")


def of_method(cells: pd.DataFrame, name: str) -> pd.DataFrame:
    """The cells of one of METHODS, one per scene."""
    solver, form, options = METHODS[name]
    if solver == "ipm":
        return ipm(cells, **options)
    return cells[(cells["solver"] == solver) & (cells["form"] == form)].drop_duplicates("scene")


def of_scaling(cells: pd.DataFrame) -> pd.DataFrame:
    return cells[cells["scene"].str.startswith(SCALING)]


def of_problems(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells of the paper's three problems."""
    return cells[~cells["scene"].str.startswith(SCALING)]


def figures_of(cell: Mapping[str, Any] | None, name: str) -> dict[str, Any]:
    """A dictionary within the details of a cell; empty if there is none."""
    found = cell["details"].get(name) if cell is not None else None
    return found if isinstance(found, dict) else {}


def first(cells: pd.DataFrame) -> dict[str, Any] | None:
    """The first cell as a dictionary."""
    return records(cells[:1])[0] if len(cells) else None
