"""The whole chain against another code: a panel on springs under its weight, by scikit-fem.

Nothing is shared: element (Argyris triangles), mesh, integration, supports, solution; and
here the part beyond the junction is condensed, and its weight with it.
"""

from __future__ import annotations

import numpy as np
import skfem
from joints import make_joint, make_scene
from numpy.typing import NDArray
from scikit_fem_plates import UNIT, deflections, plate

from problems.build import load_case, prepared
from problems.effects.self_weight import SelfWeight
from problems.effects.supports import Supports

LENGTH, SOUTH, NORTH, THICKNESS = 300.0, -200.0, 200.0, 3.0  # mm
SPRINGS = {(0.0, SOUTH): 50.0, (LENGTH, SOUTH): 200.0, (0.0, NORTH): 120.0, (LENGTH, NORTH): 80.0}  # N/mm
POINTS = np.array([[0.0, 0.0], [150.0, 0.0], [150.0, 100.0], [0.0, 200.0], [150.0, 200.0], [300.0, 200.0]])


def ours() -> NDArray[np.float64]:
    panel = {"thickness": THICKNESS, "south": {"length": -SOUTH, "elements": 8}}
    joint = make_joint(panel, length=LENGTH, width=NORTH, nodes=(17, 9))
    springs = [
        Supports(kind="supports", part="a", points=(point,), stiffness_per_point=k)
        for point, k in SPRINGS.items()
    ]
    scene = make_scene(joint, SelfWeight(kind="self_weight", part="a"), *springs)
    data = prepared(scene)
    x = data.assembly.K.solve(load_case(scene).f)
    at = [int(np.flatnonzero((joint.nodes == point).all(axis=1))[0]) for point in POINTS]
    return np.asarray(x[at])


def theirs() -> NDArray[np.float64]:
    x, y = np.linspace(0, LENGTH, 7), np.linspace(SOUTH, NORTH, 9)
    basis, K = plate(x, y, THICKNESS, 70e3, 0.33)
    weight = 2700e-9 * 9.80665 * THICKNESS

    @skfem.LinearForm  # type: ignore[untyped-decorator]
    def uniform(v, w):  # type: ignore[no-untyped-def]
        return v

    for point, k in SPRINGS.items():
        e = deflections(basis, np.array([point]))
        K = K + k * (e.T @ e)
    u = skfem.solve(K.tocsc(), uniform.assemble(basis) * weight * UNIT**2)
    return np.asarray(deflections(basis, POINTS) @ u)


def test_deflections_agree() -> None:
    np.testing.assert_allclose(ours(), theirs(), rtol=3e-6)
