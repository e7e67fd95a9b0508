"""Arrays on disk under a hash of their data and code; opened memory-mapped, written atomically.

An entry is a folder with one read-only .npy per array and a manifest: the size of each file, and the facts.
"""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from filelock import FileLock
from numpy.typing import NDArray
from pydantic import BaseModel

from problems.errors import InputError

MANIFEST = "manifest.json"
READ_ONLY = 0o444  # so that nobody who is given a memory map can write to its file by accident


class Manifest(BaseModel):
    """The bytes of each file of an entry, and what else is known."""

    files: dict[str, int]
    facts: dict[str, Any]


class Facts(dict[str, Any]):
    """The facts of a stored entry; asking for one that it lacks raises InputError."""

    def __init__(self, path: Path, facts: dict[str, Any]) -> None:
        super().__init__(facts)
        self.path = path

    def __missing__(self, name: str) -> Any:
        raise InputError.one(self.path, f"facts.{name}", None, _repair(self.path.parent))


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
        sizes = {path.name: path.stat().st_size for path in sorted(work.iterdir())}
        (work / MANIFEST).write_text(json.dumps({"files": sizes, "facts": facts}, indent=1))
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
    """The entry's arrays, memory-mapped and read-only, and its facts; None if there is none.

    Raises InputError if a file is missing, cut off or another one.
    """
    folder = root() / key
    if not folder.exists():
        return None
    path = folder / MANIFEST
    try:
        if not path.is_file():
            raise OSError("no regular file")
        manifest = Manifest.model_validate(json.loads(path.read_bytes()))
        arrays = {}
        for name, size in manifest.files.items():
            path = folder / name
            found = path.stat().st_size if path.is_file() else None
            if found != size:
                raise InputError.one(path, "bytes", found, f"must be {size}; {_repair(folder)}")
            arrays[path.stem] = np.load(path, mmap_mode="r")
    except InputError:
        raise
    except Exception as error:  # json, pydantic and numpy's reader of headers raise kinds of their own
        raise InputError.one(path, "content", str(error), _repair(folder)) from error
    return arrays, Facts(folder / MANIFEST, manifest.facts)


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
