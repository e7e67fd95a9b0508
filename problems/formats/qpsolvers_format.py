"""qpsolvers' own problem file: P = K, q = −f, G = Aᵀ, h = g."""

from __future__ import annotations

from pathlib import Path

from problems.errors import InputError
from problems.formats import Data

from . import npz_format

DESCRIPTION = "a file .npz that qpsolvers.Problem.load reads, bit for bit"
SUFFIXES = (".npz",)


def accepts(path: Path) -> bool:
    return not npz_format.accepts(path)


def write(path: Path, data: Data) -> None:
    import qpsolvers

    G = data["A"].T.toarray()
    with path.open("wb") as file:
        qpsolvers.Problem(data["K"].toarray(), -data["f"], G, data["g"]).save(file)


def read(path: Path) -> Data:
    import qpsolvers

    found = qpsolvers.Problem.load(str(path))
    for name in ("A", "b", "lb", "ub"):
        if getattr(found, name) is not None:
            allowed = "contact problems have no equality constraints and no bounds on x"
            raise InputError.one(path, name, "present", allowed)
    return {"K": found.P, "f": -found.q, "A": found.G.T, "g": found.h}
