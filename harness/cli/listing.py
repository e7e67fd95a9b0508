"""The tables of `list`: solvers, scenes, suites, file formats."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from harness.planning.suite import read_suite, suite_names
from harness.terminal.console import table_of
from problems import formats
from problems.errors import InputError
from problems.ladders import PREFIXES, rung_names
from problems.random_scenes import KINDS
from problems.scene_files import read_scene, scene_names
from solvers.registry import make_solver, modules, solver_names, solver_version

FOLDERS = ", ".join(f"drawn/{kind}/<k>" for kind in KINDS)
DRAWN = f"Not listed: scenes drawn at random, {FOLDERS}, with k = 0, 1, 2, …"


def listing(what: str) -> Table:
    """A table of "solvers", "scenes", "suites" or "formats"."""
    lines = {"solvers": _solvers, "scenes": _scenes, "suites": _suites, "formats": _formats}[what]
    return table_of(lines(), DRAWN if what == "scenes" else None)


def _solvers() -> Iterator[Sequence[str]]:
    yield "solver", "forms", "version", "through"
    for name in solver_names():
        try:
            forms, version = " ".join(make_solver(name, {}).forms), solver_version(name)
        except InputError as error:
            forms, version = error.faults[0].allowed, "unknown"
        yield name, forms, version, "" if name in modules() else "qpsolvers"


def _scenes() -> Iterator[Sequence[str]]:
    yield "scene", "n", "m", "title"
    rungs = [name for prefix in PREFIXES for name in rung_names(prefix)]
    for name in [*scene_names(), *rungs]:
        scene = read_scene(name)
        yield name, *(str(size) for size in scene.expected_size or ("", "")), scene.title


def _suites() -> Iterator[Sequence[str]]:
    yield "suite", "scenes", "solvers", "purpose"
    for name in suite_names():
        suite = read_suite(name)
        solvers = dict.fromkeys(entry.name for entry in suite.solver)
        yield name, str(len(suite.scenes)), " ".join(solvers), suite.description or suite.title


def _formats() -> Iterator[Sequence[str]]:
    yield "format", "what is written"
    yield from ((name, each.description) for name, each in formats.FORMATS.items())
