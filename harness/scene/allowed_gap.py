"""Whether remaining gaps are larger than allowed, and where: of an answer, or of all cases of a series.

When a gap is larger, and when that cannot be told, is decided in report/writers/allowed_gap.py.
"""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from harness.terminal import DONE, GAP_EXCEEDED, NOTHING_JUDGED
from problems.errors import InputError
from problems.forms.assembly import Vector


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
    from report.writers.allowed_gap import larger  # slow to import: not without --allow-gap

    exceeds, undecided = larger(allowed_mm, gap, uncertainty)
    contacts, worst = np.flatnonzero(exceeds), float(uncertainty.max(initial=0.0))
    untold = allowed_mm < worst or (not len(contacts) and undecided.any())
    spans = [(" – ".join(pair["pair"]), exceeds[pair["start"] : pair["stop"]]) for pair in pairs]
    return {
        "allowed_mm": allowed_mm,
        "exceeded": None if untold else bool(len(contacts)),
        "uncertainty_mm": worst,
        "largest_mm": float(gap.max(initial=0.0)),
        "share": len(contacts) / len(gap) if len(gap) else 0.0,
        "contacts": contacts[np.argsort(-gap[contacts], kind="stable")].tolist(),
        "pairs": [name for name, own in spans if own.any()],
    }


def show(check: dict[str, Any], gap: Vector, nodes: Vector | None, console: Console) -> int:
    """Print the outcome for an answer, with the place of its largest gap; returns the exit code."""
    allowed, largest, contacts = check["allowed_mm"], check["largest_mm"], check["contacts"]
    if check["exceeded"] is None:
        return _undecided("", allowed, check["uncertainty_mm"], console)
    if not contacts:
        return _passed(f"no gap is larger than {allowed:g} mm; the largest is {largest:.3g} mm", console)
    console.print(
        f"FAIL: the gap is larger than {allowed:g} mm at {len(contacts)} of {len(gap)} contacts, "
        f"{check['share']:.1%} of the junction, between {', '.join(check['pairs'])}; the largest is "
        f"{largest:.3g} mm, at {_place(contacts[0], nodes)}. All of them: exceeding.csv",
        style="red",
    )
    return GAP_EXCEEDED


def show_series(directory: Path, allowed_mm: float, console: Console) -> int:
    """Print the outcome for a series, write DIRECTORY/allowed-gap.csv and .png; returns the exit code."""
    from report.results.series import read
    from report.writers.allowed_gap import exceeding, write  # slow to import: not before the first row

    series = read(directory)
    found = exceeding(series, allowed_mm)
    written = write(directory, series, found)
    if found.undecided:
        where = f"In {found.undecided} of {found.answered} cases"
        code = _undecided(where, allowed_mm, found.uncertainty_mm, console)
    if len(found.cases):
        worst, share = found.cases.iloc[0], len(found.cases) / found.answered
        often = int(np.argmax(found.shares))
        console.print(
            f"FAIL: the gap is larger than {allowed_mm:g} mm in {len(found.cases)} of {found.answered} cases "
            f"({share:.1%}), at {np.count_nonzero(found.shares)} of {len(found.shares)} contacts, most often "
            f"({found.shares[often]:.1%}) at {_place(often, series.nodes)}; the largest is "
            f"{worst['max_gap_mm']:.3g} mm, in case {worst['case']:.0f}. Where: {written}",
            style="red",
        )
        return GAP_EXCEEDED
    if found.undecided:
        return code
    largest = series.cases["max_gap_mm"].max()
    said = f"in none of {found.answered} cases is a gap larger than {allowed_mm:g} mm; the largest is"
    return _passed(f"{said} {largest:.3g} mm", console)


def _place(contact: int, nodes: Vector | None) -> str:
    at = "" if nodes is None else f", ({nodes[contact, 0]:.4g}, {nodes[contact, 1]:.4g}) mm"
    return f"contact {contact}{at}"


def _passed(said: str, console: Console) -> int:
    console.print(f"PASS: {said}.", style="green")
    return DONE


def _undecided(where: str, allowed_mm: float, uncertainty_mm: float, console: Console) -> int:
    it = f"{where} it" if where else "It"
    console.print(
        f"{it} cannot be told whether a gap is larger than {allowed_mm:g} mm: gaps are proven only to "
        f"{uncertainty_mm:.1e} mm.",
        style="yellow",
    )
    return NOTHING_JUDGED
