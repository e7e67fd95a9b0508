"""Loads a user's own solver: a Python file with one subclass of solvers.base.Solver."""

from __future__ import annotations

import importlib.util
import inspect
import sys
import traceback
from pathlib import Path
from types import ModuleType

from problems.errors import InputError

from .base import Solver


def load_plugin(path: Path) -> type[Solver]:
    """The Solver subclass that the file defines. Imported and abstract classes do not count.

    Raises InputError if the file is missing or not Python, its import fails, or it does not define exactly
    one such class.
    """
    if not path.is_file() or path.suffix != ".py":
        raise InputError.one(path, "plugin", str(path), "must be an existing Python file, NAME.py")
    name = f"rivetbench_plugin_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None  # it ends in .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look their module up
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        message = f"is not Python: {error.msg}"
        raise InputError.one(path, f"line {error.lineno}", (error.text or "").strip(), message) from error
    except (Exception, SystemExit) as error:
        line = traceback.extract_tb(error.__traceback__)[-1].lineno
        message = f"importing the file failed with {type(error).__name__}: {error}"
        raise InputError.one(path, f"line {line}", type(error).__name__, message) from error
    return solver_class(module, path)


def solver_class(module: ModuleType, path: Path) -> type[Solver]:
    """The one subclass of Solver that a module defines; imported and abstract classes do not count.

    Raises InputError if there is none, or more than one.
    """
    own = [
        cls
        for cls in vars(module).values()
        if inspect.isclass(cls) and issubclass(cls, Solver) and cls.__module__ == module.__name__
    ]
    complete = [cls for cls in own if not inspect.isabstract(cls)]
    if len(complete) == 1:
        return complete[0]
    if len(complete) > 1:
        names = ", ".join(cls.__name__ for cls in complete)
        raise InputError.one(path, "Solver", names, "must be one subclass of Solver, not several")
    if own:
        message = "the subclass of Solver must define solve(self, ready, load, tolerance)"
        raise InputError.one(path, "Solver", own[0].__name__, message)
    message = "the file must define a subclass of Solver (from solvers.base import Solver)"
    raise InputError.one(path, "Solver", None, message)
