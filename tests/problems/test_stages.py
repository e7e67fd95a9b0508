"""Stages against closed forms, against scenes made by hand, and against each other; and bad stages."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Self

import numpy as np
import pytest
from refusals import refusal_of
from riveted_strips import FORCE, STIFFNESS, C, Tables, approach, joint_scene, strips
from small_joints import JOINT as PLATES
from small_joints import make_scene, two_parts, untied
from superelements import stiffnesses, write_part, write_plates

from harness.scene.solution import solve
from problems.build import adopts_model, load_case, prepared
from problems.effects.installed_fasteners import InstalledFasteners
from problems.errors import InputError
from problems.forms import Form
from problems.load_cases.sweep import keys_of
from problems.model.fastener_forces import fastener_forces
from problems.model.interface import AnyJoint
from problems.model.scene import JointScene
from problems.model.stage_answers import stage_scenes
from problems.model.stages import StagePlan
from problems.scene_files import read_scene


@pytest.mark.parametrize("form", ["dual", "sparse"])
@pytest.mark.parametrize("preload", [0.0, 25.0])
def test_spring_back_of_a_strip(form: Form, preload: float) -> None:
    """w₁ = Pc; after the release the rivet carries k (w₁ − w₂) + R = w₂ / c.

    The width of the strips bends between the two forces, too: c is 1.4e-4 above that of a beam.
    """
    answer = solve(strips(preload=preload / 2), form=form)
    first = answer.stages[0].forces["tacks"] * C
    assert approach(answer, 0) == pytest.approx(first, rel=2e-4)
    first = approach(answer, 0)
    c = first / FORCE
    springs_back = (first * STIFFNESS + preload) * c / (1 + STIFFNESS * c)
    set_there = first + preload * c / (1 + STIFFNESS * c)
    found = [approach(answer, stage) for stage in (1, 2)]
    np.testing.assert_allclose(found, [set_there, springs_back], rtol=1e-9)
    *_, last = answer.stages
    assert last.forces["rivets"] == pytest.approx(springs_back / c, rel=1e-7)
    assert [stage.judgement.verdict for stage in answer.stages] == ["within"] * 3


PART = {"north": {"length": 90.0, "elements": 2}, "clamped": ["north"], "thickness": 3.0}
JOINT = {
    "junction": {"length": 400.0, "width": 120.0, "nodes": [9, 5]},
    "part": [PART | {"name": "a"}, PART | {"name": "b", "thickness": 4.0}],
}
RIVETS = [[60.0, 20.0], [140.0, 30.0], [210.0, 20.0], [340.0, 33.0]]
CLAMPS = {
    "kind": "clamps",
    "name": "clamps",
    "clamping_force": 90.0,
    "points": [[100.0, 40.0], [270.0, 40.0]],
}
EFFECTS: list[Tables] = [
    {"kind": "initial_gap", "mean": 0.5, "random": {"sd": 0.2, "correlation_length": 90.0, "seed": 3}},
    CLAMPS,
    {"kind": "installed_fasteners", "name": "rivets", "stiffness": 2e4, "points": RIVETS},
    {"kind": "pressure", "part": "a", "value": 2e-4},
]


def joined(stages: list[Tables], effects: list[Tables] = EFFECTS, joint: Tables = JOINT) -> JointScene:
    return joint_scene({"joint": joint, "effect": effects, "stage": stages})


def rivets_of(path: Path, points: list[list[float]], *stages: str) -> Tables:
    """Rivets at points of a CSV, written here, that names the stage of each."""
    rows = [f"{x},{y},{stage}\n" for (x, y), stage in zip(points, stages, strict=True)]
    path.write_text("x,y,stage\n" + "".join(rows))
    return {"kind": "installed_fasteners", "stiffness": 2e4, "file": str(path)}


CLAMP, RELEASE = {"name": "clamp", "on": ["clamps"]}, {"name": "release", "off": ["clamps"]}
ONCE = [CLAMP, {"name": "rivet", "on": ["rivets"]}, RELEASE]


def test_a_clamp_that_comes_and_goes_changes_nothing() -> None:
    plain = [effect for effect in EFFECTS if effect["kind"] not in ("clamps", "installed_fasteners")]
    answer = solve(joined([CLAMP, RELEASE, CLAMP | {"name": "2"}, RELEASE | {"name": "3"}], [*plain, CLAMPS]))
    alone = solve(joined([], plain))
    assert alone.stages == ()
    assert abs(answer.x - alone.x).max() <= 1e-12
    assert answer.stages[0].gap.min() >= -1e-12
    assert abs(answer.stages[0].x - alone.x).max() > 0.01
    np.testing.assert_array_equal(answer.stages[0].x, answer.stages[2].x)


def test_the_order_of_rivets_matters_only_if_something_acts_between() -> None:
    some: list[Tables] = [
        {"name": "1", "on": ["rivets[2:]", "rivets[0:1]"]},
        {"name": "2", "on": ["rivets[1:2]"]},
    ]
    together, apart = solve(joined(ONCE)), solve(joined([CLAMP, *some, RELEASE]))
    assert abs(together.x - apart.x).max() <= 1e-10
    between = solve(joined([CLAMP, some[0], RELEASE, some[1]]))
    assert abs(together.x - between.x).max() > 1e-3


def test_by_hand_and_stage_by_stage() -> None:
    """Three scenes, the approaches of the second written into the third; and each stage solved alone."""
    answer = solve(joined(ONCE))
    clamped = solve(joined([], EFFECTS[:2] + EFFECTS[3:]))
    (rivets,) = [effect for effect in answer.stages[-1].scene.effects if effect.kind == "installed_fasteners"]
    W = clamped.problem.scene.joint.weights(np.array(RIVETS))  # type: ignore[attr-defined]
    a, b = clamped.x.reshape(2, -1)
    reached = W @ (a - b)
    by_hand = solve(joined([], [EFFECTS[0], EFFECTS[3], EFFECTS[2] | {"approach": reached.tolist()}]))
    assert abs(by_hand.x - answer.x).max() <= 1e-10
    assert rivets.approach == pytest.approx(reached.tolist(), abs=1e-12)  # type: ignore[attr-defined]
    for stage in answer.stages:
        alone = solve(stage.scene)
        assert abs(alone.x - stage.x).max() <= 1e-10
        assert alone.stages == ()


class Layer(InstalledFasteners):
    """Springs that stages set as a whole."""

    def element_count(self, joint: AnyJoint) -> int:
        return 0

    def only(self, elements: Sequence[int], joint: AnyJoint) -> Self:
        return self


def test_springs_without_elements_lock_as_those_at_points() -> None:
    scene = joined(ONCE)
    effects = [
        Layer(**effect.model_dump()) if isinstance(effect, InstalledFasteners) else effect
        for effect in scene.effects
    ]
    for stages in (scene.stages, ()):
        points = replace(scene, stages=stages)
        np.testing.assert_array_equal(solve(replace(points, effects=tuple(effects))).x, solve(points).x)


def test_each_part_is_in_equilibrium_in_each_stage() -> None:
    """K of the parts alone takes all forces: those of effects, of springs and of contacts."""
    rivets = EFFECTS[2] | {"preload": 15.0}
    for stage in solve(joined(ONCE, [*EFFECTS[:2], rivets, EFFECTS[3]])).stages:
        scene = untied(stage.scene)
        K = prepared(scene).assembly.K
        taken = load_case(scene).f - scene.joint.contact_matrix() @ stage.lam
        forces = [one["force_N"] for one in fastener_forces(stage.scene, stage.x)]
        for effect in stage.scene.effects:
            if effect.kind == "installed_fasteners":
                T, _ = effect.springs(scene.joint)  # type: ignore[attr-defined]
                taken += T @ forces[-T.shape[1] :]
        assert abs(K.multiply(stage.x) - taken).max() <= 1e-8
        assert stage.forces["contacts"] == pytest.approx(stage.lam.sum())


def test_a_clamp_through_a_stack_counts_once_and_a_rivet_in_each_contact() -> None:
    stack = JOINT | {"part": [*JOINT["part"], PART | {"name": "c"}]}
    (stage,) = solve(joined([CLAMP], EFFECTS[:3], stack)).stages
    springs = [one for one in fastener_forces(stage.scene, stage.x) if one["kind"] == "installed_fasteners"]
    assert len(springs) == 2 * len(RIVETS)
    assert stage.forces["clamps"] == 2 * 90.0
    assert stage.forces["rivets"] == pytest.approx(sum(one["force_N"] for one in springs))


def test_superelements_go_through_the_same_stages(tmp_path: Path) -> None:
    parts = write_plates(tmp_path, joined(ONCE).joint)  # type: ignore[arg-type]
    effects = [{"kind": "initial_gap", "mean": 0.4}, *EFFECTS[1:3]]
    one, other = solve(joined(ONCE, effects)), solve(joined(ONCE, effects, {"part": parts}))
    for mine, theirs in zip(one.stages, other.stages, strict=True):
        assert abs(mine.x - theirs.x).max() <= 1e-8


def test_what_the_last_stage_sets_is_in_its_problem() -> None:
    """Fasteners of two effects, each with approaches of its own."""
    pins = EFFECTS[2] | {"name": "pins", "points": [[30.0, 90.0], [370.0, 90.0]]}
    together = {"name": "rivet", "on": ["rivets", "pins"]}
    answer = solve(joined([CLAMP, together], [*EFFECTS, pins]))
    springs = [e for e in answer.problem.scene.effects if e.kind == "installed_fasteners"]  # type: ignore[attr-defined]
    scene = joined([], EFFECTS)
    W = [scene.joint.weights(np.array(points)) for points in (RIVETS, pins["points"])]  # type: ignore[union-attr]
    a, b = answer.x.reshape(2, -1)
    for spring, weights in zip(springs, W, strict=True):
        np.testing.assert_allclose(spring.approach, weights @ (a - b), atol=1e-9)
    assert answer.stages[-1].forces["rivets"] == pytest.approx(0.0, abs=1e-4)


def test_stages_share_the_stiffness_that_they_have_in_common() -> None:
    scenes = [*stage_scenes(joined([CLAMP, {"name": "drill"}, *ONCE[1:]])).values()]
    assert [adopts_model(scene, scenes[0]) for scene in scenes] == [True, True, False, False]
    assert scenes[1].model is not None
    with pytest.raises(InputError, match="no stages here"):
        prepared(joined(ONCE))


def test_a_name_is_in_no_key_and_stages_are() -> None:
    named = {key: value for key, value in EFFECTS[2].items() if key != "name"}
    bare = joined([], [EFFECTS[0], named])
    assert joined([], [EFFECTS[0], EFFECTS[2]]).key == bare.key
    keys = {joined(stages).key for stages in ([], ONCE, [*ONCE, {"name": "drill"}])}
    assert len(keys) == 3


def test_the_stage_of_a_point_may_stand_in_its_file(tmp_path: Path) -> None:
    from_file = rivets_of(tmp_path / "rivets.csv", RIVETS, "first", "second", "first", "second")
    effects = [*EFFECTS[:2], from_file | {"name": "rivets"}, EFFECTS[3]]
    stages = [CLAMP, {"name": "first"}, RELEASE, {"name": "second"}]
    listed = [CLAMP, {"name": "first", "on": ["rivets[0:1]", "rivets[2:3]"]}, RELEASE]
    listed += [{"name": "second", "on": ["rivets[1:2]", "rivets[3:4]"]}]
    one, other = stage_scenes(joined(stages, effects)), stage_scenes(joined(listed))
    assert [scene.key for scene in one.values()] == [scene.key for scene in other.values()]
    with pytest.raises(InputError, match=r"line 3 = 'second': no such stage.*allowed: clamp, first"):
        joined(stages[:2], effects)


def test_effects_of_a_scene_keep_the_stages_of_their_points(tmp_path: Path) -> None:
    """A scene made of the effects of another has its stages; more points than these are refused."""
    from_file = rivets_of(tmp_path / "rivets.csv", RIVETS[:2], "first", "second")
    scene = joined([CLAMP, {"name": "first"}, {"name": "second"}], [*EFFECTS[:2], from_file])
    table = {"joint": scene.joint, "effect": list(scene.effects), "stage": list(scene.stages)}
    again = joint_scene(table)
    assert [one.key for one in stage_scenes(again).values()] == [
        one.key for one in stage_scenes(scene).values()
    ]
    assert len(stage_scenes(again)["clamp"].effects) == 2
    more = scene.effects[2].model_copy(update={"points": tuple(map(tuple, RIVETS))})
    with pytest.raises(InputError, match=r"points = '4 points': 2 points: the column stage"):
        joint_scene(table | {"effect": [*scene.effects[:2], more]})


def test_the_order_of_stages_that_files_name_is_in_the_key(tmp_path: Path) -> None:
    from_file = rivets_of(tmp_path / "rivets.csv", RIVETS[:2], "first", "second")
    orders = ["first", "second"], ["second", "first"]
    scenes = [joined([{"name": name} for name in order], [EFFECTS[0], from_file]) for order in orders]
    assert scenes[0].key != scenes[1].key


def test_no_column_of_its_file_sets_a_gap_in_a_stage(tmp_path: Path) -> None:
    """It acts as a whole: before that stage the gap would be 0."""
    (tmp_path / "gap.csv").write_text("x,y,gap,stage\n0,0,0.5,clamp\n400,0,0.5,clamp\n0,120,0.5,clamp\n")
    gap = {"kind": "measured_gap", "file": str(tmp_path / "gap.csv")}
    with pytest.raises(InputError, match=r"measured_gap\).file = 'a column stage': .*acts as a whole"):
        joined(ONCE, [gap, *EFFECTS[1:]])


def test_a_shift_of_rivets_that_a_stage_sets_gives_them_no_approach() -> None:
    scene = joined(ONCE)
    assert keys_of(scene, stiffness=True)["installed_fasteners.points.x"].faults(scene, 1.0, "--find") == []


PIN = [[390.0, 100.0]]
HALVES = [{"name": "1", "on": ["rivets[2:4]"]}, {"name": "2", "on": ["rivets[0:2]"]}]
SUPPORTS = [[0.0, 10.0], [400.0, 10.0], [200.0, 200.0]]
RIVETED = "effect[2] (installed_fasteners)"
BAD: list[tuple[list[Tables], Tables, str, str]] = [
    ([{"name": "1", "on": ["clamp"]}], {}, "stage[0] (1).on = 'clamp'", "did you mean clamps?"),
    ([CLAMP, {"name": "2", "on": ["clamps[0:1]"]}], {}, "stage[1] (2).on = 'clamps[0:1]'", "set twice"),
    ([RELEASE], {}, "stage[0] (release).off = 'clamps'", "before it is set"),
    ([{"name": "1", "on": ["rivets[2:9]"]}], {}, "'rivets[2:9]'", "0 <= a < b <= 4"),
    ([{"name": "1", "on": ["tool[0:1]"]}], {}, "'tool[0:1]'", "it has no points"),
    ([{"name": "1", "on": [f"clamps[0:{'9' * 5000}]"]}], {}, "clamps[0:9", "no such effect"),
    ([CLAMP, {"name": "clamp"}], {}, "stage[1].name = 'clamp'", "stage[0] has it"),
    ([{"on": ["clamps"]}], {}, "stage[0].name", "required"),
    ([CLAMP | {"on": "clamps"}], {}, "stage[0].on = 'clamps'", "must be a list"),
    ([CLAMP | {"of": []}], {}, "stage[0].of", "did you mean off?"),
    ([{"name": "1", "on": ["rivets"]}], {"approach": 0.1}, f"{RIVETED}.approach", "leave it out"),
    ([{"name": "1", "on": ["tool"]}], {}, "effect[4] (rigid_tool).name = 'tool'", "makes a contact"),
    ([{"name": "1", "on": ["rivets[0:3]"]}], {}, f"{RIVETED}.name", "or none: 3 is in none"),
    ([CLAMP], {"name": "clamps"}, "effect[2].name = 'clamps'", "effect[1] has it"),
    ([CLAMP], {"name": "contacts"}, "effect[2].name = 'contacts'", "the forces of contacts"),
    ([CLAMP], {"name": "initial_gap"}, "effect[2].name = 'initial_gap'", "calls its effects"),
    (
        [{"name": "1", "on": ["rivets"]}],
        {"points": PIN},
        f"{RIVETED}.points",
        "separate places: installed_fasteners acts at the same ones, in stage 1",
    ),
    ([CLAMP], {"approach": [0.1, 0.2]}, "approach", "one for each of 4 springs"),
    ([CLAMP], {"preload": -1.0}, "preload", "in N"),
    (HALVES, {"preload": [1.0, 2.0, 3.0]}, f"{RIVETED}.preload", "each of 4 points"),
    (HALVES, {"points": [*RIVETS[:3], RIVETS[2]]}, "points[3] = [210.0, 20.0]", "points[2] is there, too"),
    (
        [{"name": "hold", "on": ["legs"]}, {"name": "let go", "off": ["legs[0:2]"]}],
        {},
        "part.b = [(200.0, 200.0)]",
        "in stage let go: it tilts about a point",
    ),
]


@pytest.mark.parametrize(("stages", "rivets", "where", "allowed"), BAD)
def test_bad_stages(stages: list[Tables], rivets: Tables, where: str, allowed: str) -> None:
    tool = {"kind": "rigid_tool", "name": "tool", "part": "b", "distance": 5.0}
    legs = {"kind": "supports", "name": "legs", "part": "b", "points": SUPPORTS}
    legged = PART | {"name": "b", "clamped": []}
    joint = JOINT | {"part": [PART | {"name": "a"}, legged]}
    pin = {"kind": "installed_fasteners", "between": ["a", "b"], "points": PIN, "approach": 0.1}
    effects = [*EFFECTS[:2], EFFECTS[2] | rivets, EFFECTS[3], tool, legs, pin]
    (line,) = str(refusal_of(joined, stages, effects, joint)).split("\n")
    assert where in line
    assert allowed in line


def test_an_effect_whose_kind_is_contacts_needs_a_name() -> None:
    """One of the user's own: its forces were hidden by those of the contacts."""
    scene = joined([])
    own = scene.effects[2].model_copy(update={"kind": "contacts", "name": None})
    assert [key for key, *_ in StagePlan([own], [], scene.joint).faults()] == ["effect[0].name"]


