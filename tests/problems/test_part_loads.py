"""Weight, heat, shifted supports and pads against beam theory and statics."""

import doctest
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from small_joints import make_joint, make_scene

from harness.series.load_case_source import GapCases
from problems.build import load_case, prepared
from problems.effects.fasteners import Fasteners
from problems.effects.local_thickness import LocalThickness
from problems.effects.part_position import PartPosition
from problems.effects.self_weight import SelfWeight
from problems.effects.support_shift import SupportShift
from problems.effects.supports import Supports
from problems.effects.thermal_bending import ThermalBending
from problems.forms.prepared import Prepared
from problems.load_cases.sweep import sweep
from problems.model import effect, part
from problems.model.effect import Effect
from problems.model.joint import Joint
from problems.model.joint_model import JointModel

E, T = 70e3, 6.0
#: A strip along y, clamped at y = −200, free at y = 150, bending like a beam since ν = 0.
STRIP = {"poisson": 0.0, "south": {"length": 200.0, "elements": 4}, "clamped": ["south"]}
STRIP_JOINT = make_joint(STRIP, contacts=[["a", "tool"]], length=40.0, width=150.0, nodes=(3, 6))
ALONG = 200.0 + np.linspace(0, 150, 6)  # distance from the clamp
#: On three supports at junction nodes: free to bend, held without constraint.
THREE = ((0.0, 0.0), (400.0, 0.0), (200.0, 120.0))
HELD = Supports(kind="supports", part="a", points=THREE, stiffness_per_point=1e6)
OVERHANG: dict[str, Any] = {
    "south": {"length": 250.0, "elements": 4},
    "north": {"length": 90.0, "elements": 2},
}
FREE_JOINT = make_joint(OVERHANG, contacts=[["a", "tool"]])


def solved(joint: Joint, *effects: Effect) -> tuple[NDArray[np.float64], Prepared]:
    scene = make_scene(joint, *effects)
    made = prepared(scene)
    return made.assembly.K.solve(load_case(scene).f), made


def strip(*effects: Effect) -> NDArray[np.float64]:
    """Deflections of the strip's middle line at ALONG."""
    x, _ = solved(STRIP_JOINT, *effects)
    return x.reshape(6, 3)[:, 1]


def test_the_examples_for_authors_of_effects_run() -> None:
    assert [doctest.testmod(module) for module in (effect, part)] == [(0, 2), (0, 6)]


def test_a_part_off_its_place_is_a_part_on_shifted_supports() -> None:
    """Three supports shifted to a plane move the part as a rigid body: g falls by where it now is."""
    off = PartPosition(kind="part_position", part="a", shift=0.3, slope_x=1e-3, slope_y=-2e-3)
    heights = [0.3 + 1e-3 * (x - 200) - 2e-3 * (y - 60) for x, y in THREE]
    shifts = [
        SupportShift(kind="support_shift", part="a", points=(point,), shift=height)
        for point, height in zip(THREE, heights, strict=True)
    ]
    x, _ = solved(FREE_JOINT, HELD, *shifts)
    np.testing.assert_allclose(off.gap(FREE_JOINT), -x, rtol=0, atol=1e-9)


def test_a_heavy_cantilever() -> None:
    """w = q s² (6L² − 4Ls + s²) / 24 EI, the nodal values exact for cubic elements."""
    w = strip(SelfWeight(kind="self_weight", part="a", density=2800.0, gravity=9.81))
    q, EI, L = 2800e-9 * 9.81 * T, E * T**3 / 12, 350.0  # N/mm per mm of width
    np.testing.assert_allclose(w, q * ALONG**2 * (6 * L**2 - 4 * L * ALONG + ALONG**2) / (24 * EI), rtol=1e-8)


@pytest.mark.parametrize("pad", [False, True])
def test_a_warm_face_bends_a_cantilever_away_from_it(pad: bool) -> None:
    """κ = αΔT/t by pieces, integrated twice; 2 mm wide, so that the clamp hardly hinders it across."""
    joint = make_joint(STRIP, contacts=[["a", "tool"]], length=2.0, width=150.0, nodes=(3, 6))
    thick = LocalThickness(kind="local_thickness", part="a", thickness=9.0, x=(0, 2), y=(-100, 60))
    heat = ThermalBending(kind="thermal_bending", part="a", difference=30.0)
    x, _ = solved(joint, heat, *([thick] if pad else []))
    expected = np.zeros(6)
    for t, start, stop in ((6.0, 0, 100), (9.0 if pad else 6.0, 100, 260), (6.0, 260, 350)):
        length = np.clip(ALONG, start, stop) - start
        expected -= 23e-6 * 30.0 / t * (length**2 / 2 + length * np.maximum(ALONG - stop, 0))
    np.testing.assert_allclose(x.reshape(6, 3)[:, 1], expected, rtol=1e-4)


@pytest.mark.parametrize("thickness", [3.0, 9.0])
def test_a_stepped_cantilever(thickness: float) -> None:
    """P at the end, EI changes at s = 100, a grid line: w(L) = P/3 [(L³−b³)/EI₁ + b³/EI₂], b = L−100."""
    step = LocalThickness(kind="local_thickness", part="a", thickness=thickness, x=(0, 40), y=(-200, -100))
    ends = tuple((x, 150.0) for x in (0.0, 20.0, 20.0, 40.0))
    w = strip(step, Fasteners(kind="fasteners", preload=5.0, points=ends))
    root, tip = (E * 40 * t**3 / 12 for t in (thickness, T))
    # The ends' load is uniform over the width but for the slopes' share, so beam theory holds to 1e-3.
    assert w[-1] == pytest.approx(20 / 3 * ((350.0**3 - 250.0**3) / root + 250.0**3 / tip), rel=1e-3)


def test_a_condensed_load_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_scene(FREE_JOINT, HELD, SelfWeight(kind="self_weight", part="a", density=1234.0))
    prepared(scene)
    first = load_case(scene)
    monkeypatch.setattr(JointModel, "interior", lambda *_: pytest.fail("condensed a second time"))
    np.testing.assert_array_equal(load_case(scene).f, first.f)
    heavier = make_scene(FREE_JOINT, HELD, SelfWeight(kind="self_weight", part="a", density=1235.0))
    with pytest.raises(pytest.fail.Exception, match="second time"):
        load_case(heavier)


def test_a_load_of_many_cases_is_condensed_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Linear in its key; nothing is left in the cache, and the plate is assembled once."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path))
    scene = make_scene(FREE_JOINT, HELD, SelfWeight(kind="self_weight", part="a", gravity=8.0))
    unit, kept = load_case(scene).f / 8.0, {*tmp_path.iterdir()}
    drawn = GapCases(count=3, random=("self_weight.gravity=normal(9.8, 0.1)",)).of(scene, "dual")
    swept = sweep(scene, ["self_weight.gravity=9:11:3"])
    assert kept
    assert len({swept.load(0).f.tobytes(), drawn.load(0).f.tobytes()}) == 2
    monkeypatch.setattr(part.PartModel, "stiffness", lambda *_: pytest.fail("assembled a second time"))
    for cases in (drawn, swept):
        for k in range(3):
            gravity = cases.parameters(k)["self_weight.gravity"]
            np.testing.assert_allclose(cases.load(k).f, gravity * unit, rtol=1e-9, atol=1e-12)
    assert {*tmp_path.iterdir()} == kept
