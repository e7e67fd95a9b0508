"""A hash of the code that can change a solver's answer or its time, so that a row tells which code made it.

The code is the solver's own file and what it imports from the package `solvers`, and that in turn: never
another solver's. It is hashed as Python reads it, so that comments, docstrings and layout do not count.
What solves in a library is told by the version of the library, beside this hash.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
from collections.abc import Iterator
from pathlib import Path

from solvers.base import Solver

PACKAGE = Path(inspect.getfile(Solver)).parent


def code_of(solver: Solver) -> str:
    """The hash of a solver of the package, or of a user's."""
    return hash_of(Path(inspect.getfile(type(solver))), PACKAGE)


def hash_of(file: Path, package: Path) -> str:
    """The hash of the code in `file` and in the modules of `package` that it imports, directly or not."""
    read: dict[Path, str] = {}
    todo = [file]
    while todo:
        path = todo.pop()
        if path not in read:
            tree = ast.parse(path.read_bytes())
            todo += _imported(path, tree, package)
            read[path] = _without_words(tree)
    return hashlib.sha256("".join(sorted(read.values())).encode()).hexdigest()[:12]


def _without_words(tree: ast.Module) -> str:
    """The tree, which holds neither comments nor layout, without its docstrings, which are taken from it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = node.body[ast.get_docstring(node, clean=False) is not None :]
    return ast.dump(tree)


def _imported(path: Path, tree: ast.Module, package: Path) -> Iterator[Path]:
    """The files of `package` that the file at `path` imports, anywhere in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            folder = path.parents[node.level - 1] if node.level else package.parent
            module = folder.joinpath(*(node.module or "").split("."))
            names = [module, *(module / each.name for each in node.names)]
        elif isinstance(node, ast.Import):
            names = [package.parent.joinpath(*each.name.split(".")) for each in node.names]
        else:
            continue
        files = [file for name in names for file in (name.with_suffix(".py"), name / "__init__.py")]
        yield from (file for file in files if package in file.parents and file.is_file())
