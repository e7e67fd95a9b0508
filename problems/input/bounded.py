"""Numbers, names and files from outside, bounded by type: what no structure has is refused at the door."""

import os
import stat
from pathlib import Path
from typing import Annotated

from pydantic import Field, StringConstraints

from problems.errors import InputError

LARGEST = 1e15  # in mm, N and whatever is made of them
MIB = 2**20

Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
#: Seeds that every reader of JSON keeps exactly.
Seed = Annotated[int, Field(ge=0, lt=2**53)]
#: A name that a picture, a table and a file can show: one line without control characters.
ONE_LINE = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]+$"
Name = Annotated[str, StringConstraints(min_length=1, max_length=60, pattern=ONE_LINE)]


def resolved(path: Path) -> Path:
    """The absolute path without symbolic links; whoever opens it finds out if these have no end.

    Raises InputError.
    """
    try:
        return Path(os.path.realpath(path))
    except ValueError as error:
        raise InputError.one("path", "name", str(path), "a name without NUL") from error


def regular_file(path: Path, key: str, mib: float) -> Path:
    """The path, if it is a file of at most so many MiB; a pipe or a device would never end.

    Raises InputError.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        why = getattr(error, "strerror", None) or str(error)
        raise InputError.one(path, key, why, "a readable file") from error
    if not stat.S_ISREG(found.st_mode):
        raise InputError.one(path, key, "no regular file", "a readable file")
    if found.st_size > mib * MIB:
        raise InputError.one(path, key, f"{found.st_size / MIB:.0f} MiB", f"a file of at most {mib:g} MiB")
    return path
