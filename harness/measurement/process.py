"""The driver's side of one measurement: a worker under the measurement's limits, and its part of the rows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from harness.planning.plan import Measurement
from harness.results.records import Row

from .limited import POLL_S, Limited

START_S = 300.0  # for the imports and opening the data
SAVE_S = 60.0  # for saving the answer

JOB = ("source", "solver", "options", "plugin", "form", "tolerance", "yardstick", "batched")
#: What a worker reports once for all the load cases of a series.
SHARED = ("load_s", "model_s", "convert_s", "prepare_s", "data_mib")


def measure(measurements: Sequence[Measurement], answers: Sequence[Path]) -> list[Row]:
    """Run measurements in one process: one, or load cases of a series. Each answer is saved.

    Returns the worker's part of each row: status, message, times, peak memory, … If a case ends the process,
    those that follow have its status.
    """
    with Worker(measurements, answers) as worker:
        while not worker.over():
            worker.listen(POLL_S)
        last = worker.outcome()
        ended = measurements[len(worker.finished)].key
        lost = {"status": last["status"], "message": f"not run: {ended} ended the process"}
        rows = [*worker.finished, last]
        return rows + [lost] * (len(measurements) - len(rows))


class Worker(Limited):
    """A running measurement."""

    def __init__(self, measurements: Sequence[Measurement], answers: Sequence[Path]) -> None:
        measurement = measurements[0]
        self.count = len(measurements)
        self.finished: list[Row] = []  # all but the last
        job = {
            "answers": list(map(str, answers)),
            "cases": [each.case for each in measurements],
            "series": measurement.series.model_dump() if measurement.series else None,
            **{name: getattr(measurement, name) for name in JOB},
        }
        solve_s = measurement.time_limit_s * (measurement.batched or 1)
        phases = {"start": START_S, "solve": solve_s, "save": SAVE_S}
        limit_mib = measurement.memory_limit_mib
        super().__init__("harness.measurement.worker", job, measurement.threads, phases, limit_mib)

    def take(self, event: Row) -> None:
        super().take(event)
        if "status" in event and not event.get("ended") and len(self.finished) < self.count - 1:
            self.finished.append({"stderr": None, **self.row})
            self.row = {name: self.row[name] for name in SHARED if name in self.row}
