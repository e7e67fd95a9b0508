"""Reads distributions: normal(1000, 100), lognorm(s=0.1, scale=1000), with the parameters of scipy.stats."""

import ast
from typing import Any

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import unknown

SYNTAX = (
    "[each] NAME(PARAMETERS) of scipy.stats, as in normal(1000, 100), or N of it, as in 8 of normal(5, 1)"
)
TAIL = 1e-9  # rarer values are not drawn: whether a key allows all is then known beforehand


@np.errstate(invalid="ignore")
def distribution(text: str) -> Any:
    """A continuous distribution of scipy.stats with its parameters. Raises ValueError, which says why not."""
    from scipy import stats  # slow to import: only where an input is random

    try:
        call: Any = ast.parse(text.strip(), mode="eval").body
        name = {"normal": "norm"}.get(call.func.id, call.func.id)
        values = [float(ast.literal_eval(value)) for value in call.args]
        named = {str(one.arg): float(ast.literal_eval(one.value)) for one in call.keywords}
        if len(named) < len(call.keywords):
            raise ValueError("a parameter twice")
    except (SyntaxError, ValueError, TypeError, AttributeError, RecursionError, MemoryError) as error:
        raise ValueError(SYNTAX) from error
    continuous = {key: value for key, value in vars(stats).items() if isinstance(value, stats.rv_continuous)}
    if name not in continuous:
        raise ValueError(unknown("distribution", name, sorted(continuous)))
    order = ", ".join([*filter(None, [continuous[name].shapes]), "loc=0", "scale=1"])
    try:
        frozen = continuous[name](*values, **named)
        if not np.isfinite(values_at(frozen, np.array([0.0, 0.5, 1.0]))).all():
            raise TypeError(order)
    except Exception as error:  # scipy raises kinds of its own
        allowed = "all finite, a scale above 0, shapes that it is for and has quantiles of"
        raise ValueError(f"{name}({order}), {allowed}") from error
    return frozen


def values_at(frozen: Any, shares: Vector) -> Vector:
    """The values (k,) at these shares, 0 to 1, of a distribution without its rarest TAIL at either end."""
    return np.asarray(frozen.ppf(TAIL + (1 - 2 * TAIL) * shares))
