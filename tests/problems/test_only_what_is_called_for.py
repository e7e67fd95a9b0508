"""An effect that no scene names is not imported, allocates nothing and changes no bit."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from effect_tables import JOINT, TABLES, scene_of
from small_joints import make_scene, untied

from problems.build import prepared
from problems.model.effect import StiffnessEffect
from problems.model.effect_tables import effect_kinds
from problems.model.scene import plain
from problems.scene_files import read_scene, scene_names

ROOT = Path(__file__).parents[2]

#: A scene without effects, then each other one by a process of its own, forked from that which built it.
RUN = """
import os, sys, numpy as np
import problems
assert problems.__path__ == [os.path.join(os.getcwd(), "problems")]
from problems.build import load_case, prepared
from problems.scene_files import read_scene
joint_alone, *scene_files = sys.argv[1:]
scene = read_scene(joint_alone)
prepared(scene).Q, load_case(scene)
assert not any(m.startswith("problems.effects.") for m in sys.modules)
for scene_file in scene_files:
    if os.fork():
        assert os.wait()[1] == 0
        continue
    scene = read_scene(scene_file)
    made = prepared(scene)
    load = load_case(scene)
    blocks = {f"K{i}": K for i, K in enumerate(made.assembly.K.matrices)}
    np.savez(scene_file + ".npz", f=load.f, g=load.g, Q=made.Q, key=scene.key, **blocks)
    print(*[m for m in sys.modules if m.startswith("problems.")], flush=True)
    os._exit(0)
"""


def imported(scenes: list[Path], cache: Path, package: Path = ROOT) -> list[set[str]]:
    """The modules of `problems` in the folder `package` that each scene but the first needs, into .npz."""
    done = subprocess.run(
        [sys.executable, "-c", RUN, *map(str, scenes)],
        cwd=package,
        env={"RIVETBENCH_CACHE": str(cache), "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    return [set(line.split()) for line in done.stdout.splitlines()]


def test_every_kind_has_a_smallest_scene_here() -> None:
    assert set(TABLES) == set(effect_kinds())


def test_a_named_effect_imports_itself_alone_and_needs_no_other_file(tmp_path: Path) -> None:
    """Each kind, and some together: their bits are the same from a copy without the other effects' files."""
    some = ["installed_fasteners", "ribs", "rigid_tool", "self_weight", "shims"]
    wanted = [[kind] for kind in sorted(set(TABLES) - {"support_shift"})] + [some]
    joint_alone, scenes = tmp_path / "joint.toml", [scene_of(tmp_path, *kinds) for kinds in wanted]
    joint_alone.write_text(JOINT)
    found = imported([joint_alone, *scenes], tmp_path / "all")
    effects = [[m for m in sorted(modules) if m.startswith("problems.effects.")] for modules in found]
    assert effects == [[f"problems.effects.{kind}" for kind in kinds] for kinds in wanted]
    shutil.copytree(ROOT / "problems", tmp_path / "problems", ignore=shutil.ignore_patterns("__pycache__"))
    for kind in set(effect_kinds()) - set(some):
        (tmp_path / "problems" / "effects" / f"{kind}.py").unlink()
    arrays = scenes[-1].with_suffix(".toml.npz")
    bits = arrays.read_bytes()
    (bare,) = imported([joint_alone, scenes[-1]], tmp_path / "bare", tmp_path)
    assert bare == found[-1]
    assert arrays.read_bytes() == bits


def test_keys_of_packaged_scenes_are_made_of_these_names_alone() -> None:
    """What enters a scene's key, written down: a name added here outdates every published result."""
    parameters = {
        "initial_gap": {"kind", "mean", "random"},
        "fasteners": {"kind", "preload", "points", "pattern"},
        "pressure": {"kind", "part", "value"},
        "supports": {"kind", "part", "points", "stiffness_per_point"},
        "ribs": {"kind", "part", "lines", "I", "J"},
        "stringers": {"kind", "part", "pitch", "start", "stop", "I", "J"},
    }
    joint = {"junction", "part", "contacts"}
    part = {"name", "thickness", "young", "poisson", "south", "north", "clamped"}
    for name in scene_names():
        if name.startswith("gallery/"):
            continue
        scene = read_scene(name)
        assert set(plain(scene.joint)) == joint
        assert all(set(table) == part for table in plain(scene.joint)["part"])
        for effect in scene.effects:
            assert set(plain(effect)) == parameters[effect.kind]


@pytest.mark.parametrize("kind", sorted(TABLES))
def test_stiffness_alone_changes_the_assembly(kind: str, tmp_path: Path) -> None:
    """Springs between parts do not: they are added to the parts as they are in the cache."""
    needed = ["supports"] if kind == "support_shift" else []
    with_it = read_scene(str(scene_of(tmp_path, *needed, kind)))
    *others, effect = with_it.effects
    without = make_scene(with_it.joint, *others)
    stiffens = isinstance(effect, StiffnessEffect)
    assert (with_it.assembly_key != without.assembly_key) is stiffens
    assert (prepared(untied(with_it)).key != prepared(without).key) is stiffens
    assert with_it.key != without.key
