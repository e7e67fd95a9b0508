"""Derivatives of the largest gap by random inputs against differences of answers, and where they hold."""

from pathlib import Path

import numpy as np
import pytest
from strip_scene import write_strip

from harness.series.derivatives import derivatives
from harness.series.load_case_source import GapCases
from harness.series.session import Job
from harness.verification.judge import Reference
from harness.verification.reference import best_of_candidates
from problems.build import prepared
from problems.forms import Form
from problems.load_cases.random_inputs import RandomInputs
from problems.scene_files import read_scene

LAWS = (
    "initial_gap.mean=normal(0.2, 0.01)",
    "fasteners.preload=each normal(60, 5)",
    "pressure.value=normal(3e-4, 2e-5)",
    "fasteners.points.x=uniform(-8, 14)",
    "part_position.shift=normal(0, 1e-3)",
    "part_position.slope_x=normal(0, 1e-5)",
)
RIBS = '[[effect]]\nkind = "ribs"'
POSITION = '[[effect]]\nkind = "part_position"\npart = "a"\n'


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_differences_of_answers(tmp_path: Path, form: Form) -> None:
    """Linear between the two ends; just beyond, contacts or the place of the largest gap are others."""
    scene = read_scene(str(write_strip(tmp_path, (RIBS, POSITION + RIBS))))
    cases = GapCases(random=LAWS).of(scene, form)
    assert isinstance(cases, RandomInputs)
    found, data = derivatives(Job(scene=scene, cases=cases, form=form)), prepared(scene, form=form)
    assert found["input"] == [law.partition("=")[0] for law in LAWS]
    means = np.array([0.2, 60.0, 3e-4, -1.0, 0.0, 0.0])
    np.testing.assert_allclose(found["mean"], means, rtol=1e-12, atol=1e-15)

    def answer(i: int, value: float) -> tuple[float, tuple[object, ...]]:
        load = cases.load_at([*means[:i], value, *means[i + 1 :]])
        exact: Reference = best_of_candidates(data, load)
        gap = load.g - data.assembly.A.T @ exact.x
        return float(gap.max()), (int(gap.argmax()), *exact.active)

    largest, at_mean = answer(0, means[0])
    assert 5 < sum(at_mean[1:]) < 40
    slopes = np.array(found["derivative"])
    np.testing.assert_allclose(
        found["per_sd_mm"], slopes * [0.01, 5, 2e-5, 14 / 12**0.5, 1e-3, 1e-5], rtol=1e-9
    )
    assert slopes[4] == pytest.approx(-slopes[0], rel=1e-9)
    for i, slope in enumerate(slopes):
        for end, side in ((found["low"][i], -1), (found["high"][i], 1)):
            room = (end - means[i]) if np.isfinite(end) else side * abs(means[i])
            assert side * room > 0
            value, there = answer(i, means[i] + 1e-3 * room)
            assert (value - largest) / (1e-3 * room) == pytest.approx(slope, rel=1e-3, abs=1e-9)
            if i == 3:
                continue  # forces are linear in a shift between two mesh lines alone
            value, there = answer(i, means[i] + 0.99 * room)
            assert there == at_mean
            assert value == pytest.approx(largest + 0.99 * room * slope, abs=1e-9)
            if np.isfinite(end):
                assert answer(i, means[i] + 1.01 * room)[1] != at_mean
    assert min(abs(slopes)) > 0
    assert np.isfinite(found["low"] + found["high"]).sum() >= 4
