"""JSON schemas of scenes, suites and rows, written by pydantic from the models that validate them.

They hold keys, types, bounds and units. What is checked against files, or between keys, is not there.
"""

from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Any, Literal

from pydantic import create_model

from harness.results.row_validation import MEASUREMENT
from problems.model.effect import Effect
from problems.model.effect_tables import effect_class, effect_kinds
from problems.model.joint import Joint, Table
from problems.model.scene import GAPS_ALONE, Output
from problems.model.stages import Stage
from problems.model.superelement_joint import SuperelementJointTable
from problems.scene_files import MATRIX_KEYS

from .suite import Suite

DIALECT = "https://json-schema.org/draft/2020-12/schema"
TEXT = {"type": "string"}
#: The keys of an [[effect]] whose points are in a CSV (problems/model/effect_tables.py).
FILE: dict[str, Any] = {"file": TEXT, "columns": {"type": "object", "additionalProperties": TEXT}}
FILE |= {"skip_lines": {"type": "integer", "minimum": 0}, "missing": {"type": "array"}}


def schema_of(kind: Literal["scene", "suite", "row"]) -> dict[str, Any]:
    """The JSON schema of a scene's file, of a suite's, or of a line of measurements.jsonl."""
    effects = {kind: effect_class(kind) for kind in effect_kinds()} if kind == "scene" else {}
    model: Any = {"suite": Suite, "row": MEASUREMENT}.get(kind) or scene_table(effects)
    schema = {"$schema": DIALECT, **model.model_json_schema(), "additionalProperties": False}
    if kind == "suite":
        schema["required"].remove("name")  # by default the file's
    for table in schema.get("$defs", {}).values():  # by kind: its class may have the name of another model
        effect = effects.get(table.get("properties", {}).get("kind", {}).get("const"))
        if effect and effect.columns:
            in_file = ("points", *effect.more_columns)
            table["properties"] |= FILE
            table["required"] = [key for key in table["required"] if key not in in_file]
    return schema


def scene_table(effects: Mapping[str, type[Effect]]) -> Any:
    """The tables of a scene's file, with these kinds of effects; `read_scene` checks them one by one."""
    make: Any = create_model
    several: Any = list
    kinds = [make(of.__name__, __base__=of, kind=(Literal[kind], ...)) for kind, of in effects.items()]
    matrices = make("Matrices", __base__=Table, **dict.fromkeys(MATRIX_KEYS, (str, "")))
    keys: dict[str, Any] = dict.fromkeys(("title", "assembly"), (str, ""))
    keys |= {"joint": (Joint | SuperelementJointTable | None, None), "matrices": (matrices | None, None)}
    keys |= {"effect": (several[reduce(or_, kinds)], []), "stage": (list[Stage], [])}
    keys |= {"output": (Output, GAPS_ALONE), "random": (dict[str, Any], {})}
    return make("Scene", __base__=Table, **keys)
