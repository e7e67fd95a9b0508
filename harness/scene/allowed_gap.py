"""Whether the remaining gap is larger than allowed, and where.

The gap y_j of contact j is known up to e_j (harness/verification/assess.py). It is larger than allowed
where y_j − e_j is, and not where y_j + e_j is not; between the two nothing can be said, nor of an allowed gap
below the largest e_j.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.terminal.exit_codes import DONE, GAP_EXCEEDED, NOTHING_JUDGED
from problems.errors import InputError
from problems.forms.assembly import Vector

SHOWN = 5  # contacts on the terminal


def refuse_unusable(allowed_mm: float | None) -> None:
    """Raise InputError unless it is a length, or None."""
    if allowed_mm is not None and not 0 <= allowed_mm < inf:
        raise InputError.one("--allow-gap", "gap, mm", allowed_mm, "must be 0 or larger, and finite")


def checked(
    allowed_mm: float, gap: Vector, uncertainty: Vector, pairs: list[dict[str, Any]]
) -> dict[str, Any]:
    """What is recorded of the check: `exceeded` is None where it cannot be told. `contacts` are those whose
    gap is larger, the largest first. gap, uncertainty : (m,) mm.
    """
    larger = np.flatnonzero(gap - uncertainty > allowed_mm)
    possible = np.flatnonzero(gap + uncertainty > allowed_mm)
    exceeded: bool | None = bool(len(larger))
    if allowed_mm < uncertainty.max(initial=0.0) or (not exceeded and len(possible)):
        exceeded = None
    spans = [(" – ".join(pair["pair"]), pair["start"], pair["stop"]) for pair in pairs]
    return {
        "allowed_mm": allowed_mm,
        "exceeded": exceeded,
        "uncertainty_mm": float(uncertainty.max(initial=0.0)),
        "largest_mm": float(gap.max(initial=0.0)),
        "share": len(larger) / len(gap) if len(gap) else 0.0,
        "contacts": larger[np.argsort(-gap[larger], kind="stable")].tolist(),
        "pairs": [name for name, start, stop in spans if ((start <= larger) & (larger < stop)).any()],
    }


def show(check: dict[str, Any], gap: Vector, nodes: Vector | None, console: Console) -> int:
    """Print the outcome with the largest gaps; returns the exit code."""
    allowed, contacts = check["allowed_mm"], check["contacts"]
    if check["exceeded"] is None:
        console.print(
            f"It cannot be told whether a gap is larger than {allowed:g} mm: the largest is "
            f"{check['largest_mm']:.3g} mm, and gaps are proven only to {check['uncertainty_mm']:.1e} mm.",
            style="yellow",
        )
        return NOTHING_JUDGED
    if not contacts:
        console.print(
            f"PASS: no gap is larger than {allowed:g} mm; the largest is {check['largest_mm']:.3g} mm.",
            style="green",
        )
        return DONE
    console.print(
        f"FAIL: the gap is larger than {allowed:g} mm at {len(contacts)} of {len(gap)} contacts, "
        f"{check['share']:.1%} of the junction, between {', '.join(check['pairs'])}.",
        style="red",
    )
    table = Table("contact", "x, mm", "y, mm", "gap, mm", title="The largest gaps")
    for k in contacts[:SHOWN]:
        place = ["–", "–"] if nodes is None else [f"{value:.4g}" for value in nodes[k]]
        table.add_row(str(k), *place, f"{gap[k]:.4g}")
    console.print(table)
    return GAP_EXCEEDED
