"""A series' cases on a worker of a scheduler."""

from __future__ import annotations

from collections.abc import Sequence

from .session import Job, Result, SeriesSession

_open: dict[str, SeriesSession] = {}


def solve_on_worker(task: tuple[Job, Sequence[int]]) -> list[Result]:
    """Cases of a job, in the session that this process keeps for it: each worker opens the assembly once."""
    job, numbers = task
    if job.key not in _open:
        _open.clear()
        _open[job.key] = SeriesSession(job)
    session = _open[job.key]
    session.job = job  # with these cases
    return [result for some in session.solve(numbers) for result in some]
