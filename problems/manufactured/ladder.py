"""Ladders: problems that grow harder rung by rung, to see where a solver fails and whether it reports that.

A ladder is a file of problems/ladders with RUNGS, its rungs by name, the easiest first; each is a function
that makes the same rung at every call. A rung is a scene, `hard/<ladder>/<rung>`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from problems.forms.manufactured_problem import ManufacturedProblem
from problems.model.effect import Effect, effect_class
from problems.model.joint import Joint

PREFIX = "hard/"


@dataclass(frozen=True, eq=False)
class Rung:
    """A joint with its effects, or a manufactured problem instead.

    refused : part of the InputError with which the model refuses the problem; "" if it accepts it.
    """

    title: str
    joint: Joint | None = None
    effects: tuple[Effect, ...] = ()
    made: ManufacturedProblem | None = None
    refused: str = ""


def plates(title: str, joint: dict[str, Any], *effects: dict[str, Any], refused: str = "") -> Rung:
    """A rung of plates, from the tables of a scene file."""
    checked = tuple(effect_class(table["kind"]).model_validate(table) for table in effects)
    return Rung(title, Joint.model_validate(joint), checked, refused=refused)


Ladder = Mapping[str, Callable[[], Rung]]


def ladder_names() -> list[str]:
    """All ladders: the files of problems/ladders."""
    package = importlib.import_module("problems.ladders")
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def rung_names() -> list[str]:
    """All rungs, ladder by ladder, the easiest of each first."""
    return [f"{PREFIX}{ladder}/{rung}" for ladder in ladder_names() for rung in _rungs(ladder)]


@cache
def make_rung(name: str) -> Rung:
    """The rung with a name of `rung_names`."""
    ladder, rung = name.removeprefix(PREFIX).split("/")
    return _rungs(ladder)[rung]()


def _rungs(ladder: str) -> Ladder:
    rungs: Ladder = importlib.import_module(f"problems.ladders.{ladder}").RUNGS
    return rungs
