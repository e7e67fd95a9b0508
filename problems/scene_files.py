"""Reads scenes from TOML files, a joint and its effects, and reports all errors at once.

    title = "…"
    assembly = "wing-fragment-4386"       # a file in problems/assemblies, or a path; or [joint] here
    [[effect]]
    kind = "initial_gap"                  # a file in problems/effects
    mean = 0.6

The parts of a joint are plates, or superelements with `superelement` and `nodes` (docs/own-parts.md). Instead
of a joint, `[matrices]` names the matrices of a whole problem: K, A, f, g (Matrix Market) or problem (.npz).
"""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from os.path import isfile
from pathlib import Path
from typing import Any

import numpy as np

from problems.input.bounded_types import resolved, unknown, valid_table
from problems.input.text_files import read_text
from problems.ladders import make_rung, prefix_of, rung_names
from problems.model.effect import Effect
from problems.model.effect_tables import EffectTable
from problems.model.interface import AnyJoint
from problems.model.joint import Joint, Table
from problems.model.scene import GAPS_ALONE, JointScene, MatricesScene, Output, Scene
from problems.model.stages import Stage, StagePlan
from problems.random_scenes import EXAMPLES, NAME, SUPERELEMENTS, draw_of, drawn_table

from .errors import BACKSLASH, Fault, InputError

FOLDER = Path(__file__).resolve().parent
SCENES = FOLDER / "scenes"
ASSEMBLIES = FOLDER / "assemblies"
KEYS = ("title", "assembly", "joint", "effect", "stage", "output", "random", "matrices")
TOML_MIB = 10
MATRIX_KEYS = ("problem", "K", "A", "f", "g")
EFFECT = re.compile(r"effect\[(\d+)\]")


def scene_names() -> list[str]:
    """The scenes that come with the package, smallest problem first."""
    names = [path.relative_to(SCENES).with_suffix("").as_posix() for path in SCENES.rglob("*.toml")]
    return sorted(names, key=lambda name: [(len(part), part) for part in name.split("/")])


def is_scene_file(scene: object) -> bool:
    """Whether a scene is given by the path of a file."""
    return Path(str(scene)).suffix in (".toml", ".npz")


def scene_name(name_or_path: str) -> str:
    """The name of a scene that is given by its name, or by the path of a file, which need not be there."""
    if not is_scene_file(name_or_path):
        return name_or_path
    path = resolved(Path(name_or_path))
    is_users = not path.is_relative_to(SCENES)
    return Path(name_or_path).stem if is_users else path.relative_to(SCENES).with_suffix("").as_posix()


def read_scene(name_or_path: str) -> Scene:
    """Read and check a scene by name, by the path of a TOML file, or of an .npz with K, A, f, g.

    Raises InputError naming the file, the key, the value and what is allowed, all faults at once.
    """
    if prefix := prefix_of(name_or_path):
        if name_or_path in (names := rung_names(prefix)):
            return make_rung(name_or_path)
        raise _unknown_scene(name_or_path, names)
    if (drawn := NAME.fullmatch(name_or_path)) and drawn[2] == SUPERELEMENTS:
        from problems.random_superelements import drawn_joint

        return drawn_joint(name_or_path, draw_of(name_or_path))
    if table := drawn_table(name_or_path):
        return _scene(name_or_path, SCENES / name_or_path, table)
    path = Path(name_or_path)
    if path.suffix == ".npz":
        if not path.is_file():
            raise InputError.one(path, "scene", name_or_path, "no such file")
        path = path.absolute()  # read when it is solved: perhaps in another folder, or by a worker
        name, title = scene_name(name_or_path), f"own matrices {path.name}"
        return MatricesScene(name, title, (("problem", path),), sources=(path,))
    if path.suffix != ".toml":
        path = SCENES / f"{name_or_path}.toml"
        if not path.is_file():
            raise _unknown_scene(name_or_path, [*scene_names(), *EXAMPLES])
    table = read_toml(path)
    files, assembly = _files_of(path, table), path.parent / str(table.get("assembly", "."))
    scene = _scene(scene_name(str(path)), path, table)
    files += _files_of(assembly, read_toml(assembly)) if isfile(assembly) else []
    return replace(scene, sources=tuple(dict.fromkeys(file.absolute() for file in files)))


