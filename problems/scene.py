"""A scene: which joint, and the effects that it calls for. Read from a TOML file and checked whole.

    title = "…"
    assembly = "wing-fragment-4386"       # a file in problems/assemblies, or a path; or [joint] here
    [[effect]]
    kind = "initial_gap"                  # a file in problems/effects
    mean = 0.6

or, for a user's own matrices, `[matrices]` with K, A, f, g (Matrix Market) or problem (.npz).
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from .cache import digest
from .effect import Effect, StiffnessEffect, effect_class, effect_kinds
from .errors import Fault, InputError
from .joint import Joint, Table
from .ladder import PREFIX, Made, Rung, make_rung, rung_names

HERE = Path(__file__).resolve().parent
SCENES = HERE / "scenes"
ASSEMBLIES = HERE / "assemblies"
MATRIX_KEYS = ("problem", "K", "A", "f", "g")


@dataclass(frozen=True)
class Scene:
    """A checked scene: a joint with effects, the files of a user's own matrices, or a ladder's rung."""

    name: str
    title: str
    joint: Joint | None = None
    effects: tuple[Effect, ...] = ()
    matrices: tuple[tuple[str, Path], ...] = ()
    rung: Rung | None = None

    @property
    def made(self) -> Made | None:
        """The matrices of a rung that no plates make."""
        return self.rung.made if self.rung else None

    @property
    def refused(self) -> str:
        """Words of the InputError that building a rung is to end with, "" where it is not."""
        return self.rung.refused if self.rung else ""

    @property
    def stiffness_effects(self) -> list[StiffnessEffect]:
        return [effect for effect in self.effects if isinstance(effect, StiffnessEffect)]

    @property
    def assembly_key(self) -> str:
        """Hash of everything that determines K and A."""
        if self.made:
            assembly = self.made.assembly
            A = assembly.A
            arrays = (*assembly.blocks, A.data, A.indices, A.indptr)
            return digest([assembly.n, assembly.m], *(array.tobytes() for array in arrays))
        if self.joint is None:
            keys = [key for key, _ in self.matrices]
            return digest(keys, *(path.read_bytes() for _, path in self.matrices))
        return digest(_plain(self.joint), [_plain(effect) for effect in self.stiffness_effects])

    @property
    def key(self) -> str:
        """Hash of everything that determines K, A, f and g."""
        if self.made:
            return digest(self.assembly_key, self.made.load.f.tobytes(), self.made.load.g.tobytes())
        loads = [_plain(effect) for effect in self.effects if not isinstance(effect, StiffnessEffect)]
        return digest(self.assembly_key, loads)

    @property
    def expected_size(self) -> tuple[int, int] | None:
        """(n, m) without building anything; None for a user's own matrices."""
        if self.made:
            return self.made.assembly.n, self.made.assembly.m
        return self.joint.size if self.joint else None


def scene_names() -> list[str]:
    """The scenes that come with the package, smallest problem first."""
    names = [path.relative_to(SCENES).with_suffix("").as_posix() for path in SCENES.rglob("*.toml")]
    return sorted(names, key=lambda name: [(len(part), part) for part in name.split("/")])


def read_scene(name_or_path: str) -> Scene:
    """Read and check a scene by name, by the path of a TOML file, or of an .npz with K, A, f, g.

    Raises InputError naming the file, the key, the value and what is allowed, all faults at once.
    """
    if name_or_path.startswith(PREFIX):
        return _rung_scene(name_or_path)
    path = Path(name_or_path)
    if path.suffix == ".npz":
        if not path.is_file():
            raise InputError.one(path, "scene", name_or_path, "no such file")
        return Scene(path.stem, f"own matrices {path.name}", matrices=(("problem", path),))
    if path.suffix != ".toml":
        path = SCENES / f"{name_or_path}.toml"
        if not path.is_file():
            raise _no_such(name_or_path, scene_names())
    own = not path.resolve().is_relative_to(SCENES)
    name = path.stem if own else path.resolve().relative_to(SCENES).with_suffix("").as_posix()
    return _scene(name, path, read_toml(path))


def _rung_scene(name: str) -> Scene:
    if name not in rung_names():
        raise _no_such(name, rung_names())
    rung = make_rung(name)
    return Scene(name, rung.title, rung.joint, rung.effects, rung=rung)


