"""Arrays on disk under a hash of their data and code; opened memory-mapped, written atomically."""

from __future__ import annotations

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

from problems.errors import InputError

MANIFEST = "manifest.json"

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
        sizes = {path.name: path.stat().st_size for path in work.iterdir()}
        (work / MANIFEST).write_text(json.dumps({"files": sizes, "facts": facts}, indent=1))
        target = root() / key
        if target.exists():
            shutil.rmtree(target)
        work.rename(target)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def load(key: str) -> Entry | None:
    """The entry's arrays, memory-mapped and read-only, and its facts; None if there is none.

    Raises InputError if a file is missing or does not have the size it was written with.
    """
    folder = root() / key
    if not folder.exists():
        return None
    try:
        manifest = json.loads((folder / MANIFEST).read_text())
        sizes, facts = manifest["files"], manifest["facts"]
    except (OSError, ValueError, KeyError) as error:
        raise InputError.one(folder / MANIFEST, "content", str(error), _repair(folder)) from error
    for name, size in sizes.items():
        found = (folder / name).stat().st_size if (folder / name).exists() else None
        if found != size:
            raise InputError.one(folder / name, "bytes", found, f"must be {size}; {_repair(folder)}")
    return {Path(name).stem: np.load(folder / name, mmap_mode="r") for name in sizes}, facts


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
