"""Finds the sections: every file in `report/sections` and its folders is one."""

from __future__ import annotations

from importlib import import_module
from pkgutil import walk_packages
from typing import Protocol, cast

from report import sections as package
from report.document.blocks import Place, Section
from report.results.reader import Results


class SectionModule(Protocol):
    """A file of a section."""

    PLACE: Place

    def section(self, results: Results) -> Section | None:
        """None if the results have nothing for it."""


def sections() -> list[SectionModule]:
    """The sections in their order in the report."""
    found = walk_packages(package.__path__, f"{package.__name__}.")
    modules = [cast(SectionModule, import_module(file.name)) for file in found if not file.ispkg]
    return sorted(modules, key=lambda module: module.PLACE.number)
