"""The packaged scenes that solvers are compared on: problems/scenes/<n>/<active>.toml, …/scaling/<n>.toml."""

import json
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_problems import problem_in

from harness.solving.solver_session import SolverSession
from problems.build import load_case, prepared
from problems.effects.fasteners import Fasteners
from problems.forms.assembly import stacked
from problems.scene_files import SCENES, Scene, read_scene, scene_names
from solvers.registry import make_solver

COMPARED = [name for name in scene_names() if not name.startswith("gallery/")]
SCALING = [name for name in COMPARED if name.startswith("scaling/")]
LONGEST = "scaling/401408"
PUBLISHED = Path(__file__).parents[2] / "results" / "published"
#: Of the paper: active constraints; contacts and cond(K) by size.
TABLE_2 = (52, 107, 418, 795, 863, 1074, 1128, 1347, 1471, 1592)
TABLE_4 = {4386: (2193, 2.63e6), 6112: (3056, 1.11e7), 11308: (5654, 1.77e7)}


@cache
def read(name: str) -> Scene:
    """A packaged scene, read once for all tests here."""
    return read_scene(name)


def size(scene: Scene) -> int:
    return scene.expected_size[0]


@pytest.mark.parametrize("name", COMPARED)
def test_every_scene_reads_and_its_title_gives_the_active_count_and_the_pressure(name: str) -> None:
    scene = read(name)
    n = int(name.split("/")[name.startswith("scaling/")])
    assert (scene.name, scene.expected_size) == (name, (n, n // 2))
    assert {type(effect).__name__ for effect in scene.effects} >= {"InitialGap", "Fasteners"}
    if name != LONGEST:  # whose count nothing has been run for
        count = re.search(r"about (\d+) active contacts", scene.title)
        assert 0 < int(count[1]) < size(scene) // 2
    if name in SCALING:
        assert scene.title.startswith(f"Scaling, n = {size(scene)}: ")
    else:
        assert int(count[1]) == int(name.split("/")[1])
    pressures = {getattr(e, "value", 0.0) for e in scene.effects if type(e).__name__ == "Pressure"}
    stated = re.search(r"pressure (\S+) MPa", scene.title)
    value = float(stated[1]) if stated else 0.0
    assert pressures == ({value, -value} if value else set())
    assert scene.unusual == []


def test_names_are_unique_and_the_smallest_problem_stands_first() -> None:
    """First the three problems of the paper, then those of the scaling."""
    assert len(set(scene_names())) == len(scene_names()) == len(list(SCENES.rglob("*.toml")))
    names = COMPARED
    assert names[-len(SCALING) :] == SCALING
    for group in (names[: -len(SCALING)], SCALING):
        sizes = [size(read(name)) for name in group]
        assert sizes == sorted(sizes)
    assert len({read(name).key for name in names}) == len(names)


def test_a_scene_by_name_and_by_path_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(SCENES.parents[1])
    named = read("4386/0107")
    assert read_scene("problems/scenes/4386/0107.toml") == named
    assert read_scene(str(SCENES / "4386" / "0107.toml")) == named


def test_scenes_of_one_size_share_their_matrices() -> None:
    scenes = [read(name) for name in COMPARED]
    keys = {(size(scene), scene.assembly_key) for scene in scenes}
    assert len(keys) == len({n for n, _ in keys}) == len({key for _, key in keys}) == 9


def file(folder: str, name: str) -> dict[str, Any]:
    return tomllib.loads((SCENES.parent / folder / f"{name}.toml").read_text(encoding="utf-8"))


def test_scaling_scenes_differ_in_nothing_but_the_grid() -> None:
    names = [name for name in SCALING if name != LONGEST]
    tables = [file("scenes", name) for name in names]
    assert [size(read(name)) for name in names] == [1170, 2522, 4386, 6762, 11308, 24080, 100352]
    joints = [file("assemblies", table.pop("assembly")) for table in tables]
    for table, joint in zip(tables, joints, strict=True):
        del table["title"]
        del joint["junction"]["nodes"]
        for part in joint["part"]:
            for side in {"south", "north"} & set(part):
                del part[side]["elements"]
    assert all(table == tables[0] for table in tables)
    assert all(joint == joints[0] for joint in joints)


@pytest.mark.parametrize("name", SCALING)
def test_no_two_fasteners_of_the_scaling_meet_on_a_node(name: str) -> None:
    scene = read(name)
    (fasteners,) = (effect for effect in scene.effects if isinstance(effect, Fasteners))
    force = fasteners.force(scene.joint)
    assert np.array_equal(np.unique(force), [-fasteners.preload, 0.0, fasteners.preload])
    assert np.count_nonzero(force) == 2 * len(fasteners.marks(scene.joint))


@pytest.mark.parametrize("n", TABLE_4)
def test_every_size_has_from_few_to_many_active_constraints(n: int) -> None:
    """The paper's ten at the smallest size and one with nearly all contacts closed; else six and more."""
    counts = [int(name.split("/")[1]) for name in scene_names() if name.startswith(f"{n}/")]
    if n == 4386:
        assert tuple(counts) == (*TABLE_2, 2150)
        return
    fractions = np.array(counts) / TABLE_4[n][0]
    assert ((fractions > 0.05) & (fractions < 0.95)).sum() >= 6


def test_the_condition_is_that_of_all_eigenvalues() -> None:
    """Of both blocks, where the build takes a few by Lanczos."""
    data = prepared(read("scaling/1170"))
    assert (data.assembly.n, data.assembly.m) == (1170, 585)
    values = np.concatenate([np.linalg.eigvalsh(K) for K in data.assembly.K.matrices])
    assert data.facts["cond_K"] == pytest.approx(values.max() / values.min(), rel=1e-6)


def test_the_conditions_measured_are_those_of_the_paper() -> None:
    problems = (PUBLISHED / "default" / "problems.jsonl").read_text("utf-8").splitlines()
    found = {problem["n"]: problem["cond_K"] for problem in map(json.loads, problems)}
    for n, (_, condition) in TABLE_4.items():
        assert found[n] == pytest.approx(condition, rel=0.01)


@pytest.mark.slow
def test_active_constraints_of_the_paper() -> None:
    data = prepared(read("4386/0052"), form="sparse")  # what all scenes of the smallest size share
    session = SolverSession(make_solver("newton", {}), problem_in(data, "sparse"), 1e-10)
    session.open(batched=True)
    loads = session.problem.loads([load_case(read(f"4386/{count:04}"), "sparse") for count in TABLE_2])
    lam = np.column_stack([np.asarray(answer.lam) for answer in session.solve_batch(loads)])
    assert abs((lam > 0).sum(axis=0) - TABLE_2).max() <= 22  # 1 % of m
    assert lam.min() >= 0
    assert (data.compliance @ lam - data.overlap(stacked(loads))).min() > -1e-9
