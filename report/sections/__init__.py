"""The sections of the report in their order.

A section is a function from results with at least one row to tables and the charts of them, or to None if the
rows have nothing for it. SECTIONS names each function after the rows that it takes: "ladders" are rungs of
ladders, "drawn" are scenes drawn at random, "scenes" are all but ladders and more than 40 drawn scenes, "all"
are all rows.
"""

from collections.abc import Callable
from typing import Literal

from report.document.blocks import Section
from report.results.reader import Results

from . import (
    accuracy,
    all_measurements,
    history,
    ladders,
    outside,
    profile,
    random_scenes,
    series_throughput,
    sparse_problems,
    speed,
    summary,
    time_to_solution,
    trace,
    versions,
)

About = Literal["scenes", "ladders", "drawn", "all"]

SECTIONS: list[tuple[About, Callable[[Results], Section | None]]] = [
    ("ladders", ladders.section),
    ("ladders", ladders.rungs),
    ("drawn", random_scenes.section),
    ("drawn", sparse_problems.section),
    ("scenes", outside.section),
    ("scenes", time_to_solution.how_fast),
    ("scenes", summary.advice),
    ("scenes", summary.summary),
    ("scenes", profile.section),
    ("all", trace.section),
    ("all", versions.section),
    ("all", history.section),
    ("scenes", time_to_solution.section),
    ("scenes", speed.contacts),
    ("scenes", speed.machine),
    ("scenes", speed.scaling),
    ("scenes", speed.methods),
    ("all", series_throughput.section),
    ("scenes", accuracy.costs),
    ("scenes", accuracy.tolerances),
    ("scenes", all_measurements.section),
    ("all", all_measurements.machine),
]
