"""The tables of `list`: solvers, scenes, suites, file formats."""

from rich.table import Table

from harness.planning.suite import read_suite, suite_names
from problems import formats
from problems.errors import InputError
from problems.ladders import PREFIXES, rung_names
from problems.random_scenes import KINDS
from problems.scene_files import read_scene, scene_names
from solvers.registry import make_solver, modules, solver_names, solver_version


def listing(what: str) -> Table:
    """A table of "solvers", "scenes", "suites" or "formats"."""
    return {"solvers": _solvers, "scenes": _scenes, "suites": _suites, "formats": _formats}[what]()


def _solvers() -> Table:
    table = Table("solver", "forms", "version", "through")
    for name in solver_names():
        try:
            forms = " ".join(make_solver(name, {}).forms)
        except InputError as error:
            forms = error.faults[0].allowed
        table.add_row(name, forms, solver_version(name), "" if name in modules() else "qpsolvers")
    return table


def _scenes() -> Table:
    folders = ", ".join(f"drawn/{kind}/<k>" for kind in KINDS)
    caption = f"Not listed: scenes drawn at random, {folders}, with k = 0, 1, 2, …"
    table = Table("scene", "n", "m", "title", caption=caption)
    rungs = [name for prefix in PREFIXES for name in rung_names(prefix)]
    for name in [*scene_names(), *rungs]:
        scene = read_scene(name)
        table.add_row(name, *(str(size) for size in scene.expected_size or ("", "")), scene.title)
    return table


def _suites() -> Table:
    table = Table("suite", "scenes", "solvers", "purpose")
    for name in suite_names():
        suite = read_suite(name)
        solvers = dict.fromkeys(entry.name for entry in suite.solver)
        table.add_row(name, str(len(suite.scenes)), " ".join(solvers), suite.description or suite.title)
    return table


def _formats() -> Table:
    table = Table("format", "what is written")
    for name, each in formats.FORMATS.items():
        table.add_row(name, each.description)
    return table
