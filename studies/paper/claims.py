"""The paper's claims in its order: its figure beside ours, and whether the claim holds here."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from report.document.blocks import Section

from . import systems_and_starts as one
from . import table3
from . import two_methods as two
from .rows import FORMS, METHODS, Evidence, Study, table

#: Name, section, claim, the rule by which it holds in a case, and the paper's figure.
CLAIMS = Path(__file__).parent / "claims.csv"

#: By the claim's name in claims.csv.
EVIDENCE: dict[str, Callable[[Study], Evidence]] = {
    "few CG iterations": one.cg_from_thousands_to_few,
    "few to the end": one.few_cg_to_the_end,
    "no preconditioner": one.faster_than("V = I", one.ORDERINGS[:1]),
    "U alone": one.u_needs_more_cg_than_v,
    "splitting": one.faster_than("splitting"),
    "iterative or direct": one.faster_than("direct Cholesky"),
    "row sums": one.no_correction,
    "corrections": one.few_corrections,
    "feasible start": one.only_algorithm_5_is_feasible,
    "Algorithms 4 and 5": one.algorithms_4_and_5_agree,
    "Algorithm 5 iterations": one.fewer_iterations,
    "start saves time": one.start_saves_time,
    "iterations below √m": two.iterations_below_root,
    "IPM working time": two.exponent_at_most(table3.PER_SYSTEM, 2.5, METHODS[:2]),
    "GI working time": two.exponent_at_most(table3.PER_PIVOT, 2.0, FORMS),
    "preparation": two.preparation_of_one_order,
    "inversion": two.gi_prepares_longer,
    "less memory": two.ipm_needs_less_memory,
    "memory grows": two.exponent_at_most(table3.MEMORY, 2.0, ("IPM", *FORMS)),
    "GI primal trend": two.trend("GI primal", 1),
    "GI dual trend": two.trend("GI dual", -1),
    "IPM spread": two.time_hardly_depends_on_contact,
    "half contact, primal": two.faster_at_half_contact("GI primal"),
    "half contact, dual": two.faster_at_half_contact("GI dual", once=True),
    "agreement": two.displacements_agree,
    "worst case": two.worst_case_below,
    "GI chosen well": two.gi_is_faster_if_well_chosen,
    "conclusion": two.ipm_suits_large_problems,
}


def section(study: Study) -> Section:
    lines: list[dict[str, Any]] = []
    with CLAIMS.open(encoding="utf-8", newline="") as file:
        for number, claim in enumerate(csv.DictReader(file), start=1):
            cases = list(EVIDENCE[claim.pop("name")](study))
            here = "; ".join(f"{case}: {figures}" for case, _, figures in cases)
            lines.append({"": number, **claim, "here": here, "holds": holds(met for _, met, _ in cases)})
    words = [line["holds"] for line in lines]
    kinds = Counter("in part" if " of " in word else word.split(",")[0] for word in words)
    about = (
        f"*Whether the paper's {len(lines)} claims hold here*: "
        + ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())
        + ". A claim is judged in each case that the rows have: a scene, a size, a form. Open: the times are "
        "too close, or a run was stopped."
    )
    return Section("The paper's claims", [table("claims", about, lines)])


def holds(cases: Iterable[bool | None]) -> str:
    """'yes', 'no' or '2 of 3' cases, and how many are open; 'open' or 'not measured' if none is decided."""
    outcomes = list(cases)
    decided = [met for met in outcomes if met is not None]
    if not decided:
        return "open" if outcomes else "not measured"
    word = "yes" if all(decided) else f"{sum(decided)} of {len(decided)}" if any(decided) else "no"
    return word + (f", {len(outcomes) - len(decided)} open" if len(decided) < len(outcomes) else "")
