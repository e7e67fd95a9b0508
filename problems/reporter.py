"""Tells whoever waits for a command what it is doing."""

from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum


class Stage(StrEnum):
    """A stage of making the dense matrices; one that the cache holds is not made."""

    CONDENSATION = "condensing"
    SPRINGS = "springs between the parts"
    FACTORS = "Cholesky factors of K"
    CONDITION = "condition number"
    Q = "Q = AᵀK⁻¹A"


class Reporter:
    """Is told of steps, of their progress, and sentences for a person; this base class is silent."""

    def step(self, name: str) -> AbstractContextManager[None]:
        """A context around a step."""
        return nullcontext()

    def progress(self, text: str, fraction: float = 0.0) -> None:
        """Something is done within a step; fraction : how much of it is done, if that is known."""

    def building(self, stage: Stage, fraction: float = 0.0, part: str = "") -> None:
        """A stage begins or goes on, perhaps of one part."""
        self.progress(f"{stage} {part}".rstrip(), fraction)

    def say(self, sentence: str) -> None:
        """A person should read this sentence, given without its full stop."""


SILENT = Reporter()
