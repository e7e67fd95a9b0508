"""Stresses of superelements: those of the plates that they came from, their errors, wrong files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands import harness, wrong_usage
from refusals import refusal_of
from superelements import Array, Tables, flat, scene_from, two_plates, write_part

from harness.scene.solution import solve
from harness.scene.stress import refuse_unusable, stresses, stresses_of
from harness.shimming.study import ShimStudy
from harness.verification.reference import proof_of
from problems.build import model_of
from problems.load_cases import Listed
from problems.model.condensed_plate import CondensedPlate
from problems.model.joint import Joint
from problems.model.scene import JointScene
from problems.model.stress import part_stress
from problems.scene_files import scene_of

EFFECTS: list[Tables] = [
    {"kind": "initial_gap", "mean": 0.3},
    {"kind": "fasteners", "preload": 250.0, "points": [[120.0, 90.0], [240.0, 60.0]]},
]
NOWHERE = np.zeros((0, 2))


def recovery(joint: Joint, k: int) -> tuple[Array, Array]:
    """The Gauss points of a plate, and the stresses there for a unit deflection of each junction node."""
    model = model_of(JointScene("plates", "plates", joint))
    at, columns, places = joint.unknowns(joint.names[k]), [], NOWHERE
    for j in range(at.start, at.stop):
        u = model.part_unknowns(k, np.eye(joint.size[0])[j])
        stress = part_stress("", model.parts[k], (), u, NOWHERE)
        columns.append(stress.components.ravel())
        places = stress.places
    return places, np.column_stack(columns)


def write_recovery(folder: Path, name: str, places: Array, S: Array, sides: list[str]) -> Tables:
    np.savez(folder / f"{name}-otm.npz", S)
    lines = [f"{x!r},{y!r},{side}" for (x, y), side in zip(places.tolist(), sides, strict=True)]
    (folder / f"{name}-stress.csv").write_text("\n".join(["x,y,side", *lines]), "utf-8")
    return {key: str(folder / f"{name}-{end}") for key, end in
            (("stress", "otm.npz"), ("stress_points", "stress.csv"))}  # fmt: skip


def condensed(folder: Path, joint: Joint, recovered: str = "ab") -> list[Tables]:
    """The tables of the plates as superelements; S tells the top of a and the bottom of b."""
    parts = []
    for k, part in enumerate(joint.part):
        alone = joint.model_copy(update={"part": (part,)})
        K = CondensedPlate(alone, np.arange(len(joint.nodes))).stored()[0]["K"]
        name = "ab"[k]
        table = write_part(folder, name, K, flat(joint.nodes))
        if name in recovered:
            places, S = recovery(joint, k)
            side = ["top", "bottom"][k]
            table |= write_recovery(folder, name, places, S * [1, -1][k], [side] * len(places))
        parts.append(table)
    return parts


def test_a_condensed_plate_has_the_plates_stresses(tmp_path: Path) -> None:
    joint = two_plates()
    scene = scene_of({"joint": joint, "effect": EFFECTS})
    plates = stresses(solve(scene, form="sparse"))
    largest = max(part.von_mises.max() for part in plates.parts)
    assert largest > 0.1
    scene = scene_from(condensed(tmp_path, joint), *EFFECTS)
    for form in ("dual", "sparse"):
        found = stresses(solve(scene, form=form))
        for part, plate, error, sign in zip(found.parts, plates.parts, found.errors, (1, -1), strict=True):
            np.testing.assert_array_equal(part.places, plate.places)
            np.testing.assert_array_equal(part.side, sign)
            np.testing.assert_allclose(part.components, sign * plate.components, rtol=0, atol=1e-6 * largest)
            assert 0 < error.max() < 1e-6 * largest


def test_a_stress_is_as_near_as_is_said(tmp_path: Path) -> None:
    """Sensitivities are ‖s‖ in the norm of K⁻¹, springs between the parts included; b is free else."""
    random, joint = np.random.default_rng(5), two_plates()
    parts = condensed(tmp_path, joint, recovered="")
    K_a = np.load(parts[0]["superelement"])["K"]
    flat_motions = np.column_stack([np.ones(len(joint.nodes)), joint.nodes])
    Q, _ = np.linalg.qr(flat_motions)
    K_b = 50 * (np.eye(len(K_a)) - Q @ Q.T)
    np.savez(parts[1]["superelement"], K=K_b)
    S = random.standard_normal((6, len(K_b)))
    parts[1] |= write_recovery(tmp_path, "b", random.uniform(0, 50, (2, 2)), S, ["top", "bottom"])
    points = [[50.0, 30.0], [300.0, 40.0], [150.0, 100.0], [320.0, 110.0]]
    springs = {"kind": "installed_fasteners", "stiffness": 2e3, "approach": 0.1, "points": points}
    scene = scene_from(parts, EFFECTS[0], springs)
    exact, rough = solve(scene), solve(scene, "scs", tolerance=1e-4, form="dual")
    K = np.vstack(
        [K.toarray() if hasattr(K, "toarray") else K for K in exact.problem.prepared.assembly.K.matrices]
    )
    s = np.column_stack([np.zeros((6, len(K_a))), S])
    xx, yy, xy = np.einsum("ij,ji->i", s, np.linalg.solve(K, s.T)).reshape(2, 3).T
    norms = np.sqrt(1.5 * (xx + yy) + 3 * xy)
    errors, (_, of_b) = stresses(exact).errors[1], stresses_of(scene, exact.unknowns)
    problem = exact.problem
    proof = proof_of(problem.prepared)
    energy = proof.energy_error(problem.load, problem.reference.x, problem.reference.lam)
    assert (errors > norms * energy).all()
    np.testing.assert_allclose(errors, norms * energy, rtol=0.025)  # of safety factors
    near, known = stresses(rough), stresses(exact)
    assert (abs(near.parts[1].components - of_b.components).max(axis=1) <= near.errors[1]).all()
    assert (known.errors[1] <= near.errors[1]).all()
    assert not len(known.parts[0].places)


def point_matrix(folder: Path, S: Any, csv: str, **more: Any) -> list[Tables]:
    """Two good parts of six nodes; the first has this S and table of points."""
    folder.mkdir(exist_ok=True)
    xyz = flat(np.column_stack([each.ravel() for each in np.meshgrid([0.0, 10.0, 20.0], [0.0, 10.0])]))
    parts = [write_part(folder, name, np.diag(np.arange(40.0, 46.0)), xyz) for name in "ab"]
    np.savez(folder / "s.npz", **S) if isinstance(S, dict) else np.savez(folder / "s.npz", S)
    (folder / "s.csv").write_text(csv, "utf-8")
    parts[0] |= {"stress": str(folder / "s.npz"), "stress_points": str(folder / "s.csv")} | more
    return parts


GOOD, TWO = np.ones((6, 6)), "x,y,side\n1,2,top\n1,2,bottom\n"
WRONG: dict[str, tuple[Any, str, str, str, str, str]] = {
    "columns": (np.ones((6, 5)), TWO, "s.npz", "S.shape", "[6, 5]", "[6, 6]"),
    "points": (GOOD, TWO + "3,4,top\n", "s.npz", "S.shape", "[6, 6]", "[9, 6]: three per point of s.csv"),
    "a vector": (np.ones(36), TWO, "s.npz", "S.shape", "[36]", "[6, 6]"),
    "side": (GOOD, TWO.replace("bottom", "left"), "s.csv", "line 3, side", "left", "top or bottom"),
    "no side": (GOOD, "x,y\n1,2\n1,2\n", "s.csv", "line 2, side", "", "top or bottom"),
    "no number": (GOOD, TWO.replace("2,top", "n,top"), "s.csv", "line 2", "1,n", "finite number"),
    "not finite": (GOOD * np.nan, TWO, "s.npz", "S", "NaN", "finite"),
    "complex": (GOOD * 1j, TWO, "s.npz", "S", "complex", "real"),
    "two matrices": (
        {"K": GOOD, "T": GOOD},
        TWO,
        "s.npz",
        "matrices",
        "['K', 'T']",
        "S, or one matrix alone",
    ),
}


def test_a_search_for_shims_does_not_go_on_with_another_recovery_matrix(tmp_path: Path) -> None:
    """Its answers have the stresses of the first, and no key of a scene tells it from the second."""
    scenes = [scene_from(point_matrix(tmp_path / name, S, TWO)) for name, S in (("1", GOOD), ("2", 2 * GOOD))]
    one, other = (
        ShimStudy(scene, scene, Listed(()), "dual", (), (np.inf, 50.0)).identity for scene in scenes
    )
    assert one["scene_key"] == other["scene_key"]
    assert one["stresses"] != other["stresses"]


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_has_one_clear_message(case: str, tmp_path: Path) -> None:
    S, csv, where, key, value, allowed = WRONG[case]
    scene = scene_from(point_matrix(tmp_path, S, csv))  # not read until stresses are asked for
    (fault,) = refusal_of(refuse_unusable, 50.0, scene).faults
    assert fault.where.endswith(where)
    assert fault.key == key
    assert value in str(fault.value)
    assert allowed in fault.allowed


def test_other_files_are_refused(tmp_path: Path) -> None:
    (fault,) = refusal_of(lambda: scene_from(point_matrix(tmp_path, GOOD, TWO, stress=None))).faults
    assert "both of stress and stress_points" in fault.allowed
    gone = scene_from(point_matrix(tmp_path, GOOD, TWO, stress="gone.op4"))
    (fault,) = refusal_of(refuse_unusable, None, gone).faults
    assert fault.allowed == "no such file"
    labelled = scene_from(point_matrix(tmp_path, GOOD, TWO, stress=str(tmp_path / "k.pch")))
    (tmp_path / "k.pch").write_text(
        "DMIG    S       0       6       2       0\n"
        + "".join(f"DMIG    S       {k}       3               {k}       3       2.0\n" for k in range(1, 7)),
        "ascii",
    )
    (fault,) = refusal_of(refuse_unusable, None, labelled).faults
    assert "labels" in str(fault.value)


def test_a_recovery_matrix_is_that_of_the_folder_where_the_scene_was_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though it is read later, when another folder has a file of that name."""
    for name, S in (("there", 2 * GOOD), ("here", GOOD)):
        parts = point_matrix(tmp_path / name, S, TWO, stress="s.npz", stress_points="s.csv")
    monkeypatch.chdir(tmp_path / "here")
    scene = scene_from(parts)
    monkeypatch.chdir(tmp_path / "there")
    np.testing.assert_array_equal(scene.joint.parts[0].recovery.S.toarray(), GOOD)


