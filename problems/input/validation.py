"""Validation errors of pydantic as faults, with the unit and what is allowed."""

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from problems.errors import Fault

#: Tags of what may be a value or a word, such as "auto"; left out of the keys in messages.
VALUE, WORD = "a value", "a word"


def validation_faults(
    where: object, model: type[BaseModel], error: ValidationError, prefix: str = ""
) -> Iterator[Fault]:
    """The faults of a table that is not a valid `model`, each with the unit its key is annotated with."""
    items = error.errors()
    for item in items:
        depth = len(item["loc"])
        if any(len(other["loc"]) > depth and other["loc"][:depth] == item["loc"] for other in items):
            continue  # a consequence of a fault inside it
        key = ".".join(
            filter(None, [prefix, *(str(part) for part in item["loc"] if part not in (VALUE, WORD))])
        )
        value = None if item["type"] == "missing" else item["input"]
        unit = _unit(model, item["loc"])
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
            fields = _table(model, above).model_fields
            return unknown("key", key, [field.alias or name for name, field in fields.items()])
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


def _unit(model: type[BaseModel], path: Sequence[object]) -> str | None:
    """The unit of what is at a path inside a model: the innermost that is given."""
    for k in reversed(range(len(path))):
        if field := _table(model, path[:k]).model_fields.get(str(path[k])):
            return next((unit for unit in field.metadata if isinstance(unit, str)), None)
    return None


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_model_in, get_args(annotation))), None)
