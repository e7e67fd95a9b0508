"""Ladders: problems that grow harder rung by rung, to see where a solver breaks and whether it says so.

A ladder is a file of problems/ladders with RUNGS, its rungs by name, the easiest first; each is a function
that makes one, the same at every call. A rung is a scene, `hard/<ladder>/<rung>`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from problems.forms.made import Made
from problems.model.effect import Effect, effect_class
from problems.model.joint import Joint

PREFIX = "hard/"


@dataclass(frozen=True, eq=False)
class Rung:
    """A joint with its effects, or what was made in its place.

    refused : words of the InputError by which the model refuses the problem; "" where it takes it.
    """

    title: str
    joint: Joint | None = None
    effects: tuple[Effect, ...] = ()
    made: Made | None = None
    refused: str = ""


def plates(title: str, joint: dict[str, Any], *effects: dict[str, Any], refused: str = "") -> Rung:
    """A rung of plates: the tables of a scene's file."""
    checked = tuple(effect_class(table["kind"]).model_validate(table) for table in effects)
    return Rung(title, Joint.model_validate(joint), checked, refused=refused)


Ladder = Mapping[str, Callable[[], Rung]]


def ladder_names() -> list[str]:
    """The ladders: the files of problems/ladders."""
    package = importlib.import_module("problems.ladders")
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def rung_names() -> list[str]:
    """All rungs, ladder by ladder, the easiest of each first."""
    return [f"{PREFIX}{ladder}/{rung}" for ladder in ladder_names() for rung in _rungs(ladder)]


@cache
def make_rung(name: str) -> Rung:
    """The rung of a name out of `rung_names`."""
    ladder, rung = name.removeprefix(PREFIX).split("/")
    return _rungs(ladder)[rung]()


def _rungs(ladder: str) -> Ladder:
    rungs: Ladder = importlib.import_module(f"problems.ladders.{ladder}").RUNGS
    return rungs
