"""Arrays on disk under a hash of their data and code; opened memory-mapped, written atomically.

An entry is a folder with one read-only .npy per array and a manifest. The manifest holds each file's SHA-256,
the facts, and a hash of both. Each process verifies a file when it opens it first, and again if the file has
changed since.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from filelock import FileLock
from numpy.typing import NDArray

from problems.errors import InputError

MANIFEST = "manifest.json"
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
        h.update(part if isinstance(part, bytes) else json.dumps(part, sort_keys=True).encode())
        h.update(b"\0")
    return h.hexdigest()[:20]


@contextmanager
def lock(key: str) -> Iterator[None]:
    """One process at a time computes the entry; the others wait and then load it."""
    folder = root()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / f"{key}.lock"):
            yield
    except (PermissionError, FileExistsError, NotADirectoryError) as error:
        raise InputError.one(folder, "cache folder", str(error), "writable; set RIVETBENCH_CACHE") from error


def store(key: str, arrays: Mapping[str, NDArray[Any]], facts: dict[str, Any]) -> None:
    """Write an entry. The folder gets its name when it is complete."""
    root().mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(dir=root(), prefix=f"{key}."))
    try:
        for name, array in arrays.items():
            np.save(work / f"{name}.npy", array)
        files = sorted(work.iterdir())
        sizes = {path.name: path.stat().st_size for path in files}
        manifest = {"files": sizes, "sha256": dict(zip(sizes, _hashes(files), strict=True)), "facts": facts}
        manifest = json.loads(json.dumps(manifest))
        path = work / MANIFEST
        path.write_text(json.dumps(manifest | {"hash": digest(manifest)}, indent=1))
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
    """The entry's arrays, memory-mapped and read-only, and its facts; None if there is none, or one without
    hashes, of an older version.

    Raises InputError if a file is missing or is not what was written.
    """
    folder = root() / key
    if not folder.exists():
        return None
    manifest = _manifest(folder)
    if "hash" not in manifest:
        return None
    paths = []
    for name, size in manifest["files"].items():
        paths.append(folder / name)
        found = paths[-1].stat().st_size if paths[-1].is_file() else None
        if found != size:
            raise InputError.one(paths[-1], "bytes", found, f"must be {size}; {_repair(folder)}")
    _verify(paths, manifest["sha256"])
    return {path.stem: np.load(path, mmap_mode="r") for path in paths}, manifest["facts"]


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    try:
        if not path.is_file():
            raise OSError("no regular file")
        manifest = json.loads(path.read_text())
        known = {name: manifest[name] for name in ("files", "sha256", "facts") if name in manifest}
        whole = "hash" in manifest and digest(known) == manifest["hash"]
        older = manifest.keys() == {"files", "facts"}
    except (OSError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise InputError.one(path, "content", str(error), _repair(folder)) from error
    if not (whole or older):
        raise InputError.one(path, "content", "not what was written", _repair(folder))
    return dict(manifest)


#: The files that this process has verified, with their state then.
_verified: dict[Path, tuple[int, ...]] = {}


def _verify(paths: list[Path], wanted: Mapping[str, str]) -> None:
    """Raise InputError if a file is not what was written; what has not changed since is not read again."""
    states = {path: _state(path) for path in paths}
    unknown = [path for path in paths if _verified.get(path) != states[path]]
    for path, found in zip(unknown, _hashes(unknown), strict=True):
        if found != wanted[path.name]:
            raise InputError.one(path, "SHA-256", found[:12], _repair(path.parent))
        _verified[path] = states[path]


def _state(path: Path) -> tuple[int, ...]:
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _hashes(paths: list[Path]) -> list[str]:
    """The SHA-256 of files, two at a time: hashing releases the interpreter's lock."""
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(_sha256, paths))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def load_or_make(key: str, make: Callable[[], Entry]) -> Entry:
    """The entry, memory-mapped; if there is none yet, one process computes it while the others wait."""
    found = load(key)
    if found is None:
        with lock(key):
            found = load(key)
            if found is None:
                store(key, *make())
                found = load(key)
    assert found is not None
    return found


def _repair(folder: Path) -> str:
    return f"the cache is damaged: delete {folder} and run again"
