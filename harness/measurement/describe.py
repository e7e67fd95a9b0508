"""The forms, versions and faulty options of a suite's solvers, found in a separate process.

A library that prints or crashes while it is imported then does no harm, and the driver imports none.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from harness.planning.suite import Suite
from problems.errors import Fault, InputError
from problems.forms.names import default_form
from solvers.base import Form

from .solver_code import code_of


@dataclass(frozen=True)
class Description:
    """The forms that a solver takes, the version of its library, and a hash of this project's code for it."""

    forms: list[Form]
    version: str
    code: str
    in_house: bool = False

    @property
    def default_form(self) -> Form:
        return default_form(self.forms)


#: By name and variant.
Solvers = dict[tuple[str, str], Description]


def describe(suite: Suite) -> list[Description]:
    """A description of each of the suite's solver entries. Raises InputError, all faults at once."""
    from .process import environment

    question = json.dumps({"solvers": [[e.name, e.options] for e in suite.solver], "plugin": suite.plugin})
    done = subprocess.run(
        [sys.executable, "-P", "-m", "harness.measurement.describe"],
        input=question,
        capture_output=True,
        text=True,
        errors="replace",
        env=environment(1),
    )
    if done.returncode != 0:
        names = ", ".join(dict.fromkeys(entry.name for entry in suite.solver))
        last = (done.stderr.strip().splitlines() or [""])[-1]
        why = f"importing one of these ended with exit code {done.returncode} {last}".strip()
        raise InputError.one(suite.plugin or f"suite {suite.name}", "solver", names, why)
    reply = json.loads(done.stdout.splitlines()[-1])
    if reply["faults"]:
        raise InputError([Fault(**fault) for fault in reply["faults"]])
    return [Description(**found) for found in reply["found"]]


def main() -> None:
    from solvers.registry import in_house, make_solver, solver_version

    question = json.loads(sys.stdin.read())
    plugin = Path(question["plugin"]) if question["plugin"] else None
    found, faults = [], []
    for name, options in question["solvers"]:
        try:
            solver = make_solver(name, options, plugin)
            code = code_of(solver)
            found.append(
                asdict(Description(list(solver.forms), solver_version(name, plugin), code, in_house(name)))
            )
        except InputError as error:
            faults += [asdict(fault) for fault in error.faults]
    print()
    print(json.dumps({"found": found, "faults": faults}, default=repr))


if __name__ == "__main__":
    main()
