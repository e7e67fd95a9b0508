"""Ladders: problems that grow harder rung by rung, to see where a solver fails and whether it reports that.

A ladder is a file of problems/ladders with RUNGS, its rungs by name, the easiest first; each is a function
that makes the same rung at every call. A rung is a scene, `hard/<ladder>/<rung>`; those of
problems/ladders/full_size are `hard-full/<ladder>/<rung>`. The problems of others in problems/outside are
found likewise, `outside/<problem>/<size>`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from problems.forms.manufactured_problem import DeferredProblem, ManufacturedProblem
from problems.model.effect import Effect, effect_class
from problems.model.joint import Joint
from problems.model.scene import PrintedOptimum

#: The package of the ladders whose scenes' names begin so.
PACKAGES = {
    "hard/": "problems.ladders",
    "hard-full/": "problems.ladders.full_size",
    "outside/": "problems.outside",
}
LADDERS = ("hard/", "hard-full/")  # whose limit follows their conditioning
PREFIXES = tuple(PACKAGES)


@dataclass(frozen=True, eq=False)
class Rung:
    """A joint with its effects, or a manufactured problem instead, made or still to be made.

    refused : part of the InputError with which the model refuses the problem; "" if it accepts it.
    printed : the optimum that its source prints.
    """

    title: str
    joint: Joint | None = None
    effects: tuple[Effect, ...] = ()
    made: ManufacturedProblem | DeferredProblem | None = None
    refused: str = ""
    printed: PrintedOptimum | None = None


def plates(title: str, joint: dict[str, Any], *effects: dict[str, Any], refused: str = "") -> Rung:
    """A rung of plates, from the tables of a scene file."""
    checked = tuple(effect_class(table["kind"]).model_validate(table) for table in effects)
    return Rung(title, Joint.model_validate(joint), checked, refused=refused)


Ladder = Mapping[str, Callable[[], Rung]]


def ladder_names(prefix: str) -> list[str]:
    """All ladders of a prefix: the files of its package."""
    package = importlib.import_module(PACKAGES[prefix])
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__) if not module.ispkg)


def rung_names(prefix: str = PREFIXES[0]) -> list[str]:
    """All rungs of a prefix, ladder by ladder, the easiest of each first."""
    return [f"{prefix}{ladder}/{rung}" for ladder in ladder_names(prefix) for rung in _rungs(prefix, ladder)]


def prefix_of(name: str) -> str | None:
    """The prefix of a rung's name; None if the name is not one of a rung."""
    return next((prefix for prefix in PREFIXES if name.startswith(prefix)), None)


@cache
def make_rung(name: str) -> Rung:
    """The rung with a name of `rung_names`."""
    prefix, ladder, rung = name.split("/")
    return _rungs(f"{prefix}/", ladder)[rung]()


def _rungs(prefix: str, ladder: str) -> Ladder:
    rungs: Ladder = importlib.import_module(f"{PACKAGES[prefix]}.{ladder}").RUNGS
    return rungs
