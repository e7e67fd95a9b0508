"""Where load cases come from, by the options that `series` and `place` share: random or measured gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from problems.errors import Fault
from problems.forms import Form
from problems.load_cases import LoadCases
from problems.load_cases.measured_gaps import measured_gaps
from problems.load_cases.random_gaps import random_gaps
from problems.model.scene import Scene

RANDOM = 100  # cases, if no number is given


@dataclass(frozen=True)
class GivenCases:
    """What was given of --cases, --seed, --mean, --sd, --correlation-length, --around and --gaps."""

    count: int | None
    seed: int | None
    mean: float | None
    sd: float | None
    correlation_length: float | None
    around: Path | None
    gaps: Path | None

    @property
    def drawn(self) -> list[str]:
        """The options that are of random gaps alone."""
        names = ("seed", "mean", "sd", "correlation_length", "around")
        return [f"--{name.replace('_', '-')}" for name in names if getattr(self, name) is not None]

    def faults(self, sweep: Sequence[str] = ()) -> list[Fault]:
        """Of cases from more than one source."""
        sources = ["--gaps"] * bool(self.gaps), ["--sweep"] * bool(sweep), self.drawn
        if sum(map(bool, sources)) < 2:
            return []
        allowed = "random gaps, --gaps or --sweep" if sweep else "random gaps or --gaps"
        return [Fault("cases", "given", " ".join(chain(*sources)), allowed)]

    def of(self, scene: Scene, form: Form) -> LoadCases:
        """Raises InputError as these do."""
        if self.gaps:
            return measured_gaps(scene, self.gaps, self.count, form)
        law = self.mean, self.sd, self.correlation_length
        return random_gaps(scene, self.count or RANDOM, self.seed or 0, *law, form, self.around)
