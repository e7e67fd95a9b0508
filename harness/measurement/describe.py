"""The forms, versions, code and faulty options of a suite's solvers.

Libraries and plug-ins are asked in a process of their own: one that prints, crashes or hangs while it is
imported then does no harm, and the driver imports none. The project's own methods are asked here.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from harness.planning.suite import SolverEntry, Suite
from harness.results.records import Row
from harness.solving.answers import shown
from problems.errors import Fault, InputError
from problems.forms.names import FORMS, default_form
from problems.storage.fingerprint import ROOT, fingerprint
from solvers.base import Form, Solver
from solvers.plugin import own_files
from solvers.registry import make_solver, owner_of, solver_version

from .child import Events
from .environments import interpreter, refuse_other_copies
from .monitored import Monitored

IMPORT_S = 60.0  # for the imports of all the solvers
IMPORT_MIB = 8192


@dataclass(frozen=True)
class Description:
    """What rows say of a solver: its forms, the version of its library, a hash of this project's code for it,
    and its owner (`solvers.registry.owner_of`).

    failure : why the version asked for cannot be used, "" if it can.
    """

    forms: list[Form]
    version: str
    code: str
    owner: str = "library"
    failure: str = ""

    @property
    def default_form(self) -> Form:
        return default_form(self.forms)


#: By name and label.
Solvers = dict[tuple[str, str], Description]


def describe(suite: Suite, doing: Callable[[str], None] = lambda text: None) -> list[Description]:
    """A description of each of the suite's solver entries, as `described` gives them."""
    installed = [(e.name, e.options) for e in suite.solver if not e.requirements]
    here = iter(described(installed, suite.plugin, f"suite {suite.name}", doing))
    return [_of_version(e, suite.plugin, doing) if e.requirements else next(here) for e in suite.solver]


def _of_version(entry: SolverEntry, plugin: str | None, doing: Callable[[str], None]) -> Description:
    """A description in the entry's own environment; one that says so if it cannot be had there."""
    solver, requirements = (entry.name, entry.options), entry.requirements or []
    try:
        (found,) = described([solver], plugin, "--with", doing, requirements)
    except InputError as error:
        return Description(entry.forms or list(FORMS), entry.version, code="", failure=str(error))
    return replace(found, version=entry.version)


def described(
    solvers: Sequence[tuple[str, dict[str, Any]]],
    plugin: str | Path | None,
    where: str,
    doing: Callable[[str], None] = lambda text: None,
    requirements: Sequence[str] = (),
) -> list[Description]:
    """A description of each solver, given by name and options. Raises InputError, all faults at once.

    where : what names them. doing : called with what is being imported, again and again.
    requirements : what the environment has in other versions than this one.
    """
    if not requirements and all(owner_of(name) != "library" for name, _ in solvers):
        return found_here(solvers, None)
    name, job = "the solvers", (list(solvers), Path(plugin) if plugin else None, requirements)
    python = interpreter(requirements, doing)
    limits = {"importing the solvers": IMPORT_S}
    with Monitored(describe_here, job, 1, limits, IMPORT_MIB, python) as process:
        for event in process:
            name = event.get("name", name)
            doing(f"importing {name}")
        refuse_unimportable(event, process, plugin or where, name)
    return [Description(**found) for found in event["found"]]


def refuse_unimportable(end: Row, process: Monitored, where: str | Path, name: str) -> None:
    """Raise InputError unless the process came to its end."""
    if faults := end.get("faults"):
        raise InputError([Fault(**fault) for fault in faults])
    if "status" in end:
        last = (process.stderr_text or "").splitlines()[-1:]
        raise InputError.one(where, "solver", name, " ".join([f"importing it: {end['message']}", *last]))


def describe_here(
    job: tuple[list[tuple[str, dict[str, Any]]], Path | None, Sequence[str]], events: Events
) -> Row:
    """The same, in the process of its own."""
    solvers, plugin, requirements = job
    found = found_here(solvers, plugin, lambda name: events.report(name=name))
    refuse_other_copies(requirements)
    return {"found": [asdict(each) for each in found]}


def found_here(
    solvers: Sequence[tuple[str, dict[str, Any]]],
    plugin: Path | None,
    begin: Callable[[str], None] = lambda name: None,
) -> list[Description]:
    """The descriptions, made in this process. Raises InputError, all faults at once."""
    found: list[Description] = []
    faults: list[Fault] = []
    for name, options in solvers:
        begin(name)
        try:
            solver = make_solver(name, options, plugin)
            forms = solver.forms
            if not isinstance(forms, tuple | list) or not forms or not all(form in FORMS for form in forms):
                raise InputError.one(
                    f"solver {name}", "forms", shown(forms), f"a tuple of {', '.join(FORMS)}"
                )
            version, code = solver_version(name, plugin), code_of(solver)
            found.append(Description(list(forms), version, code, owner_of(name)))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    return found


def code_of(solver: Solver) -> str:
    """The fingerprint of the code that can change a solver's answer or its time.

    This is its own file and what that imports from the package `solvers`, directly or indirectly; of a
    plug-in also what it imports of the user's own. The version of the library is a field of its own.
    """
    file = Path(inspect.getfile(type(solver)))
    files = [file] if ROOT / "solvers" in file.parents else own_files(file)
    return fingerprint(files, within=["solvers"])
