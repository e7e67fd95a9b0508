"""A force that closes two plates, a rivet that is set, and the release, in an independent code.

    clamp:     min ½uᵀKu − F cᵀu              subject to   Bu ≤ g,     a = tᵀu
    release:   min ½uᵀKu + ½k (tᵀu − a)²      subject to   Bu ≤ g

Argyris triangles of scikit-fem for the plates, condensed onto the contacts, where non-negative least squares
find the forces: λ ≥ 0 minimises ½λᵀQλ − λᵀp, Q = BK⁻¹Bᵀ, p = BK⁻¹f − g. Both codes share the dimensions and
the points of contact. The triangles are larger, and the rivet is at no node of either.
"""

from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from argyris_plates import Array, curvatures, deflections, held
from scipy.optimize import nnls
from scipy.sparse.linalg import splu

from harness.scene.solution import solve
from harness.scene.stress import stresses_of
from problems.model.joint import Joint, Part
from problems.scene_files import scene_of

GAP, FORCE, STIFFNESS = 0.8, 120.0, 30.0  # mm, N, N/mm: the rivet is soft, so that its stretch tells
CLAMP, RIVET = np.array([[90.0, 60.0]]), np.array([[154.0, 47.0]])  # mm
ELEMENT = 20.0  # mm, the side of a triangle; the scene has a node every 10 mm
AWAY = 30.0  # mm, from forces between the parts, and from corners of a clamped and a free edge: both singular
LENGTH, WIDTH, BEYOND = 240.0, 120.0, 80.0

EXTENSION = {"length": BEYOND, "elements": 8}
PARTS = [
    {"name": "a", "thickness": 3.0, "poisson": 0.3, "north": EXTENSION, "clamped": ["north"]},
    {"name": "b", "thickness": 2.0, "young": 110e3, "south": EXTENSION, "clamped": ["south"]},
]
CORNERS = np.array([(x, y) for x in (0.0, LENGTH) for y in (-BEYOND, WIDTH + BEYOND)])
RIVETS = {"kind": "installed_fasteners", "name": "rivet", "stiffness": STIFFNESS, "points": RIVET.tolist()}
SCENE: dict[str, Any] = {
    "joint": {"junction": {"length": LENGTH, "width": WIDTH, "nodes": [25, 13]}, "part": PARTS},
    "effect": [
        {"kind": "initial_gap", "mean": GAP},
        {"kind": "fasteners", "name": "clamp", "preload": FORCE, "points": CLAMP.tolist()},
        RIVETS,
    ],
    "stage": [
        {"name": "clamp", "on": ["clamp"]},
        {"name": "rivet", "on": ["rivet"]},
        {"name": "release", "off": ["clamp"]},
    ],
}


def contact(K: sp.csc_array, f: Array, B: sp.csr_array) -> tuple[Array, Array]:
    """The unknowns u of the plates, and the contact forces, N."""
    inverse = splu(K)
    pressed, u = inverse.solve(B.T.toarray()), inverse.solve(f)
    L = sla.cholesky(B @ pressed, lower=True)
    lam, _ = nnls(L.T, sla.solve_triangular(L, B @ u - GAP, lower=True))
    return u - pressed @ lam, lam


def stress(part: Part, kappa: Array) -> Array:
    """(k, 3) σ_xx, σ_yy, τ_xy of the top face, N/mm²."""
    nu = part.poisson
    law = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, 1 - nu]]) / (1 - nu**2)
    return np.asarray(part.young * part.thickness / 2 * kappa @ law)


def test_gaps_and_stresses_of_a_clamp_a_rivet_and_the_release() -> None:
    answer = solve(scene_of(SCENE))
    joint = answer.problem.scene.joint  # type: ignore[attr-defined]
    assert isinstance(joint, Joint)
    plates = [held(joint, part, ELEMENT) for part in joint.part]
    K = sp.block_diag([K[free][:, free] for _, K, free in plates], format="csc")

    def approach(points: Array) -> sp.csr_array:
        a, b = (deflections(basis, points)[:, free] for basis, _, free in plates)
        return sp.csr_array(sp.hstack([a, -b]))

    B, c, t = approach(joint.nodes), approach(CLAMP).toarray()[0], approach(RIVET)
    clamped = contact(K, FORCE * c, B)
    locked = float((t @ clamped[0])[0])
    released = contact(sp.csc_array(K + STIFFNESS * t.T @ t), STIFFNESS * locked * t.toarray()[0], B)
    tension = STIFFNESS * (locked - float((t @ released[0])[0]))

    first, set_there, last = answer.stages
    np.testing.assert_array_equal(first.x, set_there.x)
    assert first.forces["contacts"] == pytest.approx(clamped[1].sum(), rel=0.02)
    assert last.forces["rivet"] == pytest.approx(tension, rel=0.02)
    assert last.gap.max() > 1.3 * first.gap.max()  # it springs back
    for stage, (u, lam) in ((first, clamped), (last, released)):
        gap = GAP - B @ u
        assert abs(stage.gap - gap).max() < 0.02 * gap.max()
        pressed = joint.nodes[(lam > 0) | (stage.lam > 0)]
        near = np.concatenate([CLAMP, RIVET, CORNERS, pressed])
        sides = zip(joint.part, plates, np.split(u, [len(plates[0][2])]), strict=True)
        for (part, (basis, _, free), own), ours in zip(sides, stresses_of(stage.scene, stage.x), strict=True):
            of_part = np.zeros(basis.N)
            of_part[free] = own
            away = np.hypot(*(ours.places[:, None] - near).T).min(axis=0) > AWAY
            theirs = stress(part, curvatures(basis, ours.places[away], of_part))
            difference = abs(ours.components[away] - theirs).max()
            assert difference < 0.02 * abs(theirs).max()