def test_all_bad_stages_at_once(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("stage = 3\n[joint]\njunction = { length = 9.0, width = 9.0, nodes = [2, 2] }\n")
    with pytest.raises(InputError, match="stage = 3: tables"):
        read_scene(str(path))
    bad = [{"name": "1", "on": ["clamp", "rivets[9:]"]}, {"name": "2", "off": ["clamps"]}]
    assert len(refusal_of(joined, bad).faults) == 3


def test_an_effect_has_its_number_in_its_own_file(tmp_path: Path) -> None:
    """Beside those of the file of the assembly, which come first."""
    clamps = '[[effect]]\nkind = "clamps"\nclamping_force = 1.0\npoints = [[9.0, 9.0]]\n'
    joint = two_parts().replace("[joint]", "").replace("joint.part", "part")
    (tmp_path / "joint.toml").write_text(joint + clamps)
    path = tmp_path / "scene.toml"
    path.write_text(f'assembly = "joint.toml"\n{clamps}name = "contacts"\n')
    with pytest.raises(InputError, match=r"scene\.toml: effect\[0\]\.name = 'contacts'"):
        read_scene(str(path))


def test_a_superelement_that_a_stage_leaves_free_is_named_with_the_stage(tmp_path: Path) -> None:
    plates = joined([])
    K, nodes = stiffnesses(plates.joint), plates.joint.nodes_of("a")  # type: ignore[arg-type]
    free = np.column_stack([np.ones(45), nodes])
    Q, _ = np.linalg.qr(free)
    P = np.eye(45) - Q @ Q.T
    xyz = np.column_stack([nodes, np.zeros(45)])
    parts = [write_part(tmp_path, "a", K[0], xyz), write_part(tmp_path, "b", P @ K[1] @ P, xyz)]
    holds = EFFECTS[2] | {"name": "holds", "points": [[10.0, 90.0], [390.0, 90.0], [200.0, 110.0]]}
    stages = [{"name": "hold", "on": ["holds"]}, {"name": "let go", "off": ["holds"]}]
    with pytest.raises(
        InputError, match=r"part\.b, in stage let go = 'translation along z.*no free rigid motion"
    ):
        solve(joined(stages, [EFFECTS[0], holds], {"part": parts}))


def test_two_files_of_effects_of_one_kind_without_names(tmp_path: Path) -> None:
    first, last = (
        rivets_of(tmp_path / name, points, "first", "second")
        for name, points in (("1.csv", RIVETS[:2]), ("2.csv", RIVETS[2:]))
    )
    effects = [*EFFECTS[:2], first, last]
    scene = joined([CLAMP, {"name": "first"}, {"name": "second"}], effects)
    counts = [
        sum(effect.element_count(stage.joint) for effect in stage.effects_of(InstalledFasteners))
        for stage in stage_scenes(scene).values()
    ]
    assert counts == [0, 2, 4]
    (warning,) = joined([], effects[:3]).unusual
    assert warning.startswith("installed_fasteners.stage = a column is unusual")


def test_some_points_of_a_file_keep_their_lines_and_stages(tmp_path: Path) -> None:
    from_file = rivets_of(tmp_path / "rivets.csv", RIVETS[:3], "first", "second", "first")
    scene = joined([CLAMP, {"name": "first"}, {"name": "second"}], [*EFFECTS[:2], from_file])
    some = stage_scenes(scene)["first"].effects[2]
    assert [some.point_name(k) for k in range(2)] == ["rivets.csv, line 2", "rivets.csv, line 4"]
    assert some._stages == ("first", "first")


def test_supports_that_are_shifted_in_a_stage() -> None:
    """The last of two stages is the scene in which the supports are shifted from the start."""
    supports = {"kind": "supports", "part": "a", "points": [[0.0, 0.0], [400.0, 0.0], [200.0, 120.0]]}
    shift = {"kind": "support_shift", "name": "jack", "part": "a", "points": [[200.0, 120.0]], "shift": 0.5}
    held = [*EFFECTS[:1], supports, shift]
    first, last = stage_scenes(joined([{"name": "lie"}, {"name": "lift", "on": ["jack"]}], held)).values()
    assert abs(load_case(first).f).max() == 0.0
    assert abs(load_case(last).f).max() > 1.0
    np.testing.assert_array_equal(load_case(last).f, load_case(joined([], held)).f)


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_matrices_with_springs_have_keys_of_their_own(form: Form) -> None:
    """The key names proven bounds in the cache, and the springs are in K."""
    points = ((150.0, 60.0),)
    springs = [InstalledFasteners(kind="installed_fasteners", points=points, stiffness=k) for k in (1e3, 1e4)]
    scenes = make_scene(PLATES), *(make_scene(PLATES, spring) for spring in springs)
    assert len({prepared(scene, form=form).key for scene in scenes}) == 3
