"""Writes outputs beside their place and moves them there when they are whole."""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.results.provenance import fingerprints
from harness.results.records import parsed, replace_text, to_line
from problems.errors import InputError
from problems.input.bounded_types import resolved

RECORD, PROGRAM = "solution.json", "about.json"  # of an answer, of an exported quadratic program
#: The files of a program that an older version exported, without a list of them.
ARRAYS = ("P", "q", "G", "h", "lb", "x", "lam", "bound_mm", "limit_mm")
EXPORTED = [PROGRAM, *(f"{name}.mtx" for name in ARRAYS)]


@contextmanager
def atomic_output(out: Path, inputs: Sequence[Path] = ()) -> Iterator[Path]:
    """A path beside `out` to write a file or a folder to; at the end of the block it moves to `out`.

    Files of the same names are replaced, and those that an older answer or program left removed: a record
    solution.json gets the names of all files beside it, about.json has them. Whatever the block raises,
    nothing has changed. Raises InputError if `out` is no regular file or folder, is of the other kind, is one
    of the inputs, or cannot be written. The block only writes.
    """
    refuse_unwritable(out, inputs)
    try:
        target = resolved(out)
        target.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=target.parent, prefix=".rivetbench.") as folder:
            new = Path(folder) / target.name
            yield new
            if target.exists() and new.is_dir() != target.is_dir():
                kind = "folder" if new.is_dir() else "file"
                allowed = f"a {kind} is to be written, and this is none"
                raise InputError.one("--out", "path", str(out), allowed)
            if new.is_dir():
                _record_files(new / RECORD)
                refuse_inputs([*(out / path.name for path in new.iterdir()), *_listed(target)], inputs)
                target.mkdir(exist_ok=True)
                for path in _listed(target):
                    path.unlink(missing_ok=True)
                for path in new.iterdir():
                    path.replace(target / path.name)
            else:
                new.replace(target)
    except OSError as error:
        raise _unwritable("--out", out, error.strerror or str(error)) from error


def _record_files(record: Path) -> None:
    """Put the names of all files beside an answer's record into it, under `files`."""
    if record.exists():
        names = sorted(path.name for path in record.parent.iterdir())
        replace_text(record, to_line(json.loads(record.read_text("utf-8")) | {"files": names}) + "\n")


def _listed(folder: Path) -> set[Path]:
    """The files that its records name; none, if there is none to be read."""
    names = [*_names(folder / RECORD, []), *_names(folder / PROGRAM, EXPORTED)]
    return {folder / name for name in names if Path(name).name == name}


def _names(record: Path, older: list[str]) -> list[str]:
    """The names of files in a record. older : those of a record that lists none."""
    try:
        content = parsed(record.read_bytes())
        ours = record.name == RECORD or {"scene_key", "form"} <= content.keys()
        return [*map(os.fspath, content.get("files", older))] if ours else []
    except (OSError, ValueError, TypeError):
        return []


def refuse_unwritable(out: Path, inputs: Sequence[Path] = (), option: str = "--out") -> None:
    """Raise InputError, before long work, if `out` may not be written or is one of the inputs."""
    refuse_inputs([out], inputs, option)
    target = resolved(out)
    if not target.name:
        raise _unwritable(option, out, "it needs a name")
    folder = next(each for each in target.parents if each.exists())
    if not folder.is_dir():
        raise _unwritable(option, out, f"{folder} is no folder")
    for path in (folder, *([target] if target.is_dir() else [])):
        if not os.access(path, os.W_OK | os.X_OK):
            raise _unwritable(option, out, f"no permission to write to {path}")


def _unwritable(option: str, out: Path, why: str) -> InputError:
    return InputError.one(option, "path", str(out), f"cannot be written: {why}")


def refuse_outputs(outputs: Mapping[str, Path | None], inputs: Sequence[Path]) -> None:
    """Raise InputError if an option's file may not be written, is one of the inputs, or another's file."""
    files: dict[str, Path] = {}
    for option, path in outputs.items():
        if path is not None:
            refuse_unwritable(path, inputs, option)
            if path.is_dir():
                raise _unwritable(option, path, "it is a folder")
            for other in (name for name, earlier in files.items() if _is_same(path, earlier)):
                raise InputError.one(option, "path", str(path), f"is the file of {other}: name another")
            files[option] = path


def refuse_inputs(targets: Sequence[Path], inputs: Sequence[Path], option: str = "--out") -> None:
    """Raise InputError if one of the targets is one of the inputs, or neither a file nor a folder."""
    for path in targets:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise InputError.one(option, "path", str(path), "no regular file: name another")
        if any(_is_same(path, other) for other in inputs):
            raise InputError.one(option, "path", str(path), "is one of the files that are read: name another")


def refuse_changed(files: Iterable[Path], before: Mapping[str, str]) -> None:
    """Raise InputError if one of the files is another than it was. before : their `fingerprints`."""
    for name, digits in fingerprints(files).items():
        if digits != before[name]:
            raise InputError.one(name, "content", "changed meanwhile", "that of the beginning: run again")


def _is_same(one: Path, other: Path) -> bool:
    """Whether two paths are of one file, there or not, through links and relative spellings."""
    return resolved(one) == resolved(other) or (one.exists() and other.exists() and one.samefile(other))
