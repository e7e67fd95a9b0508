"""Two rows of one measurement side by side."""

from __future__ import annotations

from rich.table import Table

from harness.results.records import Row
from harness.results.schema import STEPS

TIMES = dict(zip(STEPS, ("convert", "prepare", "set-up", "solve", "form"), strict=True))
#: Heading, field and format.
FIELDS = [
    ("verdict", "verdict", ""),
    ("status", "status", ""),
    ("error, mm", "displacement_error_mm", ".2e"),
    ("error bound of the reference, mm", "reference_bound_mm", ".1e"),
    ("contacts open or closed by mistake", "contact_mismatch", ".0f"),
    ("iterations", "iterations", ".0f"),
    ("inner iterations", "inner_iterations", ".0f"),
    *((f"{words}, s", name, ".4g") for name, words in TIMES.items()),
    ("peak memory, MiB", "peak_rss_mib", ".0f"),
    ("threads in effect", "threads", ".0f"),
    ("BLAS", "kernels", ""),
    ("version of the solver", "solver_version", ""),
    ("code of the solver", "solver_code", ""),
    ("commit", "commit", ".12"),
    ("machine", "machine", ""),
]


def then_and_now(then: Row, now: Row) -> Table:
    """A table with a line per field that one of them has; what differs is yellow, a worse verdict red."""
    table = Table("", "then", "now", title=now["key"])
    for heading, name, spec in FIELDS:
        one, other = (_text(row.get(name), spec) for row in (then, now))
        if (one, other) != ("–", "–"):
            style = None if one == other else "red" if name == "verdict" else "yellow"
            table.add_row(heading, one, other, style=style)
    return table


def _text(value: object, spec: str) -> str:
    return "–" if value is None else format(value, spec)
