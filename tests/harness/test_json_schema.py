"""The JSON schemas, by an independent validator: the package's files, published rows, and wrong keys."""

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from commands import harness, succeeds, wrong_usage
from published_runs import DIRECTORIES

from harness.planning.json_schema import FILE, schema_of
from harness.planning.suite import SUITES, suite_names
from harness.results import records
from problems.effects.fasteners import Fasteners
from problems.effects.installed_fasteners import InstalledFasteners
from problems.model.effect_tables import FILE_KEYS, effect_class, effect_kinds
from problems.scene_files import KEYS, SCENES, scene_names

jsonschema = pytest.importorskip("jsonschema")
EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE, SUITE, ROW = (
    jsonschema.Draft202012Validator(schema_of(kind))  # type: ignore[arg-type]
    for kind in ("scene", "suite", "row")
)
JOINT: dict[str, Any] = {
    "junction": {"length": 400.0, "width": 60.0, "nodes": [9, 3]},
    "part": [{"name": "skin", "thickness": 2.0}],
}


def faults(validator: Any, content: object) -> list[str]:
    return [f"{error.json_path}: {error.message}" for error in validator.iter_errors(content)]


@pytest.mark.parametrize("validator", [SCENE, SUITE, ROW], ids=["scene", "suite", "row"])
def test_it_is_a_schema(validator: Any) -> None:
    validator.check_schema(validator.schema)


def test_every_scene_and_suite_of_the_package_is_valid() -> None:
    scenes = [SCENES / f"{name}.toml" for name in scene_names()]
    for path in [*scenes, *EXAMPLES.glob("*.toml")]:
        assert faults(SCENE, tomllib.loads(path.read_text("utf-8"))) == [], path
    for path in [*(SUITES / f"{name}.toml" for name in suite_names())]:
        assert faults(SUITE, tomllib.loads(path.read_text("utf-8"))) == [], path


def test_an_effect_may_have_the_name_of_another_table(monkeypatch: pytest.MonkeyPatch) -> None:
    class Stage(InstalledFasteners):
        """One of the user's own."""

    module = "harness.planning.json_schema"
    monkeypatch.setattr(f"{module}.effect_kinds", lambda: ["fasteners", "stage"])
    monkeypatch.setattr(f"{module}.effect_class", {"stage": Stage, "fasteners": Fasteners}.get)
    table = {"joint": JOINT, "effect": [{"kind": "stage", "file": "holes.csv"}], "stage": [{"name": "1"}]}
    assert faults(jsonschema.Draft202012Validator(schema_of("scene")), table) == []


def test_every_published_row_is_valid() -> None:
    """Of rows whose fields have the same kinds, one: the schema of a row has no bounds."""
    for directory in DIRECTORIES:
        rows = records.read(directory / records.MEASUREMENTS)
        kinds = {tuple((name, type(value)) for name, value in row.items()): row for row in rows}
        assert [fault for row in kinds.values() for fault in faults(ROW, row)] == []


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"joint": JOINT, "efect": []}, "'efect' was unexpected"),
        ({"joint": JOINT, "output": {"stres": True}}, "'stres' was unexpected"),
        ({"joint": JOINT | {"contact": []}}, "not valid under any of"),
        ({"joint": JOINT, "stage": [{"name": "one", "of": []}]}, "'of' was unexpected"),
        ({"joint": JOINT, "effect": [{"kind": "glue"}]}, "not valid under any of"),
        ({"joint": JOINT, "effect": [{"kind": "initial_gap", "mean": "0.6"}]}, "not valid under any of"),
        ({"matrices": {"Q": "Q.mtx"}}, "not valid under any of"),
    ],
)
def test_a_wrong_scene_is_refused(content: dict[str, Any], said: str) -> None:
    assert faults(SCENE, {"joint": JOINT}) == []
    assert said in str([*SCENE.iter_errors(content)])


@pytest.mark.parametrize("kind", effect_kinds())
def test_an_effect_has_its_own_keys_alone(kind: str) -> None:
    """With their units; a CSV takes the place of points."""
    table = SCENE.schema["$defs"][effect_class(kind).__name__]
    assert table["additionalProperties"] is False
    units = {name: unit for name, field in effect_class(kind).model_fields.items() for unit in field.metadata}
    for name, unit in units.items():
        assert not isinstance(unit, str) or table["properties"][name]["description"] == unit
    has_file = {"columns", "skip_lines", "missing"} <= table["properties"].keys()
    assert has_file == bool(effect_class(kind).columns)
    in_file = {"points", *effect_class(kind).more_columns}
    assert not in_file & {*table["required"]} or not has_file


def test_a_preload_may_be_a_column_of_the_file() -> None:
    assert faults(SCENE, {"joint": JOINT, "effect": [{"kind": "fasteners", "file": "holes.csv"}]}) == []


def test_a_wrong_suite_and_a_wrong_row_are_refused() -> None:
    suite = {"scenes": ["4386/0107"], "solver": [{"name": "gi", "with": ["piqp==0.6.2"]}]}
    assert faults(SUITE, suite) == []
    assert faults(SUITE, suite | {"solver": [{"name": "gi", "requirements": []}]}) != []
    assert faults(SUITE, suite | {"tolerance": [1e-9]}) != []
    assert faults(ROW, {"scene": "4386/0107", "n": 4386, "status": None}) == []
    assert faults(ROW, {"n": "4386"}) != []
    assert faults(ROW, {"scenes": "4386/0107"}) != []


def test_its_keys_are_those_that_are_read() -> None:
    assert set(SCENE.schema["properties"]) == set(KEYS)
    assert set(FILE) == {"file", *FILE_KEYS}


def test_the_command_writes_and_prints_it(tmp_path: Path) -> None:
    succeeds("schema", "suite", "--out", tmp_path / "suite.json")
    printed = json.loads(harness("schema", "suite").stdout)
    assert printed == json.loads((tmp_path / "suite.json").read_text("utf-8")) == SUITE.schema


def test_a_folder_is_no_file_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "--out: path = '.': a file is to be written" in wrong_usage("schema", "suite", "--out", ".")
