"""A hash of what code does, part of the identity of rows and cached matrices.

It ignores what cannot change a number: comments, layout, docstrings, annotations of functions, what `raise`
raises, import lines and the locations of files. It includes the files that a file imports, directly or not,
if they lie in the given folders.
"""

import ast
import hashlib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

#: The folder that holds the project's packages.
ROOT = Path(__file__).resolve().parents[2]


def fingerprint(files: Iterable[Path], within: Iterable[str] = (), root: Path = ROOT) -> str:
    """12 hexadecimal digits of the code in `files` and in what they import, directly or not.

    within : the folders below `root` whose files count when they are imported.
    """
    folders = [root / folder for folder in within]
    unread = list(files)
    seen: dict[Path, str] = {}
    while unread:
        path = unread.pop()
        if path not in seen:
            seen[path], imported = _read(path, root, path.stat().st_mtime_ns)
            unread += [file for file in imported if any(folder in file.parents for folder in folders)]
    return hashlib.sha256("".join(sorted(seen.values())).encode()).hexdigest()[:12]


@cache
def _read(path: Path, root: Path, changed: int) -> tuple[str, tuple[Path, ...]]:
    """The hash of one file's code and the files below root that it imports; `changed` renews the cache."""
    content = path.read_bytes()
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):  # compiled, or no Python
        return hashlib.sha256(content).hexdigest(), ()
    imported = tuple(_imported(path, tree, root))
    code = ast.dump(_WithoutText().visit(tree))
    return hashlib.sha256(code.encode()).hexdigest(), imported


class _WithoutText(ast.NodeTransformer):
    """Removes from a tree, which has neither comments nor layout, what cannot change a number."""

    def generic_visit(self, node: ast.AST) -> Any:
        match node:
            case ast.Import() | ast.ImportFrom():
                return None
            case ast.Raise():
                return ast.Raise()
            case ast.arg():
                node.annotation = None
            case ast.FunctionDef():
                node.returns = None
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = node.body[ast.get_docstring(node, clean=False) is not None :]
        return super().generic_visit(node)


def _imported(path: Path, tree: ast.Module, root: Path) -> Iterator[Path]:
    """The files below root that the file at `path` imports, anywhere in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            folder = path.parents[node.level - 1] if node.level else root
            module = folder.joinpath(*(node.module or "").split("."))
            names = [module, *(module / each.name for each in node.names)]
        elif isinstance(node, ast.Import):
            names = [root.joinpath(*each.name.split(".")) for each in node.names]
        else:
            continue
        files = [file for name in names for file in (name.with_suffix(".py"), name / "__init__.py")]
        yield from (file for file in files if file.is_file())
