"""Rows written by older versions of this program, read as today's: all that the report knows of them."""

from __future__ import annotations

from typing import Any

#: The in-house solvers there were when a row did not say whether its solver is one.
IN_HOUSE = ("ipm", "gi", "newton", "ipm-fast")
#: How the message began of a row without a measurement, when that was no status of its own.
NOT_RUN = "not run:"
RENAMED = {"together": "batched"}


def as_today(row: dict[str, Any]) -> dict[str, Any]:
    """The row with the fields and the vocabulary of `harness.results.schema`."""
    row = {RENAMED.get(name, name): value for name, value in row.items()}
    if "in_house" in row:
        return row
    if str(row.get("message") or "").startswith(NOT_RUN):
        row["status"] = "not_run"
    return row | {"in_house": row.get("solver") in IN_HOUSE}
