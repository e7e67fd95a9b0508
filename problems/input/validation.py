"""Validation errors of pydantic as faults, with the unit and what is allowed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from problems.errors import Fault

#: Units of the keys of joints and stiffeners; an effect gives those of its own parameters.
UNITS = {
    **dict.fromkeys(["length", "width", "thickness", "points", "lines", "pitch", "start", "stop"], "mm"),
    **dict.fromkeys(["I", "J"], "mm⁴"),
    **dict.fromkeys(["young", "value"], "N/mm²"),
    "stiffness_per_point": "N/mm",
}
#: Tags of what may be a value or a word, such as "auto"; left out of the keys in messages.
VALUE, WORD = "a value", "a word"
NO_UNITS: Mapping[str, str] = MappingProxyType({})


def validation_faults(
    where: object,
    model: type[BaseModel],
    error: ValidationError,
    prefix: str = "",
    units: Mapping[str, str] = NO_UNITS,
) -> Iterator[Fault]:
    """The faults of a table that is not a valid `model`. units : of the keys that have one."""
    items = error.errors()
    for item in items:
        depth = len(item["loc"])
        if any(len(other["loc"]) > depth and other["loc"][:depth] == item["loc"] for other in items):
            continue  # a consequence of a fault inside it
        key = ".".join(
            filter(None, [prefix, *(str(part) for part in item["loc"] if part not in (VALUE, WORD))])
        )
        value = None if item["type"] == "missing" else item["input"]
        unit = next((units[str(part)] for part in reversed(item["loc"]) if part in units), None)
        allowed = _allowed(item, model)
        yield Fault(str(where), key or "file", value, f"{allowed}; in {unit}" if unit else allowed)


def is_word(value: object) -> str:
    """The tag of a value."""
    return WORD if isinstance(value, str) else VALUE


def unknown(kind: str, value: object, known: Sequence[str]) -> str:
    """The message for an unknown name: similar names, and all that are allowed."""
    similar = get_close_matches(str(value), known, 3)
    suggestion = f"did you mean {' or '.join(similar)}? " if similar else ""
    return f"no such {kind}; {suggestion}allowed: {', '.join(known)}"


def _allowed(item: Any, model: type[BaseModel]) -> str:
    match item["type"]:
        case "extra_forbidden":
            *above, key = item["loc"]
            return unknown("key", key, list(_table(model, above).model_fields))
        case "missing":
            return "required"
        case "too_short" | "too_long" as wrong:
            limit = item["ctx"]["min_length" if wrong == "too_short" else "max_length"]
            return f"must have at {'least' if wrong == 'too_short' else 'most'} {limit} entries"
        case "model_type" | "model_attributes_type":
            return "must be a table"
    return re.sub("^(Input|String) should", "must", item["msg"].removeprefix("Value error, "))


def _table(model: type[BaseModel], path: Sequence[object]) -> type[BaseModel]:
    """The model of the table at a path inside a model."""
    for key in path:
        if key in model.model_fields:
            model = _model_in(model.model_fields[str(key)].annotation) or model
    return model


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_model_in, get_args(annotation))), None)
