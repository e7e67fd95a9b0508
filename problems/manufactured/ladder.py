"""Ladders: problems that grow harder rung by rung, to see where a solver fails and whether it reports that.

A rung is a scene, `hard/<ladder>/<rung>`. A file of problems/ladders has RUNGS, ladders by name, of each its
rungs by name, the easiest first: functions that make the same rung at every call. Those in FULL_SIZE, where a
file has it, are `hard-full/<ladder>/<n>-<rung>`, at the sizes of the paper: n = 4386, 6112 and 11308. The
problems of others in problems/outside are found likewise, `outside/<problem>/<size>`.
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial

from problems.model.scene import ManufacturedScene, Scene

#: The package of the ladders whose scenes' names begin so, and what their rungs are called there.
PREFIXES = {
    "hard/": ("problems.ladders", "RUNGS"),
    "hard-full/": ("problems.ladders", "FULL_SIZE"),
    "outside/": ("problems.outside", "RUNGS"),
}
LADDERS = ("hard/", "hard-full/")  # whose limit follows their conditioning

Ladder = Mapping[str, Callable[[], Scene]]

#: A rung of matrices, from its title and its problem. It has no name of its own: the ladder names it.
matrices = partial(ManufacturedScene, "")


@cache
def ladders(prefix: str) -> dict[str, Ladder]:
    """All ladders of a prefix by name."""
    package, rungs = PREFIXES[prefix]
    names = [module.name for module in pkgutil.iter_modules(importlib.import_module(package).__path__)]
    files = (importlib.import_module(f"{package}.{name}") for name in names)
    return dict(sorted(pair for file in files for pair in getattr(file, rungs, {}).items()))


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
