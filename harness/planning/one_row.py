"""One row of a suite: what has to be measured for it."""

from __future__ import annotations

from collections.abc import Sequence

from problems.errors import InputError
from problems.scene import read_scene

from .plan import Measurement
from .suite import Suite


def with_key(suite: Suite, key: str) -> Suite:
    """The suite with the scene and the solver entries that a row's key names. Raises InputError."""
    scenes = [scene for scene in suite.scenes if key.startswith(f"{read_scene(scene).name} ")]
    words = key.split()
    entries = [e for e in suite.solver if {e.name, *e.label.split()} <= set(words)]
    if not scenes or not entries:
        raise _unknown(suite.name, key)
    return suite.model_copy(update={"scenes": scenes, "solver": entries})


def of_key(plan: Sequence[Measurement], key: str) -> list[Measurement]:
    """The measurement with this key. A load case of a series comes after those that its process solves before
    it, because its start depends on them. Raises InputError.
    """
    chosen = next((m for m in plan if m.key == key), None)
    if chosen is None:
        raise _unknown(plan[0].suite, key)
    if chosen.case is None:
        return [chosen]
    batch = chosen.batched or 1
    end = (chosen.case // batch + 1) * batch
    same = (m for m in plan if (m.process, m.batched) == (chosen.process, chosen.batched))
    return [m for m in same if m.case is not None and m.case < end]


def _unknown(suite: str, key: str) -> InputError:
    return InputError.one("--key", "key", key, f"the `key` of a row that suite {suite} plans, in full")
