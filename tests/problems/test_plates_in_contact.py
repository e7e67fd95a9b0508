"""Plates in contact against other codes: Argyris triangles of scikit-fem, the contacts by Clarabel.

    min Σ ½uᵀKu − fᵀu   subject to   e·u_a − e·u_b ≤ g

for the plates' own degrees of freedom u, nothing condensed; e evaluates a deflection at a point. The scene's
nodes are no vertices of the triangles. Both share the numbers of the joint, the forces at its nodes and the
initial gap. The scenes of the gallery are symmetric about the contact, or the middle part; the joint of
docs/effects.md is not.
"""

import re
import tomllib
from pathlib import Path

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp
from argyris_plates import Array, deflections, held
from sample_size import ASKED

from harness.solving.solver_session import answer_of
from problems.build import load_case, prepared
from problems.model.joint import Joint
from problems.model.scene import JointScene
from problems.scene_files import read_scene, scene_of
from solvers.registry import make_solver

EFFECTS = Path(__file__).parents[2] / "docs" / "effects.md"
NAMES = ["docs/effects.md", *(["gallery/three-part-stack", "gallery/measured-gap"] if ASKED else [])]
ELEMENT = 28.0  # mm, the side of a triangle; the scenes have a node every 15 mm


def scene_named(name: str) -> JointScene:
    if name != "docs/effects.md":
        return read_scene(name)
    table = re.search(r"```toml\n(.*?)```", EFFECTS.read_text("utf-8"), re.DOTALL)
    return scene_of(tomllib.loads(table[1]))


@pytest.mark.parametrize("name", NAMES)
def test_gaps_and_reactions_agree(name: str) -> None:
    """Where fasteners close the gap, it does not tell how stiff equal plates are; reactions do."""
    scene = scene_named(name)
    load, data = load_case(scene), prepared(scene)
    answer = answer_of("newton", make_solver("newton", {}), data, "dual", load, 1e-9)
    ours = load.g - data.assembly.A.T @ np.asarray(answer.x)
    theirs, their_forces = contact(scene.joint, load.f.reshape(len(scene.joint.part), -1), load.g)
    assert (load.g - ours).max() > 0.2 * load.g.max()  # the fasteners close it in part
    assert 0.03 < (ours < 1e-9).mean() < 0.5
    assert abs(ours - theirs).max() < 0.01 * ours.max()
    mine, other = (reactions(scene.joint, load.f, lam) for lam in (np.asarray(answer.lam), their_forces))
    assert abs(mine - other).max() < 0.005 * abs(mine).max()


def reactions(joint: Joint, f: Array, lam: Array) -> Array:
    """(parts,) of the clamped edges, N."""
    sums = f.reshape(len(joint.part), -1).sum(axis=1)
    names = [part.name for part in joint.part]
    for (a, b), force in zip(joint.pairs, lam.reshape(len(joint.pairs), -1).sum(axis=1), strict=True):
        sums[names.index(a)] -= force
        sums[names.index(b)] += force
    return sums


def contact(joint: Joint, forces: Array, g: Array) -> tuple[Array, Array]:
    """The gaps that are left, mm, and the contact forces, N, pair after pair, at the nodes of the joint.

    forces : (parts, nodes), N, on each part. g : the initial gaps, (pairs · nodes,), mm.
    """
    stiffness, e, force = [], {}, []
    for part, at_nodes in zip(joint.part, forces, strict=True):
        basis, K, free = held(joint, part, ELEMENT)
        stiffness.append(K[free][:, free])
        e[part.name] = deflections(basis, joint.nodes)[:, free]
        force.append(e[part.name].T @ at_nodes)
    sides = [[((name == a) - (name == b)) * e[name] for name in e] for a, b in joint.pairs]
    B, K, f = sp.block_array(sides, format="csc"), sp.block_diag(stiffness), np.concatenate(force)
    B.eliminate_zeros()

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    cones = [clarabel.NonnegativeConeT(len(g))]
    answer = clarabel.DefaultSolver(sp.triu(K, format="csc"), -f, B, g, cones, settings).solve()
    assert str(answer.status) == "Solved"
    u, lam = np.array(answer.x), np.array(answer.z)
    assert abs(K @ u + B.T @ lam - f).max() < 1e-9 * abs(f).max()
    return g - B @ u, lam
