"""`check` in a process of its own: a solver that hangs, ends its process or eats memory is a finding too."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from harness.measurement.child import await_end, receive
from harness.measurement.describe import IMPORT_S
from harness.measurement.limited import POLL_S, Limited
from harness.results.records import Row
from harness.solving.answers import error_text
from harness.terminal.exit_codes import DONE, FAILED
from harness.terminal.waiting import waiting
from problems.errors import Fault, InputError
from solvers.base import Solver
from solvers.registry import make_solver

from .check import findings, first_of_each
from .inspection import Finding

LONGEST_TEXT = 1000  # characters of a finding
FIX = "Return from solve, within the limits of a measurement; end no process"


class Check(Limited):
    """A running check of one solver. test : the form and the problem that it is solving."""

    def __init__(self, name: str, plugin: Path | None, time_limit_s: float, memory_limit_mib: int) -> None:
        self.findings: list[Finding] = []
        self.test = ""
        job = {"solver": name, "plugin": str(plugin) if plugin else None}
        phases = {"importing": IMPORT_S, "the test": time_limit_s}
        super().__init__("harness.conformance.isolated", job, 1, phases, memory_limit_mib)

    def take(self, event: Row) -> None:
        self.test = event.pop("test", self.test)
        if found := event.pop("finding", None):
            self.findings.append(Finding(**found))
        super().take(event)


def check(
    name: str,
    plugin: Path | None,
    time_limit_s: float,
    memory_limit_mib: int,
    doing: Callable[[str], None] = lambda test: None,
) -> list[Finding]:
    """All that is wrong with a solver by name, or with a plug-in.

    time_limit_s : for each problem in each form. doing : called with the current one, again and again.
    Raises InputError if the solver cannot be imported or made.
    """
    with Check(name, plugin, time_limit_s, memory_limit_mib) as running:
        while not running.over():
            running.listen(POLL_S)
            doing(f"{name}: {running.test or 'importing'}")
        end = running.outcome()
    if end["status"] == "refused":
        raise InputError([Fault(**fault) for fault in end["faults"]])
    if end["status"] != "checked":
        if not running.test:
            last = (end["stderr"] or "").splitlines()[-1:]
            why = " ".join([f"importing it: {end['message']}", *last])
            raise InputError.one(plugin or "solvers", "solver", name, why)
        form, _, problem = running.test.partition(", ")
        running.findings.append(Finding(form, problem, end["message"], FIX))
    return first_of_each(running.findings)


def run(
    names: Sequence[str], plugin: Path | None, time_limit_s: float, memory_limit_mib: int, console: Console
) -> int:
    """Check one solver after another, and print what is found. Returns 0 if nothing is wrong, else 1."""
    faulty = False
    for name in names:
        with waiting(console) as show:
            found = check(name, plugin, time_limit_s, memory_limit_mib, show)
        faulty |= bool(found)
        console.print(f"{name}: {len(found) or 'no'} faults", style="red" if found else "green")
        for finding in found:
            console.print(f"  {finding}", highlight=False, markup=False)
    return FAILED if faulty else DONE


def main() -> None:
    job, events = receive()
    plugin = Path(job["plugin"]) if job["plugin"] else None

    def factory() -> Solver:
        made = make_solver(job["solver"], {}, plugin)
        events.end_fork()
        return made

    try:
        factory()
    except InputError as error:
        events.report(status="refused", faults=[asdict(fault) for fault in error.faults])
        await_end()
    except BaseException:  # a finding of its own below
        pass

    def begin(test: str) -> None:
        events.report(phase="the test", test=test)

    try:
        for finding in findings(factory, begin=begin):
            events.report(finding={name: text[:LONGEST_TEXT] for name, text in asdict(finding).items()})
        end = {"status": "checked"}
    except BaseException as error:
        end = {"status": "failed", "message": f"raised {error_text(error)}"[:LONGEST_TEXT]}
    events.report(**end)
    await_end()


if __name__ == "__main__":
    main()
