"""Checks of the options of a method, and of the settings of a library that a user may choose."""

from collections.abc import Collection, Mapping
from typing import Any

from problems.errors import Fault, InputError
from problems.input.bounded_types import unknown

NO_OPTIONS = "this solver takes no options"
#: Beginnings of the settings that the adapters decide: accuracy, limits, output.
STOPPING = ("eps", "tol", "reduced_tol", "max_iter", "check_du", "time", "compute_timings")
DECIDED = (*STOPPING, "verbose", "max_threads", "num_threads", "warm_start", "initial_guess")


def require(solver: str, options: Mapping[str, object], **rules: tuple[bool, str]) -> None:
    """Raises InputError, all faults at once, for options whose value is not allowed.

    rules : by option, whether its value is allowed, and the words for what is.
    """
    faults = [
        Fault(f"solver {solver}", f"options.{key}", options[key], allowed)
        for key, (holds, allowed) in rules.items()
        if not holds
    ]
    if faults:
        raise InputError(faults)


def one_of(value: object, allowed: Collection[object]) -> tuple[bool, str]:
    """A rule of `require`: `value` is one of `allowed`, of the same type (1 is not True)."""
    holds = any(type(value) is type(good) and value == good for good in allowed)
    return holds, f"must be one of {', '.join(map(repr, allowed))}"


def library_settings(solver: str, options: Mapping[str, object], settings: object) -> dict[str, Any]:
    """The options, each checked against the library's setting of that name and its default's type.

    settings : the library's own, at their defaults. Raises InputError, all faults at once.
    """
    defaults = {
        name: value
        for name in dir(settings)
        if not name.startswith(("_", *DECIDED))
        and isinstance(value := getattr(settings, name), bool | int | float | str)
    }
    require(solver, options, **{name: _of_its_type(name, value, defaults) for name, value in options.items()})
    apply(settings, options)  # the library may refuse a value
    return dict(options)


def apply(settings: Any, options: Mapping[str, object]) -> None:
    """Set the options on the library's settings."""
    for name, value in options.items():
        setattr(settings, name, value)


def _of_its_type(name: str, value: object, defaults: Mapping[str, object]) -> tuple[bool, str]:
    if name not in defaults:
        return False, unknown("option", name, sorted(defaults))
    kind = type(defaults[name])
    # bool is an int, and an int a float where one is meant.
    fits = type(value) is kind or (kind is float and type(value) is int)
    return fits, f"must be of the type of its default {defaults[name]!r}"
