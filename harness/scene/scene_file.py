"""Writes a scene's file with other values for another folder; its comments and order are kept."""

import os
import tomllib
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import tomlkit

from problems.errors import InputError
from problems.input.bounded_types import resolved
from problems.input.text_files import read_text
from problems.load_cases.random_gaps import RandomGaps
from problems.model.scene import Scene
from problems.random_scenes import drawn_table
from problems.scene_files import SCENES, TOML_MIB, assembly_path, read_scene, read_toml, scene_of

from .validate import refuse_wrong_laws

MOVED = ("fasteners",)  # what `with_fasteners` changes
FILES = ("assembly", "file", "superelement", "nodes", "stress", "stress_points")  # may be relative paths


def opened(source: str) -> tuple[str, Path]:
    """The text of a scene's file, and the folder that its paths are relative to.

    Raises InputError if the scene has no file, as a rung of a ladder.
    """
    if table := drawn_table(source):
        return tomlkit.dumps(table), SCENES
    path = Path(source) if source.endswith(".toml") else SCENES / f"{source}.toml"
    if not path.is_file():
        raise InputError.one("scene", "name", source, "a scene in a file, so that its values can change")
    return read_text(path, "file", TOML_MIB, strict=True), path.parent


def edited(
    source: str | tuple[str, Path],
    folder: Path,
    change: Callable[[Any], None],
    kinds: Sequence[str],
    law: RandomGaps | None = None,
) -> str:
    """The changed text of a scene's file, with paths relative to `folder`. source : the file, or what
    `opened` has read of it. kinds : the kinds of effects that change. law : random gaps in place of the
    scene's.

    Raises InputError if the scene has no file, or if its assembly has such effects.
    """
    text, home = opened(source) if isinstance(source, str) else source
    document = tomlkit.parse(text)
    if "assembly" in document:
        there = read_toml(assembly := assembly_path(home / "scene", document["assembly"])).get("effect", [])
        changed = (*kinds, "initial_gap") if law else kinds
        if wrong := [table["kind"] for table in there if table.get("kind") in changed]:
            allowed = "these in the scene itself, where they can change"
            raise InputError.one(assembly, "effect", wrong, allowed)
    if law:
        with_gaps(law)(document)
    change(document)
    for inner in _tables(document):
        for key in FILES:
            if isinstance(value := inner.get(key), str) and (home / value).is_file():
                inner[key] = relative(home / value, folder)
    return tomlkit.dumps(document)


def refuse_unreadable(text: str, path: Path) -> None:
    """Raise InputError, as `validate` does, for the text of a scene that is to be written to a path."""
    refuse_wrong_laws(scene_of(tomllib.loads(text), str(path)))


def relative(file: Path, folder: Path) -> str:
    """The path by which a scene in `folder` names a file, also where a link leads to either folder."""
    return Path(os.path.relpath(resolved(file.parent) / file.name, resolved(folder))).as_posix()


def file_of(source: object, scene: Scene) -> str:
    """The file of a scene, or its name. source : what the scene was loaded from.

    Raises InputError if that is a scene that has changed since it was read from the file.
    """
    file = str(scene.sources[0]) if scene.sources else scene.name
    has_file = scene.sources or drawn_table(file)
    if source is scene and has_file and _content(read_scene(file)) != _content(scene):
        allowed = "the scene as it is now: what is written starts from the text of its file"
        raise InputError.one(f"scene {scene.name}", "file", file, allowed)
    return file


def _content(scene: Scene) -> tuple[object, ...]:
    return scene.key, getattr(scene, "random", ())


def with_fasteners(
    points: Sequence[tuple[float, float]], preload: float | None = None
) -> Callable[[Any], None]:
    """The change that moves all fasteners of a scene to these places, mm; none leaves it and its stages
    without. preload : N, where it was a column of their file.
    """

    def change(document: Any) -> None:
        tables = of_kind(document, "fasteners")
        if not tables:
            raise InputError.one("scene", 'effect kind = "fasteners"', "none", "at least one")
        for key in ("pattern", "file", "columns", "skip_lines", "points"):
            tables[0].pop(key, None)
        if preload is not None:
            tables[0].setdefault("preload", preload)
        if points:
            tables[0]["points"] = tomlkit.item([list(place) for place in points]).multiline(True)
        for other in tables[1 if points else 0 :]:
            document["effect"].remove(other)
        names = [] if points else [table.get("name") for table in tables]
        for stage, key in product(document.get("stage", []), ("on", "off")):
            if set(names).intersection(stage.get(key, [])):
                stage[key] = [name for name in stage[key] if name not in names]

    return change


def with_gaps(cases: RandomGaps) -> Callable[[Any], None]:
    """The change that gives a scene the law of random gaps, or instead the scan that they pass through."""
    table: dict[str, Any] = cases.field.model_dump(mode="json", exclude={"kind"}, exclude_none=True)
    kind = "initial_gap"
    if cases.points is not None:
        kind, table = "measured_gap", {key: table[key] for key in ("between", "name") if key in table}
        table["points"] = tomlkit.item(cases.points.tolist()).multiline(True)

    def change(document: Any) -> None:
        for old in of_kind(document, "initial_gap"):
            document["effect"].remove(old)
        laws = document.get("random", {})
        for key in [key for key in laws if kind != "initial_gap" and key.split(".")[0] == "initial_gap"]:
            del laws[key]  # of a gap that is no longer there
        add_effect(document, {"kind": kind} | table)

    return change


def add_effect(document: Any, table: dict[str, Any]) -> None:
    """Append an effect to those of a scene, as [[effect]] or as an inline table, whichever they are."""
    document.setdefault("effect", tomlkit.aot()).append(table)  # which makes the item that fits


def of_kind(document: Any, kind: str) -> list[Any]:
    """The tables of the effects of a kind."""
    return [table for table in document.get("effect", []) if table.get("kind") == kind]


def _tables(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        yield value
        value = list(value.values())
    if isinstance(value, list):
        for inner in value:
            yield from _tables(inner)