def test_it_is_in_no_key(tmp_path: Path) -> None:
    parts = point_matrix(tmp_path, GOOD, TWO)
    bare = [{key: value for key, value in part.items() if "stress" not in key} for part in parts]
    assert scene_from(parts).key == scene_from(bare).key


TOML = """\
[output]
stress = true
[[joint.part]]
name = "a"
superelement = "a.npz"
nodes = "a.csv"
stress = "s.npz"
stress_points = "s.csv"
[[joint.part]]
name = "b"
superelement = "b.npz"
nodes = "b.csv"
[[effect]]
kind = "initial_gap"
mean = 0.01
[[effect]]
kind = "fasteners"
preload = 10.0
points = [[10.0, 5.0]]
"""


@pytest.mark.usefixtures("without_pictures")
def test_an_allowed_stress(tmp_path: Path) -> None:
    S = np.vstack([GOOD[:3] * [[1], [0], [0]], GOOD[:3] * [[3], [0], [0]]])
    point_matrix(tmp_path, S, TWO)
    (tmp_path / "j.toml").write_text(TOML, "utf-8")
    done = harness("solve", tmp_path / "j.toml", "--allow-stress", 1e-4, "--out", tmp_path / "out")
    assert (done.exit_code, "FAIL" in done.output) == (4, True), done.output
    answer = (tmp_path / "out/answer.md").read_text("utf-8")
    assert "a, on the bottom, x = 1 mm, y = 2 mm" in answer
    assert "none known of b" in answer
    table = pd.read_csv(tmp_path / "out/stress.csv")
    assert table["side"].tolist() == ["top", "bottom"]
    assert table["part"].tolist() == ["a", "a"]
    np.testing.assert_allclose(table["sxx"][1], 3 * table["sxx"][0])
    record = json.loads((tmp_path / "out/solution.json").read_text("utf-8"))
    np.testing.assert_allclose(record["stress"]["largest"]["von_mises"], abs(table["sxx"][1]))
    assert "stress of a" in (tmp_path / "out/index.html").read_text("utf-8")


