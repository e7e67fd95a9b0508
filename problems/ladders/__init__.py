"""Ladders: problems that grow harder rung by rung, to see where a solver fails and whether it reports that.

A rung is a scene, `hard/<ladder>/<rung>`. A file of this folder has RUNGS, ladders by name, of each its rungs
by name, the easiest first: functions that make the same rung at every call. Those in FULL_SIZE, where a file
has it, are `hard-full/<ladder>/<n>-<rung>`, at the sizes of the paper: n = 4386, 6112 and 11308. Problems of
others, with printed optima, are in OUTSIDE, `outside/<problem>/<size>`.
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

from problems.model.scene import ManufacturedScene, Scene

#: What the ladders whose scenes' names begin so are called in a file.
PREFIXES = {"hard/": "RUNGS", "hard-full/": "FULL_SIZE", "outside/": "OUTSIDE"}
LADDERS = ("hard/", "hard-full/")  # whose limit follows their conditioning

Ladder = Mapping[str, Callable[[], Scene]]

#: A rung of matrices, from its title and its problem. It has no name of its own: the ladder names it.
matrices = ManufacturedScene.of


@cache
def ladders(prefix: str) -> dict[str, Ladder]:
    """All ladders of a prefix by name."""
    files = (
        importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)
    )
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
