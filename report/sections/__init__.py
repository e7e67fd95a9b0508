"""The sections of the report in their order.

A section is a function from results to tables and the charts of them, or None if the results have nothing
for it. To add one, write the function and name it here, after the results that it is given: those on the
rungs of ladders, on scenes drawn at random, on all other scenes, or all.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from report.document.blocks import Section
from report.results.reader import Results

from . import (
    accuracy,
    details,
    drawn,
    ladders,
    outside,
    roads,
    series,
    speed,
    summary,
    versions,
)

About = Literal["scenes", "ladders", "drawn", "all"]

SECTIONS: list[tuple[About, Callable[[Results], Section | None]]] = [
    ("ladders", ladders.section),
    ("ladders", ladders.rungs),
    ("drawn", drawn.section),
    ("scenes", outside.section),
    ("scenes", roads.how_fast),
    ("scenes", summary.advice),
    ("scenes", summary.summary),
    ("all", versions.section),
    ("scenes", roads.section),
    ("scenes", speed.contacts),
    ("scenes", speed.machine),
    ("scenes", speed.scaling),
    ("scenes", speed.methods),
    ("scenes", series.section),
    ("scenes", accuracy.costs),
    ("scenes", accuracy.tolerances),
    ("scenes", details.section),
    ("all", details.machine),
]
