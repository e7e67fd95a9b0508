"""Nastran's OUTPUT4 by pyyeti: matrices k, a, f, g; text or binary is read, binary is written."""

import re
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.input.matrix_entries import mirrored, one_sided
from problems.input.matrix_files import LARGEST_MIB, Choose
from problems.input.text_files import WIDE, read_bytes

OF_PROBLEM = {"F": "f", "G": "g"}
RECTANGULAR, SYMMETRIC = 2, 6  # forms; of the latter some programs write one triangle
GZIP = b"\x1f\x8b"
HEADER = re.compile(r"(.{24,}?\d[ED])(\d+)(\.\d+.*)", re.IGNORECASE)  # of a matrix: the width of its numbers
WITHOUT_LETTER = re.compile(r"(\d\.?)([-+]\d+)$")


def pyyeti(path: Path) -> Any:
    """pyyeti.nastran. Raises InputError if it is not installed."""
    try:
        with np.printoptions():  # which its import changes for good: text files would have 12 digits
            from pyyeti import nastran
    except ModuleNotFoundError:
        allowed = "Nastran's OUTPUT4 needs pyyeti: pip install 'rivetbench[nastran]'"
        raise InputError.one(path, "format", path.suffix, allowed) from None
    return nastran


def write_op4(path: Path, data: dict[str, Any]) -> None:
    """Write k, a, f, g in double precision; what is sparse in strings of its entries, the format BIGMAT."""
    matrices = {"k": data["K"], "a": data["A"], "f": data["f"][:, None], "g": data["g"][:, None]}
    forms = [SYMMETRIC, *[RECTANGULAR] * 3]  # of an almost symmetric A, pyyeti would say that it is
    pyyeti(path).op4.OP4().write(str(path), [*matrices], [*matrices.values()], binary=True, forms=forms)


def read_op4(path: Path, choose: Choose) -> dict[str, tuple[Any, np.ndarray | None]]:
    """Read the chosen matrices by name, in capitals. Raises InputError if two of a name differ."""
    reader = pyyeti(path).op4.OP4()
    # pyyeti renames what is no word of Python. Files of 64 bits have four blanks after each four letters.
    reader._check_name = lambda name: re.sub("[ \0]", "", name).upper()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")  # such as a premature end
        names, matrices, forms, _ = reader.load(str(_plain(path, Path(folder))), into="list", sparse=None)
    by_name: dict[str, Any] = {}
    for at, (written, M, form) in enumerate(zip(names, matrices, forms, strict=True)):
        name = OF_PROBLEM.get(written, written)
        if form == SYMMETRIC and one_sided(sp.csr_array(M)):
            M = mirrored(sp.csr_array(M))
        first = by_name.setdefault(name, M)
        if M is not first and (M.shape != first.shape or sp.coo_array(M - first).count_nonzero()):
            allowed = f"another {written} is before it, with other entries: each matrix needs its own name"
            raise InputError.one(path, f"matrix {at + 1} of {len(names)}", written, allowed)
    return {name: (by_name[name], None) for name in choose(list(by_name))}


def _plain(path: Path, folder: Path) -> Path:
    """A path that pyyeti reads: the binary file itself, or a copy of a text with E before each exponent."""
    with path.open("rb") as file:
        start = file.read(4)
    if start.count(0) > 2 and not start.startswith((GZIP, *WIDE)):  # two: UTF-16 without a mark
        return path
    content = read_bytes(path, "file", LARGEST_MIB)
    if 0 in content[:4]:
        raise InputError.one(path, "file", "compressed binary", "binary OUTPUT4 not compressed: gunzip it")
    copy, width, lines = folder / "text.op4", 0, []
    for line in content.decode("latin-1").split("\n"):
        if header := HEADER.fullmatch(line):
            width = int(header[2])
            line = f"{header[1]}{width + 1}{header[3]}"
        elif width and "." in line:
            words = [line[k : k + width].rstrip() for k in range(0, len(line.rstrip()), width)]
            line = "".join(WITHOUT_LETTER.sub(r"\1E\2", word).rjust(width + 1) for word in words)
        lines.append(line)
    copy.write_text("\n".join(lines), "latin-1", newline="\n")
    return copy
