"""The forms, versions and code of a suite's solvers, and the rows of an earlier run that they still hold for.

Libraries and plug-ins are imported in a process of their own, so that one that prints, crashes or hangs does
no harm; the project's own methods are imported here. A row holds for the same scene, solver and accuracy.
"""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from harness.planning.plan import Measurement
from harness.planning.suite import SolverEntry, Suite
from harness.results import records
from harness.results.records import Row
from harness.results.row_validation import PROBLEM, valid_rows
from harness.solving.solver_answer import shown
from harness.solving.solver_session import OTHER_NAME, replaced
from harness.solving.solver_version import version_of
from harness.verification.reference_problem import PROBLEMS
from problems.errors import Fault, InputError, read_all
from problems.forms import FORMS
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene
from problems.storage import ROOT, fingerprint
from report.document.numbers import counted
from solvers.base import Form, Solver
from solvers.plugin import plugin_files
from solvers.registry import make_solver, owner_of

from .child_process import Events
from .environments import interpreter, refuse_other_copies
from .monitored_call import Monitored

IMPORT_S = 60.0  # for the imports of all the solvers
IMPORT_MIB = 8192


@dataclass(frozen=True)
class Description:
    """The facts of a solver for its rows.

    version : of its library. code : a hash of this project's code for it. owner : one of schema.OWNERS.
    failure : why the requested version cannot be used, "" if it can.
    """

    forms: list[Form]
    version: str
    code: str
    owner: str = "library"
    failure: str = ""


#: By name and label.
Solvers = dict[tuple[str, str], Description]
#: A solver's name and options.
Named = tuple[str, dict[str, Any]]


def describe(suite: Suite, reporter: Reporter = SILENT) -> list[Description]:
    """A description of each of the suite's solver entries, as `described` gives them."""
    installed = [(e.name, e.options) for e in suite.solver if not e.requirements]
    here = iter(described(installed, suite.plugin, f"suite {suite.name}", reporter))
    return [_of_version(e, suite.plugin, reporter) if e.requirements else next(here) for e in suite.solver]


def _of_version(entry: SolverEntry, plugin: str | None, reporter: Reporter) -> Description:
    """A description in the entry's own environment; one with a `failure` if that cannot be made."""
    solver, requirements = (entry.name, entry.options), entry.requirements or []
    try:
        (description,) = described([solver], plugin, "--with", reporter, requirements)
    except InputError as error:
        return Description(entry.forms or list(FORMS), entry.version, code="", failure=str(error))
    return replace(description, version=entry.version)


def described(
    solvers: Sequence[Named],
    plugin: str | Path | None,
    where: str,
    reporter: Reporter = SILENT,
    requirements: Sequence[str] = (),
) -> list[Description]:
    """A description of each solver. Raises InputError, all faults at once.

    where : the place that names them. requirements : packages of their environment, NAME==VERSION.
    """
    names = {name for name, _ in solvers}
    plugged = plugin is not None and Path(plugin).stem in names
    if not (requirements or plugged) and all(owner_of(name) != "library" for name in names):
        return described_here(solvers, None)
    name, job = "the solvers", (list(solvers), Path(plugin) if plugin else None, requirements)
    python = interpreter(requirements, reporter)
    limits = {"importing the solvers": IMPORT_S}
    monitored = Monitored(described_in_child, job, 1, limits, IMPORT_MIB, python)
    with reporter.step("importing"), monitored as process:
        for event in process:
            name = event.get("name", name)
            reporter.progress(name)
        refuse_unimportable(event, process, plugin or where, name)
    return [Description(**fields) for fields in event["descriptions"]]


def refuse_unimportable(end: Row, process: Monitored, where: str | Path, name: str) -> None:
    """Raise InputError if the last event of an import is a failure."""
    if faults := end.get("faults"):
        raise InputError([Fault(**fault) for fault in faults])
    if "status" in end:
        last = (process.stderr_text or "").splitlines()[-1:]
        raise InputError.one(where, "solver", name, " ".join([f"importing it: {end['message']}", *last]))


def described_in_child(job: tuple[list[Named], Path | None, Sequence[str]], events: Events) -> Row:
    """The descriptions, made in a child process, which reports each name first."""
    solvers, plugin, requirements = job
    descriptions = described_here(solvers, plugin, lambda name: events.report(name=name))
    refuse_other_copies(requirements)
    return {"descriptions": [asdict(each) for each in descriptions]}


