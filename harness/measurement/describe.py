"""The forms, versions and faulty options of a suite's solvers, found in a separate process.

A library that prints, crashes or hangs while it is imported then does no harm, and the driver imports none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from harness.planning.suite import Suite
from harness.solving.answers import shown
from problems.errors import Fault, InputError
from problems.forms.names import FORMS, default_form
from solvers.base import Form

from .child import await_end, receive
from .limited import POLL_S, Limited
from .solver_code import code_of

IMPORT_S = 60.0  # for the imports of all the solvers
IMPORT_MIB = 8192


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


def describe(suite: Suite, doing: Callable[[str], None] = lambda text: None) -> list[Description]:
    """A description of each of the suite's solver entries, as `described` gives them."""
    entries = [(e.name, e.options) for e in suite.solver]
    return described(entries, suite.plugin, f"suite {suite.name}", doing)


def described(
    solvers: Sequence[tuple[str, dict[str, Any]]],
    plugin: str | Path | None,
    where: str,
    doing: Callable[[str], None] = lambda text: None,
) -> list[Description]:
    """A description of each solver, given by name and options. Raises InputError, all faults at once.

    where : what names them. doing : called with what is being imported, again and again.
    """
    job = {"solvers": list(solvers), "plugin": str(plugin) if plugin else None}
    phases = {"importing the solvers": IMPORT_S}
    with Limited("harness.measurement.describe", job, 1, phases, IMPORT_MIB) as child:
        while not child.over():
            child.listen(POLL_S)
            doing(f"importing {child.row.get('name', 'the solvers')}")
        reply = child.outcome()
    if reply["status"] != "described":
        last = (reply["stderr"] or "").splitlines()[-1:]
        why = " ".join([f"importing it: {reply['message']}", *last])
        raise InputError.one(plugin or where, "solver", reply.get("name"), why)
    if reply["faults"]:
        raise InputError([Fault(**fault) for fault in reply["faults"]])
    return [Description(**found) for found in reply["found"]]


def main() -> None:
    job, events = receive()
    from solvers.registry import in_house, make_solver, solver_version

    plugin = Path(job["plugin"]) if job["plugin"] else None
    found, faults = [], []
    for name, options in job["solvers"]:
        events.report(name=name)
        try:
            solver = make_solver(name, options, plugin)
            forms = solver.forms
            if not isinstance(forms, tuple | list) or not forms or not all(form in FORMS for form in forms):
                raise InputError.one(
                    f"solver {name}", "forms", shown(forms), f"a tuple of {', '.join(FORMS)}"
                )
            code = code_of(solver)
            found.append(asdict(Description(list(forms), solver_version(name, plugin), code, in_house(name))))
        except InputError as error:
            faults += [asdict(fault) for fault in error.faults]
    events.report(status="described", found=found, faults=faults)
    await_end()


if __name__ == "__main__":
    main()
