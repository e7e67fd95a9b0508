"""Ladders: problems that grow harder rung by rung, to see where a solver fails and whether it reports that.

A rung is a scene. Each file of this folder may have some of four tables of ladders by name; a ladder is a
table of rungs by name, the easiest first, and a rung is a function that makes the same scene at every call:

    RUNGS        hard/<ladder>/<rung>
    FULL_SIZE    hard-full/<ladder>/<n>-<rung>, at the sizes of the paper: n = 4386, 6112 and 11308
    OUTSIDE      outside/<problem>/<size>, problems that others wrote, with printed optima
    SPARSE       sparse/<family>/<n>-<k>, sparse problems of n unknowns, drawn anew for each version
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

from problems.model.scene import ManufacturedScene, Scene

#: The beginning of scenes' names → the name of their table in a file.
PREFIXES = {"hard/": "RUNGS", "hard-full/": "FULL_SIZE", "outside/": "OUTSIDE", "sparse/": "SPARSE"}
LADDERS = ("hard/", "hard-full/")  # whose limit follows their conditioning

Ladder = Mapping[str, Callable[[], Scene]]

#: Makes a rung of matrices from its title and its problem; the ladder gives it its name.
matrices = ManufacturedScene.of


@cache
def ladders(prefix: str) -> dict[str, Ladder]:
    """All ladders of a prefix by name."""
    names = (f"{__name__}.{module.name}" for module in pkgutil.iter_modules(__path__))
    files = map(importlib.import_module, names)
    return dict(sorted(pair for file in files for pair in getattr(file, PREFIXES[prefix], {}).items()))


def rung_names(prefix: str) -> list[str]:
    """All rungs of a prefix, ladder by ladder, the easiest of each first."""
    return [f"{prefix}{ladder}/{rung}" for ladder, rungs in ladders(prefix).items() for rung in rungs]


def prefix_of(name: str) -> str | None:
    """The prefix of a rung's name; None if the name is not one of a rung."""
    return next((prefix for prefix in PREFIXES if name.startswith(prefix)), None)


@cache
def make_rung(name: str) -> Scene:
    """The rung with a name of `rung_names`."""
    folder, ladder, rung = name.split("/")
    prefix = f"{folder}/"
    made = ladders(prefix)[ladder][rung]()
    size = f", n = {rung.partition('-')[0]}" if prefix == "hard-full/" else ""
    return replace(made, name=name, title=made.title + size, on_ladder=prefix in LADDERS)
