"""The version of a solver, and the refusal of another one than that which a run or a series has described."""

from pathlib import Path

from harness.results.provenance import installed_version
from problems.errors import InputError
from solvers.base import Solver
from solvers.registry import solver_version

CHANGED = "it has changed since, or is another on this worker"


def version_of(name: str, solver: Solver, plugin: Path | None) -> str:
    """The version of a solver; of a plug-in that of its files, and of the distribution that it names."""
    version = solver_version(name, plugin)
    if plugin is None or plugin.stem != name or not solver.distribution:
        return version
    return f"{version} {solver.distribution}=={installed_version(solver.distribution)}"


def refuse_other_version(name: str, plugin: str | Path | None, version: str, described: str) -> None:
    """Raise InputError if a solver has another version than that which all rows have."""
    if version != described:
        where = plugin if plugin and Path(plugin).stem == name else f"solver {name}"
        allowed = f"{described}, as at the beginning: {CHANGED}"
        raise InputError.one(where, "version", version, allowed)
