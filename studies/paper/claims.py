"""The paper's claims in its order: its figure beside ours, and whether the claim holds here."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from .evidence import EVIDENCE
from .page import Page
from .rows import Study

#: Name, section, claim, the rule by which it holds in a case, and the paper's figure.
CLAIMS = Path(__file__).parent / "claims.csv"


def write(study: Study, page: Page) -> None:
    lines: list[dict[str, Any]] = []
    with CLAIMS.open(encoding="utf-8", newline="") as file:
        for number, claim in enumerate(csv.DictReader(file), start=1):
            cases = list(EVIDENCE[claim.pop("name")](study))
            here = "; ".join(f"{case}: {figures}" for case, _, figures in cases)
            lines.append({"": number, **claim, "here": here, "holds": holds(met for _, met, _ in cases)})
    words = [line["holds"] for line in lines]
    kinds = Counter("in part" if " of " in word else word.split(",")[0] for word in words)
    page.text("## The paper's claims")
    about = (
        f"*Whether the paper's {len(lines)} claims hold here*: "
        + ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())
        + ". A claim is judged in each case that the rows have: a scene, a size, a form. Open: the times are "
        "too close, or a run was stopped."
    )
    page.table("claims", about, lines)


def holds(cases: Iterable[bool | None]) -> str:
    """'yes', 'no' or '2 of 3' cases, and how many are open; 'open' or 'not measured' if none is decided."""
    found = list(cases)
    known = [met for met in found if met is not None]
    if not known:
        return "open" if found else "not measured"
    word = "yes" if all(known) else f"{sum(known)} of {len(known)}" if any(known) else "no"
    return word + (f", {len(found) - len(known)} open" if len(known) < len(found) else "")