def test_validate_reads_what_the_scene_asks_for(tmp_path: Path) -> None:
    point_matrix(tmp_path, GOOD[:3], TWO)
    (tmp_path / "j.toml").write_text(TOML, "utf-8")
    assert "S.shape" in wrong_usage("validate", tmp_path / "j.toml")
    (tmp_path / "j.toml").write_text(TOML.replace("stress = true", ""), "utf-8")
    assert harness("validate", tmp_path / "j.toml").exit_code == 0


@pytest.mark.usefixtures("without_pictures")
def test_the_history_has_the_largest_stress_of_each_stage(tmp_path: Path) -> None:
    """None before anything presses, that of the answer at the end."""
    point_matrix(tmp_path, np.arange(36.0).reshape(6, 6), TWO)
    text = TOML.replace('kind = "fasteners"', 'kind = "fasteners"\nname = "tacks"')
    text += '[[stage]]\nname = "lie"\n[[stage]]\nname = "tack"\non = ["tacks"]\n'
    (tmp_path / "j.toml").write_text(text, "utf-8")
    done = harness("solve", tmp_path / "j.toml", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    record = json.loads((tmp_path / "out/solution.json").read_text("utf-8"))
    largest = record["stress"]["largest"]["von_mises"]
    assert largest > 0.1
    assert [stage["largest_stress"] for stage in record["stages"]] == [0.0, pytest.approx(largest)]
