"""The cache: arrays on disk under a hash of their data and code; opened memory-mapped, written atomically.

An entry is a folder with one read-only .npy per array and a manifest: the size and the hash of each file,
the facts, and a hash of it all. So no bound is proven for a file that the disk has changed. Files longer than
`CHECKED` have no hash: reading them at each opening would take too long.

A fingerprint of code is a hash of what the code does; it is a part of the identity of rows and of cached
matrices. It ignores comments, layout, docstrings, annotations of functions, the exceptions raised, import
lines and the locations of files, which cannot change a number. It includes all files that a file imports,
directly or not, if they lie in the given folders. What parsing a file gave is in the cache, too.
"""

import ast
import functools
import hashlib
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from filelock import FileLock
from numpy.typing import NDArray

from problems import ROOT
from problems.errors import InputError

MANIFEST = "manifest.json"
CHECKED = 2**20  # bytes, a millisecond; of a longer file the size alone is checked
READ_ONLY = 0o444  # so that nobody who is given a memory map can write to its file by accident


#: Arrays by name, and facts that JSON can hold.
Entry = tuple[Mapping[str, NDArray[Any]], dict[str, Any]]


def root() -> Path:
    """The cache folder: $RIVETBENCH_CACHE, or the user's cache folder."""
    return Path(os.environ.get("RIVETBENCH_CACHE") or platformdirs.user_cache_dir("rivetbench"))


def digest(*parts: object) -> str:
    """A short hash of text, bytes or anything that JSON can hold."""
    h = hashlib.sha256()
    for part in parts:
        h.update(part if isinstance(part, bytes | memoryview) else json.dumps(part, sort_keys=True).encode())
        h.update(b"\0")
    return h.hexdigest()[:20]


@contextmanager
def lock(key: str) -> Iterator[None]:
    """One process at a time computes the entry; the others wait and then load it."""
    folder = root()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        held = FileLock(folder / f"{key}.lock").acquire()
    except OSError as error:
        raise InputError.one(folder, "cache folder", str(error), "writable; set RIVETBENCH_CACHE") from error
    with held:
        yield


def store(key: str, arrays: Mapping[str, NDArray[Any]], facts: dict[str, Any]) -> None:
    """Write an entry. The folder gets its name when it is complete."""
    root().mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(dir=root(), prefix=f"{key}."))
    try:
        for name, array in arrays.items():
            np.save(work / f"{name}.npy", array)
        content = {"files": {path.name: _stamp(path) for path in sorted(work.iterdir())}, "facts": facts}
        (work / MANIFEST).write_text(json.dumps(content | {"hash": digest(content)}, indent=1))
        for path in work.iterdir():
            path.chmod(READ_ONLY)
        target = root() / key
        if target.exists():
            target.rename(work.with_name(f"{work.name}.old"))
        work.rename(target)
    finally:
        for folder in (work, work.with_name(f"{work.name}.old")):
            shutil.rmtree(folder, ignore_errors=True)


def load(key: str) -> Entry | None:
    """The entry's arrays, memory-mapped and read-only, and its facts; None if there is no entry.

    Raises InputError if a file is missing or not what was written.
    """
    folder = root() / key
    if not folder.exists():
        return None
    path = folder / MANIFEST
    try:
        if not path.is_file():
            raise OSError("no regular file")
        content = json.loads(path.read_bytes())
        if content.pop("hash") != digest(content):
            raise ValueError("not what was written")
        arrays = {}
        for name, (size, hashed) in content["files"].items():
            path = folder / name
            size_now, hashed_now = _stamp(path)
            if size_now != size:
                raise InputError.one(path, "bytes", size_now, f"must be {size}; {_repair(folder)}")
            if hashed_now != hashed:
                raise ValueError("not what was written")
            arrays[path.stem] = np.load(path, mmap_mode="r")
    except InputError:
        raise
    except Exception as error:  # json and numpy's reader of headers raise kinds of their own
        raise InputError.one(path, "content", str(error), _repair(folder)) from error
    return arrays, content["facts"]


def load_or_make(key: str, make: Callable[[], Entry]) -> Entry:
    """The entry, memory-mapped; if there is none yet, one process computes it while the others wait."""
    entry = load(key)
    if entry is None:
        with lock(key):
            entry = load(key)
            if entry is None:
                store(key, *make())
                entry = load(key)
    assert entry is not None
    return entry


def _stamp(path: Path) -> tuple[int | None, str | None]:
    """The size of a file, None if there is none, and its hash, None if it is long."""
    size = path.stat().st_size if path.is_file() else None
    if size is None or size > CHECKED:
        return size, None
    with path.open("rb") as file:
        return size, hashlib.file_digest(file, "sha256").hexdigest()


def _repair(folder: Path) -> str:
    return f"the cache is damaged: delete {folder} and run again"


OWN_CODE = Path(__file__).read_bytes()


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


@functools.cache
def _read(path: Path, root: Path, changed: int) -> tuple[str, tuple[Path, ...]]:
    """The hash of one file's code and the files below root that it imports; `changed` renews the cache."""
    content = path.read_bytes()
    key = digest("code", sys.version, OWN_CODE, content)
    facts = load_or_make(key, lambda: ({}, _parsed(content)))[1]
    modules = []
    for level, names in facts["imports"]:
        folder = path.parents[level - 1] if level else root
        modules += [folder.joinpath(*name.split(".")) for name in names]
    files = [file for name in modules for file in (name.with_suffix(".py"), name / "__init__.py")]
    return facts["hash"], tuple(file for file in files if file.is_file())


def _parsed(content: bytes) -> dict[str, Any]:
    """The hash of a file's code, and the modules that it imports, anywhere in it, by their level."""
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):  # compiled, or no Python
        return {"hash": hashlib.sha256(content).hexdigest(), "imports": []}
    imports: list[tuple[int, list[str]]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            module = node.module or ""
            within = [f"{module}.{alias.name}".lstrip(".") for alias in node.names]
            imports.append((node.level, [module, *within]))
        elif isinstance(node, ast.Import):
            imports.append((0, [alias.name for alias in node.names]))
    code = ast.dump(_WithoutText().visit(tree))
    return {"hash": hashlib.sha256(code.encode()).hexdigest(), "imports": imports}


class _WithoutText(ast.NodeTransformer):
    """Removes from a syntax tree the parts that cannot change a number."""

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
