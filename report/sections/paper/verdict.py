"""A claim of the paper and the verdict that the rows give it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import pandas as pd

CONFIRMED, NOT_CONFIRMED = "confirmed", "not confirmed"
DEPENDS, NOT_DECIDED, NOT_MEASURED = "depends on", "not decided", "not measured"


@dataclass(frozen=True)
class Measured:
    """What claims are judged from: the cells of the paper's problems, and the lines of the scaling scenes."""

    cells: pd.DataFrame
    lines: pd.DataFrame


@dataclass(frozen=True)
class Verdict:
    """`verdict` begins with one of the five words above; `keys`: the rows it stands on."""

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


def decided(
    outcomes: Mapping[str, bool | None], on: str, evidence: str = "", keys: list[str] | None = None
) -> Verdict:
    """One verdict from whether the claim holds in each case; None: the rows do not decide that case.

    `on`: what tells the cases apart, for "depends on …".
    """
    known = {case: holds for case, holds in outcomes.items() if holds is not None}
    open_cases = [case for case in outcomes if case not in known]
    if not outcomes:
        return Verdict(NOT_MEASURED)
    if not known:
        word = NOT_DECIDED
    elif all(known.values()):
        word = CONFIRMED
    elif not any(known.values()):
        word = NOT_CONFIRMED
    else:
        holds = "; ".join(case for case, yes in known.items() if yes)
        fails = "; ".join(case for case, yes in known.items() if not yes)
        word = f"{DEPENDS} {on}: holds for {holds}; does not for {fails}"
    if known and open_cases:
        word += f" (not decided for {'; '.join(open_cases)})"
    return Verdict(word, evidence, sorted(set(keys or [])))
