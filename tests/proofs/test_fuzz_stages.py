"""Stages and shims without end: each stage is the scene of its own gaps, forces and springs.

That scene has measured gaps in place of shims, and each rivet has the approach that is left without it.
Some fifteen joints; RIVETBENCH_LONG=1 takes 5 000, RIVETBENCH_LONG=N takes N.
"""

from itertools import pairwise
from typing import Any

import numpy as np
from riveted_strips import Tables, joint_scene
from sample_size import Log, draws

from harness.scene.solution import Solution, solve
from problems.forms import Form

SEED = 4
LENGTH, WIDTH = 200.0, 60.0
TOLERANCE_MM = 1e-9
Random = np.random.Generator


def test_each_stage_is_the_scene_made_by_hand() -> None:
    log, count = Log(), draws(15, 5000)
    for index in range(count):
        with log.contained(f"draw {index}", 60):
            _check(log, np.random.default_rng([SEED, index]))
    log.nothing_found()
    # Else the assertion above says little.
    assert min(log.seen[word] for word in ("rivets", "preload", "shims", "tapered", "opens")) > count / 8


def _check(log: Log, random: Random) -> None:
    parts = ["a", "b", "c"][: int(random.integers(2, 4))]
    joint, effects = _joint(random, parts), _effects(random, parts)
    stages = _stages(random, [effect for effect in effects if "name" in effect])
    form: Form = "dual" if random.random() < 0.5 else "sparse"
    answer = solve(joint_scene({"joint": joint, "effect": effects, "stage": stages}), form=form)
    acting: list[str] = []
    locked: dict[str, list[float]] = {}

    def by_hand() -> Solution:
        return solve(joint_scene({"joint": joint, "effect": _tables(joint, effects, acting, locked)}))

    for table, stage in zip(stages, answer.stages, strict=True):
        acting = [name for name in acting if name not in table["off"]]
        new = [name for name in table["on"] if name.startswith("rivets")]
        acting += [name for name in table["on"] if name not in new]
        alone = by_hand()
        for name in new:
            rivets = _some(effects, name)
            a, b = (alone.x.reshape(len(parts), -1)[parts.index(part)] for part in rivets["between"])
            weights = joint_scene({"joint": joint}).joint.weights(np.array(rivets["points"]))
            locked[name] = (weights @ (a - b)).tolist()
            log.seen["preload"] += any(rivets["preload"])
        acting += new
        if not (difference := abs((by_hand() if new else alone).x - stage.x).max()) <= TOLERANCE_MM:
            log.fault("wrong", f"{stage.name}: {difference:.1e} mm")
        log.seen.update({name.rstrip("0123456789[:]") for name in acting})
    log.seen["tapered"] += any(isinstance(effect.get("thickness"), list) for effect in effects)
    log.seen["opens"] += any(after.gap.max() > before.gap.max() for before, after in pairwise(answer.stages))


def _joint(random: Random, parts: list[str]) -> Tables:
    nodes = [int(random.integers(5, 10)), int(random.integers(3, 6))]
    side = {"length": 80.0, "elements": 2}
    return {
        "junction": {"length": LENGTH, "width": WIDTH, "nodes": nodes},
        "part": [
            {"name": name, "thickness": random.uniform(1, 5), "clamped": ["north"], "north": side}
            for name in parts
        ],
    }


