"""A series' cases on a worker of a scheduler."""

from __future__ import annotations

from collections.abc import Sequence

from .session import Desk, Job, Result

_open: dict[str, Desk] = {}


def solve_on_worker(task: tuple[Job, Sequence[int]]) -> list[Result]:
    """Cases of a job, on the desk that this process keeps for it: the assembly is opened once a worker."""
    job, numbers = task
    if job.key not in _open:
        _open.clear()
        _open[job.key] = Desk(job)
    desk = _open[job.key]
    desk.job = job  # with these cases
    return [result for some in desk.solve(numbers) for result in some]
