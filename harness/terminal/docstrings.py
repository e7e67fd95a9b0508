"""Docstrings that are shown to a person, also under `python -OO`, which drops them."""

import ast
import inspect
from collections.abc import Callable
from typing import Any


def docstring(thing: Callable[..., Any]) -> str:
    """The docstring of a function or class, from its source where Python has dropped it."""
    if thing.__doc__:
        return inspect.cleandoc(thing.__doc__)
    source = inspect.getsource(thing)
    tree = compile(source, "docstring", "exec", ast.PyCF_ONLY_AST, optimize=0)  # Python 3.14 drops it else
    return ast.get_docstring(tree.body[0]) or ""  # type: ignore[attr-defined]
