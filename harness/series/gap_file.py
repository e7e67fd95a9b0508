"""gaps.f4: the final gaps of a series, case k at the bytes 4km … 4(k + 1)m."""

from __future__ import annotations

import os
import zlib
from collections.abc import Sequence
from io import BytesIO
from math import inf
from pathlib import Path

import numpy as np

from harness.results import records
from harness.results.schema import GAPS
from problems.input.bounded import regular_file

from .session import Gaps

CRC = "gaps_crc32"  # of a row
BYTES = np.dtype(np.float32).itemsize


class GapFile:
    """The file, to compare with the rows."""

    def __init__(self, directory: Path, m: int) -> None:
        self.path, self.size = directory / GAPS, m * BYTES

    def __enter__(self) -> GapFile:
        self.file = self.path.open("rb") if self.path.is_file() else BytesIO()
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def whole(self, row: records.Row, older: bool = False) -> bool:
        """Whether a row's gaps are there and are those that were written with it.

        older : a row without a checksum, as older versions wrote them, only has to have gaps.
        """
        if row["verdict"] == "no_answer":
            return True
        self.file.seek(row["case"] * self.size)
        found = self.file.read(self.size)
        return len(found) == self.size and ((older and CRC not in row) or row.get(CRC) == zlib.crc32(found))


def checksum(gap: Gaps) -> int:
    return zlib.crc32(gap.tobytes())


def write_gaps(directory: Path, gaps: Sequence[tuple[int, Gaps | None]], m: int) -> None:
    """Write and sync (case, gap), gap (m,); None is left out. Raises InputError if it is no regular file."""
    path = directory / GAPS
    if all(gap is None for _, gap in gaps):
        return
    if path.exists():
        regular_file(path, "content", inf)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        for case, gap in gaps:
            if gap is not None:
                os.pwrite(descriptor, gap.tobytes(), case * m * BYTES)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
