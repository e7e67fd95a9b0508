"""Installed fasteners: springs between the parts, against closed forms and the dense sum."""

import numpy as np
import pytest
import scipy.linalg as sla
from scipy.interpolate import RegularGridInterpolator
from small_joints import PART, make_joint, make_scene, untied

from problems.build import prepared
from problems.effects.installed_fasteners import InstalledFasteners
from problems.effects.pressure import Pressure
from problems.effects.supports import Supports

TWO = make_joint(PART, PART | {"name": "b"})
FOUR = make_joint(*(PART | {"name": name, "thickness": 4.0 + k} for k, name in enumerate("abcd")))


def fastener(*points: tuple[float, float], **more: object) -> InstalledFasteners:
    return InstalledFasteners.model_validate({"kind": "installed_fasteners", "points": points} | more)


def test_blocks_are_those_of_the_dense_sum() -> None:
    """a–b tied, c–d not; a tie over two contacts joins three parts."""
    nodal = np.eye(FOUR.node_count).reshape(len(FOUR.y), len(FOUR.x), -1)
    weights = RegularGridInterpolator((FOUR.y, FOUR.x), nodal)
    for effects, names in (
        ([fastener((100.0, 0.0), (317.0, 33.0), between=["a", "b"])], ["a + b", "c", "d"]),
        ([fastener((100.0, 0.0), between=["c", "d"])], ["a", "b", "c + d"]),
        (
            [fastener((0.0, 0.0), between=["b", "c"]), fastener((400.0, 0.0), between=["c", "d"])],
            ["a", "b + c + d"],
        ),
        ([fastener((100.0, 0.0))], ["a + b + c + d"]),
    ):
        scene = make_scene(FOUR, *effects)
        made, base = prepared(scene), prepared(untied(scene))
        assert list(made.assembly.parts) == names
        K = sla.block_diag(*base.assembly.K.matrices)
        for effect in effects:
            for point in effect.points:
                at = weights(point[::-1])
                for one, two in [effect.between] if effect.between else FOUR.pairs:
                    t = np.zeros(80)
                    t[FOUR.unknowns(one)], t[FOUR.unknowns(two)] = at, -at
                    K += 1e5 * np.outer(t, t)
        np.testing.assert_allclose(sla.block_diag(*made.assembly.K.matrices), K, rtol=1e-14)
        A = made.assembly.A.toarray()
        np.testing.assert_allclose(made.Q, A.T @ np.linalg.solve(K, A), rtol=1e-7, atol=1e-12)
        values = np.linalg.eigvalsh(K)
        assert made.facts["cond_K"] == pytest.approx(values[-1] / values[0], rel=1e-5)
        b = np.random.default_rng(1).normal(size=80)
        np.testing.assert_allclose(K @ made.assembly.K.solve(b), b, atol=1e-7)


def test_springs_between_nodes_leave_K_symmetric_to_the_last_bit() -> None:
    """The order of a sum is another in K_ji; a proof takes K as it is."""
    places = np.random.default_rng(1).uniform((0, 0), (400, 120), (40, 2))
    scene = make_scene(FOUR, fastener(*map(tuple, places.tolist())))
    for form in ("dual", "sparse"):
        for K in prepared(scene, form=form).assembly.K.matrices:
            assert abs(K - K.T).max() == 0


def test_installing_a_fastener_condenses_nothing_again(monkeypatch: pytest.MonkeyPatch) -> None:
    effect = Supports(kind="supports", part="a", points=((0.0, 0.0),), stiffness_per_point=123.0)
    prepared(make_scene(TWO, effect))
    condense = "problems.model.condensation.condense"
    monkeypatch.setattr(condense, lambda *_: pytest.fail("condensed the parts again"))
    first = prepared(make_scene(TWO, effect, fastener((100.0, 0.0))))
    again = prepared(
        make_scene(TWO, effect, fastener((100.0, 0.0)), Pressure(kind="pressure", part="a", value=1.0))
    )
    np.testing.assert_array_equal(first.Q, again.Q)
    assert isinstance(again.Q, np.memmap)
    seconds = first.facts["seconds"]
    assert set(seconds) == {"condensation", "cholesky", "condition", "Q", "ties"}
    assert all(isinstance(value, float) for value in seconds.values())
    more = prepared(make_scene(TWO, effect, fastener((100.0, 0.0), (300.0, 0.0))))
    assert abs(more.Q - first.Q).max() > 1e-6
