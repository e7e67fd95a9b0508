"""What the gate finds of one measurement."""

from __future__ import annotations

from dataclasses import dataclass

from .judge import Judgement


@dataclass(frozen=True)
class Finding:
    """One gated measurement, judged again. why : the reason if it has not passed.

    baseline_mm : its error in the baseline.
    """

    key: str
    judgement: Judgement
    limit_mm: float
    why: str = ""
    baseline_mm: float | None = None

    @property
    def passed(self) -> bool:
        return self.judgement.verdict == "within" and not self.why
