"""Matrices in the formats of other programs: names of their files, and a small problem of two blocks."""

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.linalg as sla

from problems.formats import FORMATS

PATHS = {"npz": "p.npz", "op4": "p.op4", "dmig": "p.pch", "mtx": "m", "abaqus": "a"}

RNG = np.random.default_rng(11)
BASIS = RNG.standard_normal((4, 4))
K1 = BASIS @ BASIS.T + 4 * np.eye(4)
DATA: dict[str, Any] = {
    "K": sla.block_diag(K1, 3 * K1),
    "A": np.vstack([np.eye(4), -np.eye(4)]),
    "f": RNG.standard_normal(8),
    "g": np.array([0.1, 0.2, 0.0, -0.1]),
}


def files_of(form: str, path: Path) -> list[str]:
    folder = FORMATS[form].is_folder
    return [str(path / f"{name}.mtx") for name in "KAfg"] if folder else [str(path)]


def write_mtx(folder: Path, **changes: Any) -> Path:
    for key, value in (DATA | changes).items():
        scipy.io.mmwrite(folder / f"{key}.mtx", value[:, None] if value.ndim == 1 else value, precision=17)
    path = folder / "mine.toml"
    path.write_text("[matrices]\n" + "".join(f'{key} = "{key}.mtx"\n' for key in DATA))
    return path
