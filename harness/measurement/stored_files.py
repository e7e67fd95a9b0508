"""Whether a solver changed the files of the cache that its matrices were read from."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from harness.solving.answers import InvalidAnswer
from problems.forms.assembly import Matrix


class StoredFiles:
    """The files of the cache entries that memory-mapped arrays come from, as they are now."""

    def __init__(self, arrays: Iterable[Matrix]) -> None:
        names = [array.filename for array in arrays if isinstance(array, np.memmap) and array.filename]
        self.folders = sorted({Path(name).parent for name in names})
        self.before = {folder: _state(folder) for folder in self.folders}

    def check(self) -> None:
        """Raises InvalidAnswer if a file was written, replaced or deleted since."""
        changed = [str(folder) for folder, before in self.before.items() if _state(folder) != before]
        if changed:
            raise InvalidAnswer(f"the solver wrote into the cache: delete {', '.join(changed)}")


def _state(folder: Path) -> dict[str, tuple[int, ...]]:
    """Of each file what a write changes. ctime : no program can set it back."""
    try:
        found = {path.name: path.stat() for path in folder.iterdir()}
    except OSError:
        return {}
    return {
        name: (stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns) for name, stat in found.items()
    }
