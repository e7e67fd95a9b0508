"""The solvers by name. A new one is one file: in `methods` if the method is our own, in `textbook` if it is a
standard method in a few lines of SciPy, else in `libraries`.

It defines one subclass of Solver; its file name, with - for _, is the solver's name. Further solvers found by
qpsolvers have their name there, and a plug-in (plugin.py) has the name of its file.
"""

import hashlib
import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from problems import __version__
from problems.errors import InputError
from problems.input.bounded_types import unknown

from .base import Solver
from .options import NO_OPTIONS, require
from .plugin import load_plugin, plugin_files, solver_class

#: The origin of a solver.
Owner = Literal["ours", "textbook", "library"]
PACKAGES: dict[Owner, str] = {
    "ours": "solvers.methods",
    "textbook": "solvers.textbook",
    "library": "solvers.libraries",
}
#: The one module for many solvers: all others that qpsolvers finds.
QPSOLVERS = "qpsolvers"


@cache
def modules() -> dict[str, str]:
    """Solver → module, not yet imported: the methods of this project, the textbook's, then the libraries."""
    by_name: dict[str, str] = {}
    for package in PACKAGES.values():
        path = importlib.import_module(package).__path__
        names = sorted(module.name for module in pkgutil.iter_modules(path) if module.name != QPSOLVERS)
        by_name |= {name.replace("_", "-"): f"{package}.{name}" for name in names}
    return by_name


def owner_of(name: str) -> Owner:
    """The owner of a solver; plug-ins and solvers that only qpsolvers finds count as libraries."""
    module = modules().get(name, "")
    return next((owner for owner, package in PACKAGES.items() if module.startswith(package)), "library")


def solver_names() -> list[str]:
    """Our solvers, the textbook's, libraries, then the others that qpsolvers finds."""
    return [*modules(), *_found_by_qpsolvers()]


def make_solver(name: str, options: dict[str, Any], plugin: Path | None = None) -> Solver:
    """A solver with its options. `plugin` is a user's file, used if `name` is the file's stem.

    Raises InputError if the name, an option or its value is unknown or invalid, or if the plug-in cannot be
    loaded.
    """
    factory = _factory(name, plugin)
    parameters = inspect.signature(factory).parameters
    if not any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        allowed = f"one of the options {', '.join(parameters)}" if parameters else NO_OPTIONS
        wrong = (False, f"unknown option, allowed: {allowed}")
        require(name, options, **{key: wrong for key in options if key not in parameters})
    try:
        return factory(**options)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError.one(f"solver {name}", "options", options, str(error)) from error


def solver_version(name: str, plugin: Path | None = None) -> str:
    """The version of the library; for a plug-in a hash of its own files; "unknown" if there is none."""
    if plugin is not None and name == plugin.stem:
        contents = sorted(hashlib.sha256(file.read_bytes()).digest() for file in plugin_files(plugin))
        return "sha256:" + hashlib.sha256(b"".join(contents)).hexdigest()[:12]
    if name in modules():
        distribution = _class_of(name).distribution
        if distribution is None and owner_of(name) != "library":
            return __version__
    else:
        from .libraries.qpsolvers import DISTRIBUTIONS

        distribution = DISTRIBUTIONS.get(name)
    try:
        return version(distribution or name)
    except PackageNotFoundError:
        return "unknown"


def _found_by_qpsolvers() -> list[str]:
    import qpsolvers  # slow: imports every solver

    return sorted(set(qpsolvers.available_solvers) - set(modules()))


def _factory(name: str, plugin: Path | None) -> Callable[..., Solver]:
    if plugin is not None and name == plugin.stem:
        if name in modules():
            raise InputError.one(plugin, "name", name, "is taken by a solver of the package: rename the file")
        return load_plugin(plugin)
    if name in modules():
        return _class_of(name)
    if name in _found_by_qpsolvers():
        from .libraries.qpsolvers import QpSolvers

        return partial(QpSolvers, name)
    known = [*solver_names(), *([plugin.stem] if plugin else [])]
    raise InputError.one("solvers", "name", name, unknown("solver", name, known))


def _class_of(name: str) -> type[Solver]:
    try:
        module = importlib.import_module(modules()[name])
    except (ImportError, AttributeError) as error:  # another version may lack what an adapter names
        raise InputError.one("solvers", "name", name, f"cannot be imported here ({error})") from error
    return solver_class(module, Path(str(module.__file__)))
