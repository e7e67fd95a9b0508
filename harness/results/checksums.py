"""The checksums of a results or series directory: a damaged file is refused by name, or made again.

    measurements.jsonl, cases.jsonl, …   each row has the field `crc32`, so a file stays whole as it grows
    machine.json, series.json            the same field of the one object
    suite.toml                           a first line with the CRC-32 of the bytes below it
    gaps.f4                              `gaps_crc32` of its case's row
    *.npz                                the comment of the zip file: the CRC-32 of the bytes before it
    report/                              none; `report` writes it anew

The checksum of an object is the CRC-32 of its other fields as JSON with sorted keys: it is of the values, not
of their layout. What older versions wrote has no checksum and is accepted without one.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Mapping
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .schema import CRC

Content = dict[str, Any]

DAMAGED = "not what was written: its checksum differs"
COMMENT = re.compile(rb"crc32 ([0-9a-f]{8})\Z")
LENGTH = 2  # bytes at the end of a zip file that give the length of the comment after them
HEADER = re.compile(rb"# crc32 ([0-9a-f]{8}) of the lines below\n")


class Damaged(ValueError):
    """An object or a text is not what was written."""

    def __init__(self) -> None:
        super().__init__(DAMAGED)


def crc_of(content: bytes) -> str:
    return f"{zlib.crc32(content):08x}"


def _crc_of(content: Content) -> str:
    return crc_of(json.dumps(content, sort_keys=True).encode())


def sealed(content: Content) -> Content:
    """The plain JSON object with its checksum, which replaces an earlier one."""
    bare = {name: value for name, value in content.items() if name != CRC}
    return bare | {CRC: _crc_of(bare)}


def parsed(text: str | bytes) -> Content:
    """The JSON object without its checksum. Raises ValueError if it is none, Damaged if it was changed."""
    try:
        content = json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deep") from error
    if not isinstance(content, dict):
        raise ValueError("not a JSON object")
    if CRC in content and content.pop(CRC) != _crc_of(content):
        raise Damaged
    return content


def with_arrays(arrays: Mapping[str, Any]) -> bytes:
    """The content of a .npz file with its checksum."""
    file = BytesIO()
    np.savez(file, **arrays)
    content = file.getvalue()[:-LENGTH]
    comment = f"crc32 {crc_of(content)}".encode()
    return content + len(comment).to_bytes(LENGTH, "little") + comment


def arrays_in(content: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of a .npz file. Raises ValueError if it is none, Damaged if it was changed."""
    comment = COMMENT.search(content)
    if comment and comment[1].decode() != crc_of(content[: comment.start() - LENGTH]):
        raise Damaged
    try:
        with np.load(BytesIO(content)) as file:
            arrays = dict(file)
    except Exception as error:  # numpy, zipfile and zlib raise kinds of their own
        raise ValueError(f"not a .npz file: {error}") from error
    if not all(isinstance(array, np.ndarray) for array in arrays.values()):
        raise ValueError("not a .npz file: a member is no array")
    return arrays


def with_header(text: str) -> str:
    """A text with its checksum as a first line, a comment in TOML.

    The empty line below it is for a header whose line end is damaged: it would hide the first key.
    """
    text = "\n" + text
    return f"# crc32 {crc_of(text.encode())} of the lines below\n{text}"


def refuse_changed(content: bytes) -> None:
    """Raise Damaged if the text has a checksum and was changed."""
    header = HEADER.match(content)
    if header and header[1].decode() != crc_of(content[header.end() :]):
        raise Damaged
