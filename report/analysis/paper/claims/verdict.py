"""A claim of the paper and the verdict that the rows give it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import pandas as pd

CONFIRMED, NOT_CONFIRMED = "confirmed", "not confirmed"
DEPENDS, NOT_DECIDED, NOT_MEASURED = "depends on", "not decided", "not measured"


@dataclass(frozen=True)
class Measured:
    """What the claims are judged from: the cells of the paper's problems, and the scaling scenes' lines."""

    cells: pd.DataFrame
    lines: pd.DataFrame


@dataclass(frozen=True)
class Verdict:
    """`verdict` begins with one of the five words above; `keys`: the rows it is based on."""

    verdict: str
    evidence: str = ""
    keys: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper in our words, its short name and place, and what counts as confirmed."""

    name: str
    where: str
    text: str
    rule: str
    judge: Callable[[Measured], Verdict]


@dataclass(frozen=True)
class Case:
    """Whether a claim holds in one case (None: undecided), the evidence and its rows. A case without a name
    is only evidence.
    """

    name: str
    holds: bool | None
    evidence: str = ""
    keys: Sequence[str] = ()


def by_case(on: str) -> Callable[[Callable[[Measured], Iterable[Case]]], Callable[[Measured], Verdict]]:
    """Turns a function that yields the cases of a claim into its `judge`. `on`: what distinguishes them."""

    def judging(cases_of: Callable[[Measured], Iterable[Case]]) -> Callable[[Measured], Verdict]:
        return lambda measured: decided(cases_of(measured), on)

    return judging


def decided(cases: Iterable[Case], on: str, evidence: str | None = None) -> Verdict:
    """One verdict from all cases; `evidence` replaces theirs."""
    found = list(cases)
    words = "; ".join(case.evidence for case in found if case.evidence) if evidence is None else evidence
    keys = sorted({key for case in found for key in case.keys})
    named = [case for case in found if case.name]
    known = [case for case in named if case.holds is not None]
    if not named:
        return Verdict(NOT_MEASURED)
    if not known:
        word = NOT_DECIDED
    elif all(case.holds for case in known):
        word = CONFIRMED
    elif not any(case.holds for case in known):
        word = NOT_CONFIRMED
    else:
        holds, fails = ("; ".join(c.name for c in known if c.holds is yes) for yes in (True, False))
        word = f"{DEPENDS} {on}: holds for {holds}; does not for {fails}"
    if known and len(known) < len(named):
        word += f" (not decided for {'; '.join(case.name for case in named if case.holds is None)})"
    return Verdict(word, words, keys)