def _no_such(name: str, known: list[str]) -> InputError:
    near = get_close_matches(name, known, 3, 0.4) or known[:5]
    return InputError.one("scene", "name", name, f"no such scene; near it: {', '.join(near)}")


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file as a dict; InputError if it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError.one(path, "file", str(error.strerror), "a readable file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError.one(path, "TOML", str(error), "valid TOML") from error


def validation_faults(where: object, prefix: str, error: ValidationError) -> Iterator[Fault]:
    """pydantic's findings in our words."""
    items = error.errors()
    for item in items:
        depth = len(item["loc"])
        if any(len(other["loc"]) > depth and other["loc"][:depth] == item["loc"] for other in items):
            continue  # it follows from a fault inside it
        key = ".".join(filter(None, [prefix, *map(str, item["loc"])]))
        value = None if item["type"] == "missing" else item["input"]
        allowed = "unknown key" if item["type"] == "extra_forbidden" else item["msg"]
        yield Fault(str(where), key or "file", value, allowed)


def _scene(name: str, path: Path, data: dict[str, Any]) -> Scene:
    title = str(data.pop("title", name))
    if "matrices" in data:
        return _matrices_scene(name, title, path, data)
    faults: list[Fault] = []
    joint_data: dict[str, Any] = data.pop("joint", {})
    joint_path, effects = path, []
    if "assembly" in data:
        if joint_data:
            faults.append(Fault(str(path), "joint", joint_data, "give either joint or assembly"))
        joint_path = _assembly_path(path, data.pop("assembly"))
        joint_data = read_toml(joint_path)
        effects += _effect_tables(joint_path, joint_data, faults)
    effects += _effect_tables(path, data, faults)
    allowed = "unknown key; a scene has title, assembly or joint, effect, matrices"
    faults += [Fault(str(path), key, value, allowed) for key, value in data.items()]

    joint = None
    try:
        joint = Joint.model_validate(joint_data)
        faults += [Fault(str(joint_path), *fault) for fault in joint.faults()]
    except ValidationError as error:
        faults += validation_faults(joint_path, "", error)
    checked = [_effect(where, k, table, joint, faults) for where, k, table in effects]
    found = tuple(effect for effect in checked if effect is not None)
    if joint is not None and not faults:
        faults += _floating(joint_path, joint, found)
    if faults or joint is None:
        raise InputError(faults)
    return Scene(name, title, joint, found)


def _effect_tables(
    where: Path, data: dict[str, Any], faults: list[Fault]
) -> list[tuple[Path, int, dict[str, Any]]]:
    tables = data.pop("effect", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        faults.append(Fault(str(where), "effect", tables, "tables [[effect]]"))
        return []
    return [(where, k, table) for k, table in enumerate(tables)]


def _effect(
    where: Path, index: int, table: dict[str, Any], joint: Joint | None, faults: list[Fault]
) -> Effect | None:
    kind = table.get("kind")
    prefix = f"effect[{index}]"
    if kind not in effect_kinds():
        faults.append(Fault(str(where), f"{prefix}.kind", kind, f"one of {', '.join(effect_kinds())}"))
        return None
    try:
        effect = effect_class(kind).model_validate(table)
    except ValidationError as error:
        faults += validation_faults(where, f"{prefix} ({kind})", error)
        return None
    if joint is not None:
        for key, value, allowed in effect.faults(joint):
            faults.append(Fault(str(where), f"{prefix} ({kind}).{key}", value, allowed))
    return effect


def _floating(path: Path, joint: Joint, effects: tuple[Effect, ...]) -> Iterator[Fault]:
    held: dict[str, list[tuple[float, float]]] = {part.name: [] for part in joint.part}
    for effect in effects:
        if isinstance(effect, StiffnessEffect):
            held[effect.part] += effect.held_points
    for part in joint.part:
        points = held[part.name]
        # A rigid motion of a plate is a + bx + cy: three points off a line hold it.
        if not part.clamped and np.linalg.matrix_rank([[1, x, y] for x, y in points] or [[0.0]]) < 3:
            allowed = "needs a clamped edge, or supports at three points off a line"
            yield Fault(str(path), f"part.{part.name}", points or "no support", allowed)


def _assembly_path(path: Path, name: object) -> Path:
    choices = (path.parent / str(name), ASSEMBLIES / f"{name}.toml")
    for choice in choices:
        if choice.is_file():
            return choice
    known = ", ".join(sorted(p.stem for p in ASSEMBLIES.glob("*.toml")))
    raise InputError.one(path, "assembly", name, f"a path of a TOML file, or one of {known}")


def _matrices_scene(name: str, title: str, path: Path, data: dict[str, Any]) -> Scene:
    table = data.pop("matrices")
    if not isinstance(table, dict):
        raise InputError.one(path, "matrices", table, "a table [matrices]")
    alone = "a scene of own matrices has only title and [matrices]"
    faults = [Fault(str(path), key, value, alone) for key, value in data.items()]
    files = []
    for key, value in table.items():
        if key not in MATRIX_KEYS:
            faults.append(Fault(str(path), f"matrices.{key}", value, f"one of {', '.join(MATRIX_KEYS)}"))
        elif not (path.parent / str(value)).is_file():
            faults.append(Fault(str(path), f"matrices.{key}", value, "no such file"))
        else:
            files.append((key, path.parent / str(value)))
    if not faults and set(table) not in ({"problem"}, set("KAfg")):
        faults.append(Fault(str(path), "matrices", sorted(table), "K, A, f and g, or problem alone"))
    if faults:
        raise InputError(faults)
    return Scene(name, title, matrices=tuple(files))


def _plain(table: Table) -> dict[str, Any]:
    return table.model_dump(mode="json")
