"""Checks a solver in a process of its own, so that to hang, to crash or to eat memory is a finding, too."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from harness.measurement.child_process import Events
from harness.measurement.monitored_call import Monitored
from harness.measurement.solver_descriptions import IMPORT_S, refuse_unimportable
from harness.terminal import DONE, FAILED
from harness.terminal.console import ConsoleReporter
from problems.reporter import SILENT, Reporter
from report.document.numbers import counted
from solvers.base import Form, Solver
from solvers.registry import make_solver

from .check import Finding, findings, first_of_each

LONGEST_TEXT = 1000  # characters of a finding
FIX = "Return from solve, within the limits of a measurement; end no process"


def check(
    name: str,
    plugin: Path | None,
    time_limit_s: float,
    memory_limit_mib: int,
    reporter: Reporter = SILENT,
) -> list[Finding]:
    """All that is wrong with a solver by name, or with a plug-in.

    time_limit_s : for each problem in each form. Raises InputError if the solver cannot be imported or made.
    """
    faults, form, problem = [], "", "importing"
    phases = {"importing": IMPORT_S, "the test": time_limit_s}
    monitored = Monitored(check_here, (name, plugin), 1, phases, memory_limit_mib)
    with reporter.step(name), monitored as process:
        for event in process:
            form, problem = event.get("form", form), event.get("problem", problem)
            if "finding" in event:
                faults.append(Finding(**event["finding"]))
            reporter.progress(f"{form} {problem}".lstrip())
        if not form:
            refuse_unimportable(event, process, plugin or "solvers", name)
    if "status" in event:
        faults.append(Finding(form, problem, event["message"][:LONGEST_TEXT], FIX))
    return first_of_each(faults)


def check_here(job: tuple[str, Path | None], events: Events) -> None:
    """Check the solver, in the process of its own."""
    name, plugin = job

    def factory() -> Solver:
        made = make_solver(name, {}, plugin)
        events.end_fork()
        return made

    def begin(form: Form, problem: str) -> None:
        events.report(phase="the test", form=form, problem=problem)

    for finding in findings(factory, begin=begin):
        events.report(finding={name: text[:LONGEST_TEXT] for name, text in asdict(finding).items()})


def run(
    names: Sequence[str], plugin: Path | None, time_limit_s: float, memory_limit_mib: int, console: Console
) -> int:
    """Check one solver after another, and print the faults. Returns 0 if there are none, else 1."""
    code = DONE
    for name in names:
        faults = check(name, plugin, time_limit_s, memory_limit_mib, ConsoleReporter(console))
        number = counted(len(faults), "fault") if faults else "no faults"
        console.print(f"{name}: {number}", style="red" if faults else "green")
        for finding in faults:
            console.print(f"  {finding}", highlight=False, markup=False)
            code = FAILED
    return code
