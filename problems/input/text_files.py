"""Reads text from any program: compressed or not, with any line ends; the encoding is checked first.

A file is UTF-8, with or without a byte order mark, or gzip of that; old line ends become \\n. UTF-16 and
UTF-32 are refused by name. Where only headings and comments can hold foreign letters, bytes that are not
UTF-8 are read as Windows-1252.
"""

import codecs
import gzip
import zlib
from itertools import islice
from pathlib import Path

from problems.errors import InputError

from .bounded_types import MIB, regular_file

FOREIGN = "cp1252"
WIDE = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}
START = 64  # bytes in which UTF-16 without a mark shows


def read_bytes(path: Path, key: str, mib: float) -> bytes:
    """The bytes of a text file, decompressed, without a byte order mark, lines ended by \\n.

    key, mib : see `regular_file`. Raises InputError.
    """
    try:
        content = regular_file(path, key, mib).read_bytes()
        if content.startswith(b"\x1f\x8b"):
            with gzip.open(path) as file:
                content = b"".join(islice(iter(lambda: file.read(MIB), b""), int(mib) + 1))
    except (OSError, EOFError, zlib.error) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError.one(path, key, why, "a readable file") from error
    if len(content) > mib * MIB:
        raise InputError.one(path, key, "too much inside", f"at most {mib:g} MiB when decompressed")
    start = content[:START]
    wide = next((name for mark, name in WIDE.items() if start.startswith(mark)), None)
    if not wide and len(start) > 3 and (not any(start[::2]) or not any(start[1::2])):
        wide = "UTF-16"
    if wide:
        raise InputError.one(path, key, f"{wide} text", "text in UTF-8: save it so")
    return content.removeprefix(codecs.BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def read_text(path: Path, key: str, mib: float, strict: bool = False) -> str:
    """The text of a file. strict : whether bytes that are not UTF-8 are refused, with their line.

    Raises InputError.
    """
    content = read_bytes(path, key, mib)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        if not strict:
            return content.decode(FOREIGN, errors="replace")
        line = content.count(b"\n", 0, error.start) + 1
        wrong = ascii(content[error.start : error.start + 1].decode("latin-1"))
        allowed = "text in UTF-8: save it so"
        raise InputError.one(path, f"line {line}", f"byte {wrong[1:-1]}, not UTF-8", allowed) from error
