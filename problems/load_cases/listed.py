"""Load cases that are given one by one."""

from __future__ import annotations

from dataclasses import dataclass

from problems.forms.assembly import LoadCase
from problems.storage.cache import digest

from .base import LoadCases


@dataclass(frozen=True)
class Listed(LoadCases):
    """Case k is cases[k]. Cases with the same forces should share the array f: K⁻¹f is then computed once."""

    cases: tuple[LoadCase, ...]

    @property
    def count(self) -> int:  # type: ignore[override]
        return len(self.cases)

    @property
    def key(self) -> str:
        return digest(*(array.tobytes() for case in self.cases for array in (case.f, case.g)))

    def load(self, k: int) -> LoadCase:
        return self.cases[k]
