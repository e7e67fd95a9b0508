"""A stream of load cases: draws of the gap, and fasteners that come and go, against scenes that say so."""

import numpy as np
import pytest
from small_joints import make_joint, make_scene

from problems.build import load_case
from problems.effects.fasteners import Fasteners
from problems.effects.initial_gap import InitialGap, RandomField
from problems.effects.pressure import Pressure
from problems.errors import InputError
from problems.load_cases.stream import Stream, drawn_cases
from problems.model.effect import Effect
from problems.model.scene import JointScene

PLACES = ((50.0, 30.0), (200.0, 60.0), (310.0, 90.0))
GAP = InitialGap(kind="initial_gap", mean=0.3, random=RandomField(sd=0.1, correlation_length=200.0, seed=0))


def scene_of(*more: Effect) -> JointScene:
    joint = make_joint({"clamped": ("north",), "north": {"length": 50.0, "elements": 1}}, {"name": "b"})
    return make_scene(joint, GAP, Pressure(kind="pressure", part="a", value=1e-3), *more)


def fasteners(*places: tuple[float, float]) -> Fasteners:
    return Fasteners(kind="fasteners", preload=70.0, points=places)


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_each_case_is_a_scene_with_some_of_the_fasteners(form: str) -> None:
    scene = scene_of(fasteners(*PLACES))
    cases = drawn_cases(scene, form, fasteners=True, cases=12, seed=4)  # type: ignore[arg-type]
    plain = drawn_cases(scene, form, cases=12, seed=4)  # type: ignore[arg-type]
    assert isinstance(cases, Stream)
    out_before: set[int] = set()
    for k in range(12):
        case, parameters = cases.load(k), cases.parameters(k)
        out = set(map(int, parameters["fasteners_out"].split()))
        assert len(out ^ out_before) == k % 2  # one comes or goes in every second case
        out_before = out
        left = [place for i, place in enumerate(PLACES) if i not in out]
        with_left = load_case(scene_of(*([fasteners(*left)] if left else [])), form)  # type: ignore[arg-type]
        np.testing.assert_allclose(case.f, with_left.f, atol=1e-12)
        np.testing.assert_array_equal(case.g, plain.load(k // 2).g)
        assert parameters["gap_seed"] == plain.parameters(k // 2)["gap_seed"]
    assert cases.load(5).f is cases.load(6).f  # K⁻¹f is then computed once
    assert cases.key != plain.key


def test_each_change_is_drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = drawn_cases(scene_of(fasteners(*PLACES)), "dual", fasteners=True, cases=12, seed=4)
    draw, asked = np.random.default_rng, []
    monkeypatch.setattr(np.random, "default_rng", lambda seed: asked.append(seed) or draw(seed))
    for k in range(12):
        cases.parameters(k)
    assert asked == [(4, t, 1) for t in range(6)]


def test_it_needs_fasteners() -> None:
    with pytest.raises(InputError, match="no fasteners"):
        drawn_cases(scene_of(), "dual", fasteners=True, cases=2, seed=0)
