"""The forms, versions, code and faulty options of a suite's solvers; which rows of an earlier run still hold.

Libraries and plug-ins are asked in a process of their own: one that prints, crashes or hangs while it is
imported then does no harm, and the driver imports none. The project's own methods are asked here. A row holds
for the same scene, solver, code and accuracy.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from harness.planning.plan import Measurement
from harness.planning.suite import SolverEntry, Suite
from harness.planning.tolerance_search import OUT_OF_TIME
from harness.results import records
from harness.results.records import Row
from harness.results.row_validation import refuse_wrong_kinds
from harness.solving.solver_answer import shown
from problems.errors import Fault, InputError
from problems.forms import FORMS, default_form
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene
from problems.storage import ROOT, fingerprint
from solvers.base import Form, Solver
from solvers.plugin import plugin_files
from solvers.registry import make_solver, owner_of, solver_version

from .child_process import Events
from .environments import interpreter, refuse_other_copies
from .monitored_call import Monitored

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


def describe(suite: Suite, reporter: Reporter = SILENT) -> list[Description]:
    """A description of each of the suite's solver entries, as `described` gives them."""
    installed = [(e.name, e.options) for e in suite.solver if not e.requirements]
    here = iter(described(installed, suite.plugin, f"suite {suite.name}", reporter))
    return [_of_version(e, suite.plugin, reporter) if e.requirements else next(here) for e in suite.solver]


def _of_version(entry: SolverEntry, plugin: str | None, reporter: Reporter) -> Description:
    """A description in the entry's own environment; one that says so if it cannot be had there."""
    solver, requirements = (entry.name, entry.options), entry.requirements or []
    try:
        (found,) = described([solver], plugin, "--with", reporter, requirements)
    except InputError as error:
        return Description(entry.forms or list(FORMS), entry.version, code="", failure=str(error))
    return replace(found, version=entry.version)


def described(
    solvers: Sequence[tuple[str, dict[str, Any]]],
    plugin: str | Path | None,
    where: str,
    reporter: Reporter = SILENT,
    requirements: Sequence[str] = (),
) -> list[Description]:
    """A description of each solver, given by name and options. Raises InputError, all faults at once.

    where : what names them. requirements : what the environment has in other versions than this one.
    """
    if not requirements and all(owner_of(name) != "library" for name, _ in solvers):
        return found_here(solvers, None)
    name, job = "the solvers", (list(solvers), Path(plugin) if plugin else None, requirements)
    python = interpreter(requirements, reporter)
    limits = {"importing the solvers": IMPORT_S}
    monitored = Monitored(describe_here, job, 1, limits, IMPORT_MIB, python)
    with reporter.step("importing"), monitored as process:
        for event in process:
            name = event.get("name", name)
            reporter.progress(name)
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
    files = [file] if ROOT / "solvers" in file.parents else plugin_files(file)
    return fingerprint(files, within=["solvers"])


NEEDED = ("key", "scene", "status", "time_limit_s", "memory_limit_mib")


def resumed(directory: Path, plan: list[Measurement], solvers: Solvers, console: Console) -> list[Row]:
    """The valid rows of DIRECTORY; outdated ones are moved to a file of their own."""
    path = directory / records.MEASUREMENTS
    if records.remove_torn_line(path):
        console.print(f"{path}: the last line was torn, and is measured again", style="yellow")
    rows = records.read(path)
    refuse_wrong_kinds(path, rows, needed=NEEDED)
    planned = {m.key: m for m in plan}
    sources = {m.scene: m.source for m in plan}
    scene_keys = {name: read_scene(source).key for name, source in sources.items()}

    def is_old(row: Row) -> bool:
        m = planned.get(row["key"])
        return m is not None and outdated(row, m, solvers[m.solver, m.variant], scene_keys[m.scene])

    old = [row for row in rows if is_old(row)]
    if old:
        records.append(directory / records.OUTDATED, *(row | {"answer": None} for row in old))
        rows = [row for row in rows if row not in old]
        records.rewrite(path, rows)
        why = "the scene, the solver or the limits have changed since"
        console.print(f"{len(old)} rows are set aside in {records.OUTDATED}: {why}", style="yellow")
    return rows


def outdated(row: Row, m: Measurement, solver: Description, scene_key: str) -> bool:
    """Whether a row is of another scene, series, solver or accuracy, or hit a limit that is wider now."""
    law = m.series.model_dump(exclude={"cases"}) if m.series else {}
    now = (scene_key, solver.version, solver.code, m.suite.limit_mm, m.entry.gated, law)
    drawn = {key: value for key, value in (row.get("series") or {}).items() if key != "cases"}
    solved = (row.get(k) for k in ("scene_key", "solver_version", "solver_code"))
    before = (*solved, row.get("limit_asked_mm"), row.get("gated"), drawn)
    out_of_time = row["status"] in OUT_OF_TIME and row["time_limit_s"] < m.time_limit_s
    left_behind = m.suite.stop_at_times_fastest is not None and bool(row.get("stop"))
    out_of_memory = row["status"] == "memory_limit" and row["memory_limit_mib"] < m.suite.memory_limit_mib
    return now != before or (out_of_time and not left_behind) or out_of_memory
