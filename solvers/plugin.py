"""A user's own solver: a Python file with one subclass of solvers.base.Solver, and what it imports."""

import ast
import importlib.util
import inspect
import sys
import sysconfig
import traceback
from collections.abc import Collection, Iterable, Iterator
from importlib.machinery import all_suffixes
from pathlib import Path
from types import ModuleType

from problems.errors import Fault, InputError

from .base import Solver

PROJECT = ("harness", "problems", "report", "rivetbench", "solvers")


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
        where, text = f"line {error.lineno}", (error.text or "").strip()
        raise InputError.one(error.filename or path, where, text, message) from error
    except (Exception, SystemExit) as error:
        frames = traceback.extract_tb(error.__traceback__)
        line = next((frame.lineno for frame in frames if frame.filename == spec.origin), 1)
        message = f"importing the file failed with {type(error).__name__}: {error}"
        raise InputError.one(path, f"line {line}", type(error).__name__, message) from error
    return solver_class(module, path)


def plugin_files(path: Path) -> list[Path]:
    """The plug-in's file and the files of the user's code that it imports, directly or not.

    The user's code lies in the file's folder or in a folder of sys.path, and is neither installed nor part of
    this project. A string that names a module or a file of code there counts as an import. Computed names and
    files of data do not count.
    """
    path = path.resolve()
    folders = {path.parent, *_user_folders()}
    files: set[Path] = set()
    unread = [path]
    while unread:
        file = unread.pop()
        if file not in files:
            files.add(file)
            unread += [imported.resolve() for imported in _imported(file, folders)]
    return sorted(files)


def _user_folders() -> Iterator[Path]:
    """The folders of sys.path that hold neither the standard library nor installed packages."""
    standard = Path(sysconfig.get_path("stdlib"))
    for folder in map(Path, sys.path):
        installed = {"site-packages", "dist-packages"} & set(folder.parts)
        if not (installed or standard in (folder, *folder.parents)):
            yield folder.resolve()


def _imported(file: Path, folders: Iterable[Path]) -> Iterator[Path]:
    """The files in the folders that a file imports, the `__init__` of packages included."""
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # compiled, or no Python
        return
    for node in ast.walk(tree):
        within = folders
        if isinstance(node, ast.ImportFrom):
            within = list(file.parents)[node.level - 1 : node.level] if node.level else folders
            module = f"{node.module}." if node.module else ""
            names = [module + alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names = [node.value]
            if node.value.endswith(tuple(all_suffixes())):
                yield from (path for folder in folders if (path := folder / node.value).is_file())
        else:
            continue
        for parts in (name.split(".") for name in names):
            users = within is not folders or parts[0] not in PROJECT
            if users and all(part.isidentifier() or part == "*" for part in parts):
                yield from _modules(within, parts)


def _modules(folders: Iterable[Path], parts: list[str]) -> Iterator[Path]:
    """The files of a dotted name and of the packages that it is in."""
    for folder in folders:
        for k in range(1, len(parts) + 1):
            place = folder.joinpath(*parts[:k])
            files = (f"{name}{suffix}" for suffix in all_suffixes() for name in (place, place / "__init__"))
            yield from (Path(file) for file in files if Path(file).is_file())


def solver_class(module: ModuleType, path: Path) -> type[Solver]:
    """The one subclass of Solver that a module defines; imported and abstract classes do not count.

    Raises InputError if there is none, or more than one.
    """
    defined = [
        cls
        for cls in dict.fromkeys(filter(inspect.isclass, vars(module).values()))  # which may have two names
        if issubclass(cls, Solver) and cls.__module__ == module.__name__
    ]
    complete = [cls for cls in defined if not inspect.isabstract(cls)]
    if len(complete) == 1:
        return complete[0]
    names = ", ".join(cls.__name__ for cls in complete or defined) or None
    allowed = "the file must define a subclass of Solver (from solvers.base import Solver)"
    if defined:
        allowed = "the subclass of Solver must define solve(self, ready, load, tolerance)"
    if complete:
        allowed = "must be one subclass of Solver, not several"
    raise InputError.one(path, "Solver", names, allowed)


def unused(plugin: str | Path | None, names: Collection[str]) -> list[Fault]:
    """The fault of a plug-in whose solver is not one of these."""
    if plugin is None or (name := Path(plugin).stem) in names:
        return []
    return [Fault("--solver", "name", ", ".join(dict.fromkeys(names)), f"{name}, that of --plugin {plugin}")]
