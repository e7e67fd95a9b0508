"""What the command line changes in a suite."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from problems.errors import Fault, InputError
from problems.scene import read_scene
from solvers.base import Form

from .suite import Suite, resolved_scenes, suite_from


@dataclass(frozen=True)
class Overrides:
    """What the command line changes in a suite; empty or None leaves it as it is."""

    sizes: tuple[int, ...] = ()
    scenes: tuple[str, ...] = ()
    solvers: tuple[str, ...] = ()
    forms: tuple[Form, ...] = ()
    tolerances: tuple[float, ...] = ()
    repeats: int | None = None
    threads: tuple[int, ...] = ()
    time_limit_s: float | None = None
    memory_limit_mib: int | None = None
    reference_limit_s: float | None = None
    plugin: Path | None = None


def overridden(suite: Suite, change: Overrides) -> Suite:
    """The suite with the command line's changes. Raises InputError, all faults at once.

    --scene replaces the suite's scenes; --size keeps those of that size; --solver keeps those entries and
    adds a default one for a solver that is not in the suite; --plugin adds its solver.
    """
    faults: list[Fault] = []
    data = suite.model_dump(exclude_none=True)
    if change.scenes:
        data["scenes"] = resolved_scenes(list(change.scenes), "--scene", "scene", Path.cwd(), faults)
    if change.sizes:
        sizes = dict(_sizes(data["scenes"])) if not faults else {}
        for size in set(change.sizes) - set(sizes.values()):
            allowed = ", ".join(map(str, sorted(set(sizes.values()))))
            faults.append(Fault("--size", "size", size, f"no scene of that size here; allowed: {allowed}"))
        data["scenes"] = [scene for scene in data["scenes"] if sizes.get(scene) in change.sizes]
    plugin = os.path.realpath(change.plugin) if change.plugin else suite.plugin
    if change.solvers:
        data["solver"] = [entry for entry in data["solver"] if entry["name"] in change.solvers]
    named = {entry["name"] for entry in data["solver"]}
    own = [change.plugin.stem] if change.plugin and not change.solvers else []
    data["solver"] += [{"name": name} for name in (*change.solvers, *own) if name not in named]
    changes = {
        "tolerances": list(change.tolerances),
        "repeats": change.repeats,
        "threads": list(change.threads),
        "time_limit_s": change.time_limit_s,
        "memory_limit_mib": change.memory_limit_mib,
        "reference_limit_s": change.reference_limit_s,
        "plugin": plugin,
    }
    changes = {key: value for key, value in changes.items() if value not in ([], None)}
    data |= changes
    if "time_limit_s" in changes:
        data.pop("time_limit_by_size_s", None)
    for entry in data["solver"]:
        if change.forms:
            entry["forms"] = list(change.forms)
        for key in changes:  # of the suite: they override the entry's
            entry.pop(key, None)
    if faults:
        raise InputError(faults)
    return suite_from(data, Path("command line"))


def _sizes(scenes: list[str]) -> Iterator[tuple[str, int]]:
    for scene in scenes:
        size = read_scene(scene).expected_size
        if size is not None:
            yield scene, size[0]
