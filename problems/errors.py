"""Errors that users can correct: each names the file, the key, the value and what is allowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One error in an input. where : file or argument. key : the entry in it. allowed : valid values."""

    where: str
    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        value = repr(self.value)
        value = value if len(value) <= 80 else value[:77] + "..."
        return f"{self.where}: {self.key} = {value}: {self.allowed}"


class InputError(ValueError):
    """All errors in an input, together."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = list(faults)
        super().__init__("\n".join(map(str, self.faults)))

    @classmethod
    def one(cls, where: object, key: str, value: object, allowed: str) -> InputError:
        return cls([Fault(str(where), key, value, allowed)])
