"""The rows that a run lacks: gated measurements that its suite.toml plans and that were never made."""

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from harness.planning.plan import expand
from harness.planning.suite import read_written
from harness.planning.tolerance_search import by_solver, next_tolerance, still_needed
from harness.results.records import Row

from .findings import Finding
from .judge import LIMIT_MM, Judgement


def never_measured(judged: Collection[str], rows: Sequence[Row], directory: Path) -> Iterator[Finding]:
    """The gated measurements still needed, of a search the next one; suite.toml itself if it is missing.

    judged : the keys of the rows that the gate judges. rows : all rows of the run.
    """
    path = directory / "suite.toml"
    if not path.is_file():
        why = "is missing, so that nobody knows which rows there should be: run again"
        yield Finding(path.name, Judgement("cannot_be_judged"), LIMIT_MM, why)
        return
    plan = [m for m in expand(read_written(path)) if m.entry.gated and m.iteration_limit is None]
    missing, of_solver = [m for m in plan if m.key not in judged], by_solver(rows)
    due = [m for m in missing if not (m.searched and m.repeat and next_tolerance(m, of_solver[m.solver]))]
    needed = {m.key: m for place in due if (m := still_needed(place, of_solver[place.solver]))}
    for key, m in needed.items():
        yield Finding(key, Judgement("no_answer"), m.suite.limit_mm, "never measured: the run did not end")
