"""The solvers by name. A new one is one file and one line in SOLVERS.

What qpsolvers finds besides comes by its name there, and a user's own solver from a file (plugin.py),
under the name of that file without `.py`.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
from collections.abc import Callable
from difflib import get_close_matches
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from problems import __version__
from problems.errors import Fault, InputError

from .base import Solver
from .plugin import load_plugin

#: name → module:class, imported when asked for.
SOLVERS = {
    "ipm": "solvers.methods.ipm:Ipm",
    "gi": "solvers.methods.gi:GoldfarbIdnani",
    "newton": "solvers.methods.newton:ActiveSetNewton",
    "ipm-fast": "solvers.methods.ipm_fast:FastIpm",
    "osqp": "solvers.libraries.osqp:Osqp",
    "clarabel": "solvers.libraries.clarabel:Clarabel",
    "proxqp": "solvers.libraries.proxqp:ProxQp",
    "piqp": "solvers.libraries.piqp:Piqp",
}

IN_HOUSE = ("ipm", "gi", "newton", "ipm-fast")
#: Where the distribution that is installed has another name than the solver.
DISTRIBUTIONS = {"proxqp": "proxsuite", "highs": "highspy"}


def solver_names() -> list[str]:
    """In-house solvers, libraries, then the others that qpsolvers finds."""
    return [*SOLVERS, *_found_by_qpsolvers()]


def make_solver(name: str, options: dict[str, Any], plugin: Path | None = None) -> Solver:
    """A solver with its options. `plugin` is a user's file, meant where name is the file's stem.

    Raises InputError on a name or an option that there is not, on an option's value that the solver does
    not take, and on a plugin that cannot be loaded.
    """
    where = f"solver {name}"
    factory = _factory(name, plugin)
    faults = _unknown_options(where, factory, options)
    if faults:
        raise InputError(faults)
    try:
        return factory(**options)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError.one(where, "options", options, str(error)) from error


def solver_version(name: str, plugin: Path | None = None) -> str:
    """Version of the package that solves; for a plugin a hash of its file; else "unknown"."""
    if plugin is not None and name == plugin.stem:
        return "sha256:" + hashlib.sha256(plugin.read_bytes()).hexdigest()[:12]
    if name in IN_HOUSE:
        return __version__
    try:
        return version(DISTRIBUTIONS.get(name, name))
    except PackageNotFoundError:
        return "unknown"


def _found_by_qpsolvers() -> list[str]:
    import qpsolvers  # imports every solver that there is, which takes its time

    return sorted(set(qpsolvers.available_solvers) - set(SOLVERS))


def _factory(name: str, plugin: Path | None) -> Callable[..., Solver]:
    if plugin is not None and name == plugin.stem:
        if name in SOLVERS:
            raise InputError.one(plugin, "name", name, "is taken by a solver of the package: rename the file")
        return load_plugin(plugin)
    if name in SOLVERS:
        module, _, attribute = SOLVERS[name].partition(":")
        try:
            return getattr(importlib.import_module(module), attribute)
        except ImportError as error:
            raise InputError.one("solvers", "name", name, f"cannot be imported here ({error})") from error
    if name in _found_by_qpsolvers():
        from solvers.libraries.qpsolvers import QpSolvers

        def by_name() -> Solver:
            return QpSolvers(name)

        return by_name
    known = [*solver_names(), *([plugin.stem] if plugin else [])]
    close = get_close_matches(name, known, 1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    raise InputError.one("solvers", "name", name, f"no such solver: {hint}there are {', '.join(known)}")


def _unknown_options(where: str, factory: Callable[..., Solver], options: dict[str, Any]) -> list[Fault]:
    parameters = inspect.signature(factory).parameters
    if any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        return []
    allowed = f"one of the options {', '.join(parameters)}" if parameters else "this solver takes no options"
    return [
        Fault(where, f"options.{key}", value, f"unknown option, allowed: {allowed}")
        for key, value in options.items()
        if key not in parameters
    ]
