"""The conjugate-gradient iterations of a solve, from the details of its row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .selection import asked, figures_of

#: The systems in the order of the tables: name → options.
SYSTEMS: dict[str, dict[str, Any]] = {
    "V = I": {"preconditioner": "none"},
    "U alone": {"preconditioner": "U"},
    "V = U + √D": {},
    "V = U + √D, open gaps last": {"ordering": "open_last"},
    "splitting": {"preconditioner": "splitting"},
    "direct Cholesky": {"preconditioner": "direct"},
}
SCHEMES = {"mehrotra": "textbook scheme", "algorithm_2": "Algorithm 2"}


@dataclass(frozen=True)
class Counts:
    """CG iterations by outer iteration; `cut`: the last CG solve was stopped before it converged."""

    predictor: list[int]
    corrector: list[int]
    cut: bool

    @property
    def total(self) -> int:
        return sum(self.predictor) + sum(self.corrector)

    @property
    def largest(self) -> int:
        return max([*self.predictor, *self.corrector], default=0)

    @property
    def late(self) -> int:
        """The largest count in the second half of the outer iterations."""
        half = len(self.predictor) // 2
        return max([*self.predictor[half:], *self.corrector[half:]], default=0)

    def text(self, kind: str, k: int) -> str:
        """The count of one outer iteration, with ≥ if it was stopped."""
        counts = getattr(self, kind)
        if k >= len(counts):
            return ""
        last = "corrector" if len(self.corrector) == len(self.predictor) else "predictor"
        stopped = self.cut and kind == last and k == len(counts) - 1
        return f"≥ {counts[k]}" if stopped else str(counts[k])


def counts(cell: Mapping[str, Any] | None) -> Counts | None:
    """None if the row has no counts because the run ended before it could report them."""
    found = figures_of(cell, "cg")
    if cell is None or not found.get("predictor"):
        return None
    return Counts(found["predictor"], found.get("corrector", []), cell["status"] == "iteration_limit")


def system_name(options: object) -> str:
    """How the Newton systems are solved: 'V = U + √D, open gaps last, CG to 1e-10, textbook scheme'."""
    given = asked(options)
    linear = {key: given[key] for key in ("preconditioner", "ordering")}
    names = {
        tuple(({"preconditioner": "V", "ordering": "lexicographic"} | of).values()): name
        for name, of in SYSTEMS.items()
    }
    words = [names.get(tuple(linear.values()), " ".join(map(str, linear.values())))]
    if given["cg_tolerance"] != 1e-3 and given["preconditioner"] != "direct":
        words.append(f"CG to {given['cg_tolerance']:g}".replace("e-0", "e-"))
    if given["scheme"] != "algorithm_3":
        words.append(SCHEMES.get(given["scheme"], given["scheme"]))
    return ", ".join(words)
