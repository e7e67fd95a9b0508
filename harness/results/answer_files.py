"""The answers of a results directory: answers/NAME.npz, or the members of one answers.zip."""

import io
import zipfile
import zlib
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from problems.input.bounded_types import MIB

from . import records

ARCHIVE = "answers.zip"


def is_kept(path: Path) -> bool:
    """Whether there is DIR/answers/NAME.npz, or an archive that may have it."""
    return path.exists() or path.parent.with_name(ARCHIVE).is_file()


def read_answer(path: Path) -> dict[str, NDArray[Any]]:
    """x (n,) and lam (m,) of DIR/answers/NAME.npz; without that file, of that member of DIR/answers.zip.

    Raises OSError, ValueError or KeyError if there is none, or if it is damaged.
    """
    archive = path.parent.with_name(ARCHIVE)
    if path.exists() or not archive.is_file():
        return records.read_arrays(path)
    try:
        with zipfile.ZipFile(archive) as file:
            member = file.getinfo(path.name)
            if member.file_size > records.ARRAYS_MIB * MIB:
                raise ValueError(f"{path.name}: larger than {records.ARRAYS_MIB} MiB")
            return records.read_arrays(io.BytesIO(file.read(member)))
    except (zipfile.BadZipFile, zlib.error, RuntimeError, EOFError) as error:
        raise ValueError(f"{archive}: {error}") from error