def scene_of(table: Mapping[str, Any], name: str = "scene") -> Scene:
    """A checked scene from the table that its file would hold.

    The tables in it may be dicts, or a Joint and Effects; paths are relative to the working directory.
    Raises InputError as `read_scene` does.
    """
    return _scene(name, Path(name), _as_toml(table))


def _as_toml(value: Any) -> Any:
    """The value as tomllib would return it: dicts, lists and scalars, but effects as they are."""
    if isinstance(value, Table) and not isinstance(value, Effect):
        return value.model_dump(exclude_unset=True)
    if isinstance(value, Mapping):
        return {key: _as_toml(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_as_toml(inner) for inner in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _unknown_scene(name: str, known: list[str]) -> InputError:
    near = get_close_matches(name, known, 3, 0.4) or known[:5]
    allowed = f"no such scene; similar: {', '.join(near)}; the path of a scene ends in .toml or .npz"
    return InputError.one("scene", "name", name, allowed)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file. Raises InputError."""
    try:
        return tomllib.loads(read_text(path, "file", TOML_MIB, strict=True))
    except InputError:
        raise
    except (ValueError, RecursionError) as error:  # also numbers of thousands of digits
        hint = BACKSLASH if re.search("Unescaped|hex value", str(error)) else ""
        raise InputError.one(path, "TOML", str(error), f"valid TOML{hint}") from error


def _files_of(path: Path, table: dict[str, Any]) -> list[Path]:
    """The file of a scene or an assembly, and the files that its table names."""
    queue, named = [*table.values()], [path]
    while queue:
        match queue.pop():
            case dict() as table:
                queue += table.values()
            case list() as entries:
                queue += entries
            case str() as text if isfile(path.parent / text):
                named.append(path.parent / text)
    return named


def _scene(name: str, path: Path, data: dict[str, Any]) -> Scene:
    title = str(data.pop("title", name))
    if "matrices" in data:
        return _matrices_scene(name, title, path, data)
    faults: list[Fault] = []
    joint_path, joint_data = _joint_table(path, data, faults)
    tables = _effect_tables(joint_path, joint_data, faults) if joint_path != path else []
    tables += _effect_tables(path, data, faults)
    tables_of_stages = enumerate(_tables(path, "stage", data, faults))
    read = (valid_table(Stage, table, path, faults, f"stage[{k}]") for k, table in tables_of_stages)
    stages = tuple(stage for stage in read if stage is not None)
    output = valid_table(Output, data.pop("output", {}), path, faults, "output") or GAPS_ALONE
    random = tuple(_random(path, "", data.pop("random", {}), faults))
    faults += [Fault(str(path), key, value, unknown("key", key, KEYS)) for key, value in data.items()]

    for table in tables:
        faults += table.read()
    effects = tuple(table.effect for table in tables if table.effect is not None)
    joint = _joint(joint_path, joint_data, effects, faults)
    if joint is not None:
        for table in tables:
            faults += table.faults(joint, None if stages else tables)
            faults += table.unknown_stages([stage.name for stage in stages]) if stages else ()
        if len(effects) == len(tables):
            plan = StagePlan(effects, stages, joint)
            faults += [_of_stages(tables, path, *fault) for fault in plan.faults()]
            faults += [Fault(str(joint_path), *fault) for fault in plan.floating()]
    if faults or joint is None:
        raise InputError(faults)
    return JointScene(name, title, joint, effects, stages, output, random)


def _of_stages(tables: list[EffectTable], path: Path, key: str, value: object, allowed: str) -> Fault:
    """A fault of the stages, which count all effects, with the numbers that these have in their own files."""

    def own(found: re.Match[str]) -> str:
        return f"effect[{tables[int(found[1])].index}]"

    named = EFFECT.match(key)
    where = tables[int(named[1])].where if named else path
    return Fault(str(where), EFFECT.sub(own, key), value, EFFECT.sub(own, allowed))


def _random(path: Path, name: str, value: object, faults: list[Fault]) -> Iterator[str]:
    """Yield KEY=DISTRIBUTION of each entry of [random], also in tables within it."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _random(path, f"{name}.{key}".lstrip("."), inner, faults)
    elif name and isinstance(value, str):
        yield f"{name}={value}"
    else:
        key = f"random.{name}".rstrip(".")
        faults.append(Fault(str(path), key, value, 'as in fasteners.preload = "normal(1000, 100)"'))


def _joint_table(path: Path, data: dict[str, Any], faults: list[Fault]) -> tuple[Path, dict[str, Any]]:
    """The file and the table of the joint; the table is empty if there is none."""
    table = data.pop("joint", None)
    if "assembly" in data:
        if table is not None:
            faults.append(Fault(str(path), "joint", table, "give either joint or assembly"))
        try:
            file = assembly_path(path, data.pop("assembly"))
            return file, read_toml(file)
        except InputError as error:
            faults += error.faults
            return path, {}
    if not isinstance(table, dict) or not table:
        allowed = "a table [joint], or assembly = the name or the path of one"
        faults.append(Fault(str(path), "joint", table, allowed))
        return path, {}
    return path, table


def _joint(
    path: Path, table: dict[str, Any], effects: tuple[Effect, ...], faults: list[Fault]
) -> AnyJoint | None:
    """The joint with the contacts that effects add; None if its table is wrong, which `faults` then says."""
    if not table:
        return None
    parts = table.get("part")
    if is_own := isinstance(parts, list) and any(isinstance(p, dict) and "superelement" in p for p in parts):
        from problems.model.superelement_joint import SuperelementJoint, SuperelementJointTable
    model: Any = SuperelementJointTable if is_own else Joint
    if (valid := valid_table(model, table, path, faults)) is None:
        return None
    folder = path.parent.absolute()  # stresses are read when they are asked for: perhaps in another folder
    try:
        joint: Any = SuperelementJoint.of(folder, valid) if is_own else valid
    except InputError as error:
        faults += error.faults
        return None
    new = [pair for effect in effects for pair in effect.contacts if pair not in joint.pairs]
    if new:
        joint = joint.with_contacts((*joint.pairs, *dict.fromkeys(new)))
    wrong = [Fault(str(path), *fault) for fault in joint.faults()]
    faults += wrong
    return None if is_own and wrong else joint  # without places nothing can be said of the effects


def _effect_tables(where: Path, data: dict[str, Any], faults: list[Fault]) -> list[EffectTable]:
    tables = enumerate(_tables(where, "effect", data, faults))
    return [EffectTable.of(where, k, table) for k, table in tables]


def _tables(where: Path, key: str, data: dict[str, Any], faults: list[Fault]) -> list[Any]:
    """The tables [[key]]; none, which `faults` then says, if it is something else."""
    tables = data.pop(key, [])
    if not isinstance(tables, list) or not all(isinstance(table, dict | Effect) for table in tables):
        faults.append(Fault(str(where), key, tables, f"tables [[{key}]]"))
        return []
    return tables


def assembly_path(path: Path, name: object) -> Path:
    """The file of the assembly that a scene at `path` names. Raises InputError."""
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
            files.append((key, (path.parent / str(value)).absolute()))
    if not faults and set(table) not in ({"problem"}, set("KAfg")):
        faults.append(Fault(str(path), "matrices", sorted(table), "K, A, f and g, or problem alone"))
    if faults:
        raise InputError(faults)
    return MatricesScene(name, title, tuple(files))
