"""Outputs that are written beside their place and moved there when they are whole."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from problems.errors import InputError


@contextmanager
def into_place(out: Path, inputs: Sequence[Path] = ()) -> Iterator[Path]:
    """A path beside `out` to write a file or a folder to; at the end of the block it moves to `out`.

    Files of the same names are replaced; whatever the block raises, nothing has changed. Raises InputError if
    `out` is no regular file or folder, is of the other kind, or is one of the inputs.
    """
    _check([out], inputs)
    target = Path(os.path.realpath(out))  # Path.resolve raises RuntimeError on a loop of links
    target.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=target.parent, prefix=".rivetbench.") as folder:
        new = Path(folder) / target.name
        yield new
        if target.exists() and new.is_dir() != target.is_dir():
            kind = "folder" if new.is_dir() else "file"
            raise InputError.one("--out", "path", str(out), f"a {kind} is to be written, and this is none")
        if new.is_dir():
            _check([out / path.name for path in new.iterdir()], inputs)
            target.mkdir(exist_ok=True)
            for path in new.iterdir():
                path.replace(target / path.name)
        else:
            new.replace(target)


def _check(targets: Sequence[Path], inputs: Sequence[Path]) -> None:
    for path in targets:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise InputError.one("--out", "path", str(path), "no regular file: name another")
        if any(path.exists() and given.exists() and path.samefile(given) for given in inputs):
            raise InputError.one(
                "--out", "path", str(path), "is one of the files that are read: name another"
            )
