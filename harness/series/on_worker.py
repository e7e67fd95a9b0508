"""Cases of a series, solved on a worker of a scheduler."""

from __future__ import annotations

from collections.abc import Sequence

from .isolated import solve_isolated
from .session import Job, Result, SeriesSession

_sessions: dict[str, SeriesSession] = {}


def solve_on_worker(task: tuple[Job, Sequence[int]]) -> list[Result]:
    """Cases of a job, in the session that this process keeps for it: each worker opens the assembly once."""
    job, numbers = task
    if job.plugin:
        return [result for some in solve_isolated(job, numbers) for result in some]
    if job.key not in _sessions:
        _sessions.clear()
        _sessions[job.key] = SeriesSession(job)
    session = _sessions[job.key]
    session.job = job  # holds these cases
    return [result for block in session.solve(numbers) for result in block]
