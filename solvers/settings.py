"""Options of a method, and settings of a library that a user may choose, as OSQP's scaling."""

from collections.abc import Collection, Mapping
from typing import Any

from problems.errors import Fault, InputError
from problems.input.bounded import unknown

#: Beginnings of what the adapters decide: accuracy, limits, output.
STOPPING = ("eps", "tol", "reduced_tol", "max_iter", "check_du", "time", "compute_timings")
DECIDED = (*STOPPING, "verbose", "max_threads", "num_threads", "warm_start", "initial_guess")


def require(solver: str, options: Mapping[str, object], **rules: tuple[bool, str]) -> None:
    """Raises InputError, all faults at once. rules : by option, whether its value is allowed, and what is."""
    faults = [
        Fault(f"solver {solver}", f"options.{key}", options[key], allowed)
        for key, (holds, allowed) in rules.items()
        if not holds
    ]
    if faults:
        raise InputError(faults)


def one_of(value: object, allowed: Collection[object]) -> tuple[bool, str]:
    """A rule: `value` is one of `allowed`, of the same type (1 is not True)."""
    found = any(type(value) is type(good) and value == good for good in allowed)
    return found, f"must be one of {', '.join(map(repr, allowed))}"


def chosen(solver: str, given: Mapping[str, object], settings: object) -> dict[str, Any]:
    """The settings given. settings : the library's own, at their defaults, on which they are tried.

    Raises InputError, all faults at once.
    """
    known = {
        name: value
        for name in dir(settings)
        if not name.startswith(("_", *DECIDED))
        and isinstance(value := getattr(settings, name), bool | int | float | str)
    }
    require(solver, given, **{name: _of_its_type(name, value, known) for name, value in given.items()})
    apply(settings, given)
    return dict(given)


def apply(settings: Any, given: Mapping[str, object]) -> None:
    """Set them on the library's settings."""
    for name, value in given.items():
        setattr(settings, name, value)


def _of_its_type(name: str, value: object, known: Mapping[str, object]) -> tuple[bool, str]:
    if name not in known:
        return False, unknown("option", name, sorted(known))
    kind = type(known[name])
    # bool is an int, and an int a float where one is meant.
    fits = type(value) is kind or (kind is float and type(value) is int)
    return fits, f"must be of the type of its default {known[name]!r}"
