"""Types of numbers, names and files that users give, with bounds that every real structure keeps.

Whatever is out of bounds is refused in faults that name the unit and the allowed values.
"""

import os
import re
import stat
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, StringConstraints, ValidationError

from problems.errors import Fault, InputError

LARGEST = 1e15  # in mm, N and units made of them
MIB = 2**20  # bytes
M = TypeVar("M", bound=BaseModel)


def _no_other(value: object) -> object:
    if isinstance(value, str | bool):
        raise ValueError("must be a valid number")
    return value


#: The validator of a number: text and truth values are refused.
PLAIN = BeforeValidator(_no_other)
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False), PLAIN]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False), PLAIN]
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False), PLAIN]
#: A number of things, at least one.
Count = Annotated[int, Field(ge=1), PLAIN]
#: true or false; no word or number that stands for it.
Truth = Annotated[bool, Field(strict=True)]


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] < ends[1]:
        raise ValueError("must be start < stop")
    return ends


#: A length along an axis, from start to stop.
Range = Annotated[tuple[Finite, Finite], AfterValidator(_ascending)]
#: Seeds that every reader of JSON keeps exactly.
Seed = Annotated[int, Field(ge=0, lt=2**53), PLAIN]
#: A name that a picture, a table and a file can show: one line without control characters.
ONE_LINE = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]+$"
Name = Annotated[str, StringConstraints(min_length=1, max_length=60, pattern=ONE_LINE)]

#: Tags of a parameter that may be a value or a word, such as "auto"; left out of the keys in messages.
VALUE, WORD = "a value", "a word"
#: Tags of a parameter that may be a number or a list of numbers.
NUMBER, NUMBERS = "a number", "numbers"
TAGS = (VALUE, WORD, NUMBER, NUMBERS, "float", "list", "dict")  # the last ones of a JSON value


def resolved(path: Path) -> Path:
    """The absolute path without symbolic links, of a file that need not exist. Raises InputError."""
    try:
        return Path(os.path.realpath(path))
    except ValueError as error:
        raise InputError.one("path", "name", str(path), "a name without NUL") from error


def regular_file(path: Path, key: str, mib: float) -> Path:
    """The path, if it is a regular file of at most `mib` MiB; a pipe or a device might never end.

    Raises InputError, with `key` in its message.
    """
    try:
        facts = path.stat()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        why = getattr(error, "strerror", None) or str(error)
        raise InputError.one(path, key, why, "a readable file") from error
    if not stat.S_ISREG(facts.st_mode):
        raise InputError.one(path, key, "no regular file", "a readable file")
    if facts.st_size > mib * MIB:
        raise InputError.one(path, key, f"{facts.st_size / MIB:.0f} MiB", f"a file of at most {mib:g} MiB")
    return path


def validation_faults(
    where: object, model: type[BaseModel], error: ValidationError, prefix: str = ""
) -> Iterator[Fault]:
    """Yield the faults of a table that is not a valid `model`, each with the unit of its key."""
    items = error.errors()
    above = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    for item in items:
        if item["loc"] in above:
            continue  # a consequence of a fault inside it
        keys = [prefix, *(str(part) for part in item["loc"] if part not in TAGS)]
        key = ".".join(filter(None, keys))
        value = None if item["type"] == "missing" else item["input"]
        unit, allowed = _unit(model, item["loc"]), _allowed(item, model)
        yield Fault(str(where), key or "file", value, f"{allowed}; in {unit}" if unit else allowed)


def valid_table(
    model: type[M], table: object, where: object, faults: list[Fault], prefix: str = ""
) -> M | None:
    """The table as a `model`; None if it is none, which `faults` then says."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        faults += validation_faults(where, model, error, prefix)
        return None


def is_word(value: object) -> str:
    """The tag of a value: WORD for a string, else VALUE."""
    return WORD if isinstance(value, str) else VALUE


def is_list(value: object) -> str:
    """The tag of a value: NUMBERS for a list, else NUMBER."""
    return NUMBERS if isinstance(value, list | tuple) else NUMBER


def unknown(kind: str, value: object, names: Sequence[str]) -> str:
    """The message for an unknown name: similar names, and all that are allowed."""
    similar = get_close_matches(str(value), names, 3)
    suggestion = f"did you mean {' or '.join(similar)}? " if similar else ""
    return f"no such {kind}; {suggestion}allowed: {', '.join(names)}"


def _allowed(item: Any, model: type[BaseModel]) -> str:
    match item["type"]:
        case "extra_forbidden":
            *above, key = item["loc"]
            fields = _table(model, above).model_fields
            return unknown("key", key, [field.alias or name for name, field in fields.items()])
        case "missing":
            return "required"
        case "model_type" | "model_attributes_type":
            return "must be a table"
        case "tuple_type":
            return "must be a list"
    message = item["msg"].removeprefix("Value error, ").replace(" after validation", "")
    return re.sub("^(Input|String|Tuple) should", "must", message)


def _table(model: type[BaseModel], path: Sequence[object]) -> type[BaseModel]:
    """The model of the table at a path inside a model."""
    for key in path:
        if key in model.model_fields:
            model = _model_in(model.model_fields[str(key)].annotation) or model
    return model


def _unit(model: type[BaseModel], path: Sequence[object]) -> str | None:
    """The unit of the key at a path inside a model, or of the innermost table around it that has one."""
    for k in reversed(range(len(path))):
        if field := _table(model, path[:k]).model_fields.get(str(path[k])):
            return next((unit for unit in field.metadata if isinstance(unit, str)), None)
    return None


def with_units(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Describe each key in the JSON schema of a table by its unit."""
    for name in model.model_fields:
        if unit := _unit(model, [name]):
            schema["properties"][name]["description"] = unit


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_model_in, get_args(annotation))), None)
