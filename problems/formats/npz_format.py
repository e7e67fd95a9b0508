"""NumPy's .npz with arrays K, A, f, g and optionally nodes: the format that scenes open."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from problems.formats import NAMES, Data

DESCRIPTION = "a file .npz, bit for bit"
SUFFIXES = (".npz",)


def accepts(path: Path) -> bool:
    with np.load(path) as archive:
        return "P" not in archive.files  # which qpsolvers' have


def write(path: Path, data: Data) -> None:
    dense = {name: data[name].toarray() for name in "KA"}
    with path.open("wb") as file:
        np.savez(file, **(data | dense))


def read(path: Path) -> Data:
    with np.load(path) as archive:
        return {name: archive[name] for name in NAMES if name in archive.files}
