"""Errors that users can correct: each names the file, the key, the value and what is allowed."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any, Self, TypeVar

CONTROL = re.compile("[\0-\x1f\x7f]")
In = TypeVar("In")
Out = TypeVar("Out")
#: A hint for "parts\\top.npz" in a TOML file, which is a tab and op.npz.
BACKSLASH = "; a backslash in TOML's double quotes begins an escape: write /, or single quotes"


@dataclass(frozen=True)
class Fault:
    """One error in an input.

    where : the file or argument. key : the entry in it. value : what it has. allowed : the valid values.
    """

    where: str
    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        value = repr(self.value)
        value = value if len(value) <= 80 else value[:77] + "..."
        where = CONTROL.sub(lambda found: repr(found[0])[1:-1], self.where)
        path = str(self.value) if re.search("no such file|a path", self.allowed) else self.where
        hint = BACKSLASH if CONTROL.search(path) else ""
        return f"{where}: {self.key} = {value}: {self.allowed}{hint}"


class InputError(ValueError):
    """All faults of an input, together.

    Parameters
    ----------
    faults : list of Fault
        Each with `where`, the file or argument; `key`, the entry in it; its `value`; and what is `allowed`.

    Examples
    --------
    >>> from rivetbench import InputError, load_scene
    >>> try:
    ...     load_scene("galery/three-part-stack")
    ... except InputError as error:
    ...     print(error.faults[0].value)
    galery/three-part-stack
    """

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = list(faults)
        super().__init__("\n".join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type[Self], tuple[list[Fault]]]:
        """From a worker it comes with its faults, not with the text that ValueError was given."""
        return type(self), (self.faults,)

    def in_stage(self, name: str) -> "InputError":
        """The same faults, of a stage; without a name, of a scene that has none."""
        where = f", in stage {name}" if name else ""
        return InputError([replace(fault, key=f"{fault.key}{where}") for fault in self.faults])

    @classmethod
    def one(cls, where: object, key: str, value: object, allowed: str) -> "InputError":
        return cls([Fault(str(where), key, value, allowed)])


def refuse_text(where: str, **lists: object) -> None:
    """Raise InputError for each text in place of a list, whose letters would be taken for the entries."""
    allowed = "a list of texts, not one text"
    if faults := [Fault(where, name, text, allowed) for name, text in lists.items() if isinstance(text, str)]:
        raise InputError(faults)


def number_faults(**numbers: tuple[Any, ...]) -> list[Fault]:
    """A fault for each option that is given and no whole number: its value, the least, perhaps the most."""
    return [
        Fault(f"--{name}", name, value, f"a whole number, at least {', at most '.join(map(str, limits))}")
        for name, (value, *limits) in numbers.items()
        if value is not None
        and not (isinstance(value, Integral) and limits[0] <= value <= max(limits[1:], default=value))
    ]


def read_all(read: Callable[[In], Out], inputs: Iterable[In]) -> list[Out]:
    """The result of `read` for each input. Raises InputError with the faults of all."""
    results: list[Out] = []
    faults: list[Fault] = []
    for one in inputs:
        try:
            results.append(read(one))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    return results