def described_here(
    solvers: Sequence[Named],
    plugin: Path | None,
    begin: Callable[[str], None] = lambda name: None,
) -> list[Description]:
    """The descriptions, made in this process. Raises InputError, all faults at once."""

    def describe_one(named: Named) -> Description:
        name, options = named
        begin(name)
        solver = make_solver(name, options, plugin)
        forms = solver.forms
        if not isinstance(forms, tuple | list) or not forms or not all(form in FORMS for form in forms):
            allowed = f"a tuple of {', '.join(FORMS)}"
            raise InputError.one(f"solver {name}", "forms", shown(forms), allowed)
        for key in replaced(solver):
            raise InputError.one(f"solver {name}", key, shown(getattr(solver, key)), OTHER_NAME)
        return Description(list(forms), version_of(name, solver, plugin), code_of(solver), owner_of(name))

    return read_all(describe_one, solvers)


def code_of(solver: Solver) -> str:
    """The fingerprint of the code that can change a solver's answer or its time.

    This is its own file and what that imports from the package `solvers`, directly or indirectly; of a
    plug-in also what it imports of the user's own. The version of the library is a field of its own.
    """
    file = Path(inspect.getfile(type(solver)))
    files = [file] if ROOT / "solvers" in file.parents else plugin_files(file)
    return fingerprint(files, within=["solvers"])


#: What a run reads of its rows: which there are, how searches went, and whether a limit was hit.
NEEDED = (
    *("key", "scene", "solver", "form", "tolerance", "repeat"),
    *("status", "verdict", "time_limit_s", "memory_limit_mib"),
)


def rows_in(directory: Path, console: Console) -> list[Row]:
    """The rows of DIRECTORY, whose files lose their torn last lines.

    Raises InputError, also if its scenes cannot be read, among which a measured one is recorded.
    """
    paths = [directory / name for name in (records.MEASUREMENTS, records.OUTDATED, PROBLEMS)]
    for path in paths:
        if records.remove_torn_line(path):
            console.print(f"{path}: the last line was cut off, and is left out.", style="yellow")
    rows = valid_rows(paths[0], needed=NEEDED)
    valid_rows(paths[-1], PROBLEM)
    return rows


def valid_and_old(rows: list[Row], plan: list[Measurement], solvers: Solvers) -> tuple[list[Row], list[Row]]:
    """The rows that stand, and the outdated ones.

    On a scene of the plan that has changed, these are the rows of all solvers and rounds, planned or not.
    """
    planned = {m.key: m for m in plan}
    sources = {m.scene: m.source for m in plan}
    scene_keys = {name: read_scene(source).key for name, source in sources.items()}

    def is_old(row: Row) -> bool:
        m, scene_key = planned.get(row["key"]), scene_keys.get(row["scene"])
        if scene_key and row.get("scene_key") != scene_key:
            return True
        return m is not None and outdated(row, m, solvers[m.solver, m.entry.label])

    valid: list[Row] = []
    old: list[Row] = []
    for row in rows:
        (old if is_old(row) else valid).append(row)
    return valid, old


def set_aside(directory: Path, valid: list[Row], old: list[Row], console: Console) -> None:
    """Move outdated rows of DIRECTORY to a file of their own."""
    if old:
        records.append(directory / records.OUTDATED, *(row | {"answer": None, "log": None} for row in old))
        records.rewrite(directory / records.MEASUREMENTS, valid)
        aside = f"Set aside in {records.OUTDATED}: {counted(len(old), 'row')}"
        why = "because the scene, the solver or the limits have changed since, or a failure may have passed"
        console.print(f"{aside}, {why}.", style="yellow")


def outdated(row: Row, m: Measurement, solver: Description) -> bool:
    """Whether a row of a scene as it is has to be measured again.

    It is of another series, solver or accuracy, hit a limit that is wider now, failed by a cause that may be
    over, or has the status `not_run` of older versions; or a search tried what is asked for now: reports keep
    one row of a search.
    """
    current = {
        "solver_version": solver.version,
        "solver_code": row.get("solver_code") if solver.failure else solver.code,  # a failure says nothing
        "limit_asked_mm": m.suite.limit_mm,
        "gated": m.entry.gated,
    }
    law = m.series.model_dump(exclude={"cases"}) if m.series else {}
    recorded_law = {key: value for key, value in (row.get("series") or {}).items() if key != "cases"}
    changed = law != recorded_law or any(row.get(name) != value for name, value in current.items())
    out_of_time = row["status"] == "time_limit" and row["time_limit_s"] < m.time_limit_s
    out_of_memory = row["status"] == "memory_limit" and row["memory_limit_mib"] < m.suite.memory_limit_mib
    tried = bool(row.get("searched")) and not m.searched
    tried_again = row["status"] == "not_run" or records.may_pass(row)
    return changed or tried or out_of_time or out_of_memory or tried_again
