"""The paper's claims, each with a verdict computed from the rows."""

from __future__ import annotations

from collections import Counter

import pandas as pd

from report.analysis.paper.claims import CLAIMS
from report.analysis.paper.claims.verdict import (
    CONFIRMED,
    DEPENDS,
    NOT_CONFIRMED,
    NOT_DECIDED,
    NOT_MEASURED,
    Claim,
    Measured,
    Verdict,
)
from report.analysis.paper.growth import measured
from report.analysis.paper.selection import cells_of_paper, is_paper, of_problems
from report.document.blocks import Block, Column, Place, Section, Table, Text, word
from report.document.numbers import counted
from report.results.reader import Results

PLACE = Place(210)

SHOWN_KEYS = 2
WORDS = (CONFIRMED, DEPENDS, NOT_CONFIRMED, NOT_DECIDED, NOT_MEASURED)
COUNTED_AS = {DEPENDS: "confirmed in part"}


def section(results: Results) -> Section | None:
    if not is_paper(results):
        return None
    found = verdicts(results)
    counts = Counter(word_of(verdict) for _, verdict in found)
    summary = ", ".join(f"{counts[w]} {COUNTED_AS.get(w, w)}" for w in WORDS if counts[w])
    blocks: list[Block] = [Text(f"{counted(len(found), 'claim')}: {summary}."), _table(found)]
    items = [_item(number, *pair) for number, pair in enumerate(found, start=1)]
    return Section("The paper's claims", [*blocks, Text("\n".join(items))])


def verdicts(results: Results) -> list[tuple[Claim, Verdict]]:
    known = known_from(results)
    return [(claim, claim.judge(known)) for claim in CLAIMS]


def known_from(results: Results) -> Measured:
    """What the claims are judged from."""
    return Measured(of_problems(cells_of_paper(results)), measured(results))


def word_of(verdict: Verdict) -> str:
    """Which of the five words the verdict is."""
    return next(word for word in WORDS if verdict.verdict.startswith(word))


def _table(found: list[tuple[Claim, Verdict]]) -> Table:
    lines = [
        {
            "number": number,
            "name": claim.name,
            "section": claim.where,
            "claim": claim.text,
            "short": verdict.verdict.partition(":")[0],
            "verdict": verdict.verdict,
            "rule": claim.rule,
            "evidence": verdict.evidence,
            "rows": "; ".join(verdict.keys),
        }
        for number, (claim, verdict) in enumerate(found, start=1)
    ]
    columns = [
        Column("", lambda row: str(row["number"])),
        word("section", "section"),
        word("claim", "claim"),
        Column("verdict", lambda row: f"**{row['short']}**", "left"),
    ]
    caption = (
        "*What sections 5 to 7 of the paper claim, in our words, and whether the rows confirm it.* Every "
        "verdict is computed from the rows by a rule; the rules and the evidence follow, and the file has "
        "the keys of all rows that a verdict is based on."
    )
    return Table("paper-claims", caption, pd.DataFrame(lines), columns)


def _item(number: int, claim: Claim, verdict: Verdict) -> str:
    """The claim in full: a numbered item with its verdict, rule, evidence and first rows."""
    keys = "; ".join(f"`{key}`" for key in verdict.keys[:SHOWN_KEYS])
    more = f" and {len(verdict.keys) - SHOWN_KEYS} more" if len(verdict.keys) > SHOWN_KEYS else ""
    evidence = f" *Evidence:* {verdict.evidence}." if verdict.evidence else ""
    rows = f" *Rows:* {keys}{more}." if keys else ""
    return f"{number}. **{verdict.verdict}** – {claim.text} *What counts:* {claim.rule}{evidence}{rows}"
