"""Drawn joints of superelements: the same everywhere, of all kinds, with the K of their plates."""

import pickle
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from small_joints import PART, make_joint
from superelements import solved
from test_drawn import drawn_scene

import problems.random_scenes
from problems.build import prepared
from problems.model.condensed_plate import WITH_ROTATIONS, CondensedPlate
from problems.model.joint import Joint
from problems.model.scene import JointScene
from problems.model.surface import Grid

#: Of the first thirty: every kind, the smallest and one of the largest.
NUMBERS = (*range(12), 20, 23)


@pytest.fixture(scope="module")
def scenes() -> list[JointScene]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(problems.random_scenes, "__version__", "0.2.0")
        return [drawn_scene(f"drawn/superelements/{k}") for k in NUMBERS]


def test_a_name_gives_the_same_joint_everywhere(scenes: list[JointScene]) -> None:
    """The digits are those of `printf 0.2.0/superelements/7 | sha256sum`, and of …/7/1 for the next eight."""
    first = "18b1ec24 c92d8167 a6776a7b 63d5847b 7163501c 7323eb70 d4144004 3fe3ffa7"
    later = "f6dcf691 dacf20e6 df90d802 e509daee cae42739 ddb4dd05 c977d645 89924950"
    shares = [int(word, 16) / 2**32 for word in f"{first} {later}".split()]
    scene, (gap, fasteners, *_) = scenes[7], scenes[7].effects
    assert len(scene.joint.names) == 2 + int(2 * shares[0])
    count = int(300 + (701 if shares[1] >= 0.5 else 2701) * shares[4]) // (len(scene.joint.names) - 1)
    rows = int(np.sqrt(count // int(1 + 8 * shares[5])))
    pitch = 8 + int(13 * shares[6])
    assert scene.joint.bounds[1].tolist() == [pitch * (count // rows - 1), pitch * (rows - 1)]
    assert gap.random.sd == (5 + int(96 * shares[7])) / 1000
    assert gap.random.correlation_length == 60 + int(341 * shares[8])
    assert fasteners.preload == 20 + int(981 * shares[14])
    assert len({other.key for other in scenes}) == len(scenes)
    assert pickle.loads(pickle.dumps(scene)).key == scene.key


def test_all_kinds_are_drawn_and_fit(scenes: list[JointScene]) -> None:
    kinds, counts = set(), []
    for scene in scenes:
        parts = scene.joint.parts
        alike = len({part.nodes.xyz[:, :2].tobytes() for part in parts}) == 1
        regular = isinstance(scene.joint.faces[parts[0].name].surface, Grid)
        kinds.add((len(parts), parts[0].dofs, alike, regular))
        assert not [
            *scene.joint.faults(),
            *(fault for effect in scene.effects for fault in effect.faults(scene.joint)),
        ]
        assert all(not pairing.beyond and not pairing.far for pairing in scene.joint.pairings.values())
        counts.append(scene.joint.size[1])
    assert {kind[:2] for kind in kinds} == set(product((2, 3), ((3,), WITH_ROTATIONS)))
    assert {kind[2:] for kind in kinds} == set(product((False, True), (False, True)))
    assert 200 < min(counts) < 400 < 2500 < max(counts) < 4500


@pytest.mark.parametrize("dofs", [(3,), WITH_ROTATIONS])
def test_k_is_definite_and_the_joint_is_solved(scenes: list[JointScene], dofs: tuple[int, ...]) -> None:
    own = (scene for scene in scenes if scene.joint.parts[0].dofs == dofs)
    scene = min(own, key=lambda scene: scene.joint.size[0])
    assembly = prepared(scene).assembly
    for K in assembly.K.matrices:
        np.testing.assert_array_equal(K, K.T)
        np.linalg.cholesky(K)
    lift = np.concatenate([(part.dof == 3) * k for k, part in enumerate(scene.joint.parts)])
    np.testing.assert_allclose(assembly.A.T @ lift, -1.0, atol=1e-10)
    assert 0 < (solved(scene).lam > 0).sum() <= scene.joint.size[1]
    assert not scene.unusual


def plate(joint: Joint, kept: list[int]) -> CondensedPlate:
    return CondensedPlate(joint.model_copy(update={"part": joint.part[:1]}), np.array(kept), WITH_ROTATIONS)


def test_condensed_onto_scattered_nodes_it_is_as_compliant_as_the_whole_plate() -> None:
    condensed = plate(make_joint(PART, nodes=(7, 5)), [20, 3, 31, 9])
    part = condensed.part
    nx, free = len(part.plate.x), np.concatenate([part.plate.line_dofs(line) for line in part.free_lines])
    row, column = np.divmod(condensed.kept, 7)
    w = 4 * nx * (row + part.junction.start) + 2 * column
    kept = np.column_stack([w, w + 2 * nx, w + 1]).ravel()  # w, its slopes along y and along x
    C = np.zeros((part.plate.size,) * 2)
    C[np.ix_(free, free)] = np.linalg.inv(part.stiffness().toarray()[np.ix_(free, free)])
    signs = np.tile([1.0, 1.0, -1.0], 4)
    wanted = signs[:, None] * C[np.ix_(kept, kept)] * signs
    found = np.linalg.inv(condensed.stored()[0]["K"])
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * abs(wanted).max())


def test_a_strip_bends_like_a_beam() -> None:
    """Built in at one end, P at the other: PL³/3EI, and the slope −PL²/2EI there, without Poisson's ratio."""
    whole = make_joint(PART | {"poisson": 0.0, "thickness": 3.0}, nodes=(5, 3))
    h, L, EI = 100.0, whole.junction.width + 90.0, 70e3 * 400.0 * 3.0**3 / 12
    part = plate(whole, [0, 1, 2, 3, 4]).superelement(Path("strip"), 0.0)  # its free edge
    force = np.zeros((5, 3))
    force[:, 0] = h / 2, h, h, h, h / 2  # 1 N/mm, and its moments about y
    force[[0, 4], 2] = -(h**2) / 12, h**2 / 12
    moved = np.linalg.solve(part.stiffness, force.ravel()).reshape(5, 3)
    beam = 400.0 / EI * np.array([L**3 / 3, -(L**2) / 2, 0.0])
    np.testing.assert_allclose(moved, np.tile(beam, (5, 1)), rtol=1e-9, atol=1e-12)