def _effects(random: Random, parts: list[str]) -> list[Tables]:
    """A random gap and a pressure; clamps, tacks, rivets and shims by names."""

    def points(most: int) -> Any:
        return (random.uniform(2, [LENGTH - 2, WIDTH - 2], (int(random.integers(1, most)), 2))).tolist()

    effects: list[Tables] = [
        {
            "kind": "initial_gap",
            "mean": random.uniform(0, 0.4),
            "random": {"sd": 0.2, "correlation_length": 80.0, "seed": int(random.integers(1000))},
        },
        {"kind": "pressure", "part": "a", "value": random.uniform(-3e-4, 3e-4)},
        {"kind": "clamps", "name": "clamps", "clamping_force": random.uniform(50, 400), "points": points(4)},
        {"kind": "fasteners", "name": "tacks", "preload": random.uniform(50, 400), "points": points(4)},
    ]
    for k, pair in enumerate(pairwise(parts)):
        places = points(6)
        preload = (random.uniform(0, 100, len(places)) * (random.random() < 0.6)).tolist()
        rivets = {"name": f"rivets{k}", "stiffness": 10 ** random.uniform(3, 5.5), "preload": preload}
        effects.append({"kind": "installed_fasteners", "between": pair, "points": places} | rivets)
    for k in range(int(random.integers(0, 4))):
        corners = np.sort(random.uniform(0, [LENGTH, WIDTH], (2, 2)), axis=0)
        x, y = (corners + np.array([[-25, -15], [25, 15]])).T.tolist()  # wide enough for a node
        thickness = random.uniform(0.02, 0.2, 2).tolist()
        pair = parts[:2] if random.random() < 0.5 else parts[-2:]
        thick = thickness if random.random() < 0.5 else thickness[0]
        effects.append(
            {"kind": "shims", "name": f"shims{k}", "between": pair, "thickness": thick, "x": x, "y": y}
        )
    return effects


def _stages(random: Random, named: list[Tables]) -> list[Tables]:
    """What acts is set at once or in two halves, and may be taken out again."""
    stages: list[Tables] = [{"name": str(k), "on": [], "off": []} for k in range(int(random.integers(2, 5)))]
    for effect in named:
        names, count = [effect["name"]], len(effect.get("points", ()))
        if count > 1 and random.random() < 0.5:
            names = [
                f"{effect['name']}[{low}:{high}]" for low, high in ((0, count // 2), (count // 2, count))
            ]
        for name in names:
            first = int(random.integers(len(stages)))
            stages[first]["on"].append(name)
            if first + 1 < len(stages) and random.random() < 0.4:
                stages[int(random.integers(first + 1, len(stages)))]["off"].append(name)
    return stages


def _some(effects: list[Tables], name: str) -> Tables:
    """The effect of that name, without it, with the points that the name asks for."""
    word, _, span = name.partition("[")
    (effect,) = (effect for effect in effects if effect.get("name") == word)
    some = {key: value for key, value in effect.items() if key != "name"}
    if span:
        low, high = map(int, span.rstrip("]").split(":"))
        some |= {key: some[key][low:high] for key in ("points", "preload") if isinstance(some.get(key), list)}
    return some


def _tables(
    joint: Tables, effects: list[Tables], acting: list[str], locked: dict[str, list[float]]
) -> list[Tables]:
    """The effects of a scene without stages, without shims."""
    scene = joint_scene({"joint": joint, "effect": effects[:1]})
    gap, tables = scene.effects[0].gap(scene.joint), [effects[1]]  # type: ignore[attr-defined]
    for name in acting:
        table = _some(effects, name)
        if table["kind"] != "shims":
            tables.append(table | ({"approach": locked[name]} if name in locked else {}))
            continue
        span, places = scene.joint.span(tuple(table["between"])), scene.joint.places(tuple(table["between"]))
        low, high = np.transpose([table["x"], table["y"]])
        axis = int((high - low).argmax())
        share = (places[:, axis] - low[axis]) / (high - low)[axis]
        first, last = np.resize(table["thickness"], 2)
        inside = ((low <= places) & (places <= high)).all(axis=1)
        gap[span] -= np.where(inside, first + (last - first) * share, 0.0)
    for pair in scene.joint.pairs:
        points = np.column_stack([scene.joint.places(pair), gap[scene.joint.span(pair)]]).tolist()
        tables.append({"kind": "measured_gap", "between": list(pair), "points": points})
    return tables
