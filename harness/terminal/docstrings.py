"""Docstrings that are shown to a person, also under `python -OO`, which drops them."""

import ast
import inspect
from collections.abc import Callable
from typing import Any


def docstring(thing: Callable[..., Any]) -> str:
    """The docstring of a function or class, from its source where Python has dropped it."""
    if thing.__doc__:
        return inspect.cleandoc(thing.__doc__)
    (definition,) = ast.parse(inspect.getsource(thing)).body
    return ast.get_docstring(definition) or ""  # type: ignore[arg-type]
