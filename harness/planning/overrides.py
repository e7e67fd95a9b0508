"""Changes a suite as the command line says."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from problems.errors import Fault, InputError, refuse_text
from problems.input.bounded_types import resolved, unknown
from problems.scene_files import read_scene
from solvers.base import Form
from solvers.plugin import unused
from solvers.registry import modules

from .suite import Suite, resolved_scenes, suite_from

WORD = re.compile(r"[\w-]+")  # a text without quotes


@dataclass(frozen=True)
class Overrides:
    """Changes of a suite; empty or None leaves it as it is.

    Parameters
    ----------
    sizes : tuple of int
        Only scenes with so many unknowns.
    scenes : tuple of str
        These scenes instead of the suite's: names, globs, .toml or .npz files.
    solvers : tuple of str
        Only these solvers, in the suite or not.
    requirements : tuple of str
        Only these libraries: "piqp==0.6.2", or the name alone for the version installed here.
    forms : tuple of str
        Only these forms.
    tolerances : tuple of float or "auto"
        Passed to the solvers; "auto": the loosest one that suffices, to half a decade.
    options : tuple of str
        Options of solvers, as "osqp.scaling=0".
    repeats : int, optional
        Number of repeats.
    threads : tuple of int
        Numbers of threads for linear algebra.
    time_limit_s : float, optional
        Time limit per measurement, s.
    memory_limit_mib : int, optional
        Memory limit over all processes of a solver, MiB.
    reference_limit_s : float, optional
        Limit on the search for each reference, s.
    plugin : str or Path, optional
        A Python file with a solver of your own.
    """

    sizes: tuple[int, ...] = ()
    scenes: tuple[str, ...] = ()
    solvers: tuple[str, ...] = ()
    requirements: tuple[str, ...] = ()
    forms: tuple[Form, ...] = ()
    tolerances: tuple[float, ...] | Literal["auto"] = ()
    options: tuple[str, ...] = ()
    repeats: int | None = None
    threads: tuple[int, ...] = ()
    time_limit_s: float | None = None
    memory_limit_mib: int | None = None
    reference_limit_s: float | None = None
    plugin: str | Path | None = None

    def __post_init__(self) -> None:
        names = "scenes", "solvers", "requirements", "forms", "options"
        refuse_text("Overrides", **{name: getattr(self, name) for name in names})


def overridden(suite: Suite, change: Overrides) -> Suite:
    """The suite with the command line's changes. Raises InputError, all faults at once.

    --scene replaces the suite's scenes, and each entry is measured on those that the suite does not have,
    whatever its own scenes; --size keeps those of that size; --solver keeps those entries and
    adds a default one for a solver that is not in the suite; --with does so for its library, and takes each
    entry once in each version; --plugin adds its solver, which --solver names if it names any.
    """
    faults: list[Fault] = []
    data = suite.model_dump(exclude_none=True)
    if change.scenes:
        data["scenes"] = resolved_scenes(list(change.scenes), "--scene", "scene", Path.cwd(), faults)
    if change.sizes:
        expected = {scene: read_scene(scene).expected_size for scene in ([] if faults else data["scenes"])}
        sizes = {scene: size[0] for scene, size in expected.items() if size is not None}
        for size in set(change.sizes) - set(sizes.values()):
            allowed = ", ".join(map(str, sorted(set(sizes.values()))))
            faults.append(Fault("--size", "size", size, f"no scene of that size here; allowed: {allowed}"))
        data["scenes"] = [scene for scene in data["scenes"] if sizes.get(scene) in change.sizes]
    versions = _versions(change, faults)
    solvers = [*change.solvers, *(name for name in versions if name not in change.solvers)]
    if solvers:
        data["solver"] = [entry for entry in data["solver"] if entry["name"] in solvers]
    named = {entry["name"] for entry in data["solver"]}
    plugins = [Path(change.plugin).stem] if change.plugin and not solvers else []
    data["solver"] += [{"name": name} for name in (*solvers, *plugins) if name not in named]
    faults += unused(change.plugin, [entry["name"] for entry in data["solver"]])
    data["solver"] = [entry | at for entry in data["solver"] for at in versions.get(entry["name"], [{}])]
    names = ("tolerances", "repeats", "threads", "time_limit_s", "memory_limit_mib", "reference_limit_s")
    asked = {name: getattr(change, name) for name in names}
    changes = {name: value for name, value in asked.items() if value not in ((), [], None)}
    data |= changes
    if change.plugin:
        data["plugin"] = str(resolved(Path(change.plugin)))
    if "time_limit_s" in changes:
        data.pop("time_limit_by_size_s", None)
    others = [scene for scene in data["scenes"] if scene not in suite.scenes]
    for entry in data["solver"]:
        if "scenes" in entry:
            entry["scenes"] = [*entry["scenes"], *others]
        if change.forms:
            entry["forms"] = list(change.forms)
        for key in changes:  # of the suite: they override the entry's
            entry.pop(key, None)
    _set_options(data["solver"], change.options, faults)
    if faults:
        raise InputError(faults)
    if data["scenes"] != suite.scenes or data["solver"] != suite.model_dump(exclude_none=True)["solver"]:
        data.pop("description", None)  # it is of the whole suite
    return suite_from(data, Path("command line"))


def _versions(change: Overrides, faults: list[Fault]) -> dict[str, list[dict[str, Any]]]:
    """The changes in the entries of each solver whose library --with names, one for each version.

    The solver has the library's name; if there is none, it is the only one that --solver names.
    """
    changes: dict[str, list[dict[str, Any]]] = {}
    for requirement in change.requirements:
        library, equals, version = requirement.partition("==")
        if not WORD.fullmatch(library) or bool(equals) != bool(version):
            allowed = "NAME==VERSION, as piqp==0.6.2, or NAME alone for the version installed here"
            faults.append(Fault("--with", "with", requirement, allowed))
        other = len(change.solvers) == 1 and library not in modules()
        solver = change.solvers[0] if other else library
        changes.setdefault(solver, []).append({"with": [requirement] if version else None})
    return changes


def _set_options(entries: list[dict[str, Any]], options: Sequence[str], faults: list[Fault]) -> None:
    """Give each solver's entries its options."""
    names = {entry["name"] for entry in entries}
    for option in options:
        place, equals, value = option.partition("=")
        place = place.strip()
        named = (name for name in names if place.startswith(f"{name}."))  # that of a plug-in may have dots
        name = max(named, key=len, default=place.partition(".")[0])
        key = place[len(name) + 1 :]
        try:
            parsed = tomllib.loads(f"value = {value}")["value"] if equals and key else None
        except tomllib.TOMLDecodeError:
            parsed = value.strip() if WORD.fullmatch(value.strip()) else None
        if parsed is None:
            faults.append(Fault("--option", "option", option, "SOLVER.KEY=VALUE, as osqp.scaling=0"))
        elif name not in names:
            faults.append(Fault("--option", "solver", name, unknown("solver", name, sorted(names))))
        else:
            for entry in entries:
                if entry["name"] == name:
                    entry["options"] = entry.get("options", {}) | {key: parsed}


def tolerances_of(words: Sequence[str]) -> tuple[float, ...] | Literal["auto"]:
    """The values of --tolerance: numbers, or "auto" alone. Raises InputError."""
    if list(words) == ["auto"]:
        return "auto"
    try:
        return tuple(map(float, words))
    except ValueError as error:
        allowed = "numbers, or auto alone"
        raise InputError.one("--tolerance", "tolerance", " ".join(words), allowed) from error
