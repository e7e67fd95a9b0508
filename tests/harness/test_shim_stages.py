"""Shims in a scene with stages, and tapered ones: plans against `solve` on the scene with their effects."""

from dataclasses import replace
from itertools import product
from math import inf
from pathlib import Path

import numpy as np
import pytest
from commands import harness
from shim_studies import search_of, study_of
from small_joints import FASTENERS, GAP, STAGED, scene_at, two_parts

from harness import solve, stresses
from harness.placement.session import PlanSession, Question
from problems.effects.shims import Shims
from problems.model.fastener_forces import fastener_forces


def test_a_plan_is_judged_after_the_last_stage(tmp_path: Path) -> None:
    """Gap, force and stress, no less than those of `solve`; shims act in all stages."""
    (tmp_path / "scene.toml").write_text(STAGED, "utf-8")
    study = study_of(tmp_path / "scene.toml", "2x2", (1e9, 1e9))
    session = PlanSession(study)
    plan = ((0.0, 0.02), (3.0, 0.01))
    (outcome,) = session.answer(Question((plan,), (0,)))
    (estimated,) = session.answer(Question((plan,), (0,), base=()))
    answer = solve(replace(study.scene, effects=(*study.scene.effects, *map(study.effect, plan))))
    assert answer.gap.max() <= outcome.largest[0] <= answer.gap.max() + 2e-7
    *_, force, stress = outcome.further[0]
    largest = max(abs(one["force_N"]) for one in fastener_forces(answer.problem.scene, answer.x))
    assert largest <= force <= largest * (1 + 1e-6)
    most = stresses(answer).largest
    assert most["von_mises"] <= stress <= most["von_mises"] + 10 * most["error"] + 1e-4
    assert estimated.further[0] == pytest.approx(outcome.further[0], rel=1e-3, abs=1e-6)


def test_a_tapered_shim_is_linear_along_its_longer_side(tmp_path: Path) -> None:
    """Two in a row are one ramp, also at the contacts beside their border."""
    path = tmp_path / "scene.toml"
    path.write_text(two_parts(length=200.0, nodes=(21, 5)) + GAP + FASTENERS)
    joint = scene_at(path).joint
    ramp = Shims(kind="shims", thickness=(0.1, 0.3), x=(0.0, 200.0), y=(0.0, 50.0)).gap(joint)
    np.testing.assert_allclose(ramp, -0.1 - 1e-3 * joint.nodes[:, 0], rtol=1e-14)
    upright = Shims(kind="shims", thickness=(0.1, 0.3), x=(0.0, 40.0), y=(0.0, 50.0)).gap(joint)
    covered = joint.nodes[:, 0] <= 40.0
    np.testing.assert_allclose(upright, np.where(covered, -0.1 - 4e-3 * joint.nodes[:, 1], 0.0), rtol=1e-14)
    study = study_of(path, "2x1", ends=2)
    two = sum(study.effect(item).gap(joint) for item in ((0, 0.1, 0.2), (1, 0.2, 0.3)))
    np.testing.assert_allclose(two, ramp, rtol=1e-14)


def test_a_patch_has_halves_and_neighbours(tmp_path: Path) -> None:
    """Contacts half-way count for both ends; the nearest patch comes first."""
    path = tmp_path / "scene.toml"
    path.write_text(two_parts(length=200.0, nodes=(21, 5)) + GAP + FASTENERS)
    study = study_of(path, "4x1", ends=2)
    assert study.near[[0, 3]].tolist() == [[0, 1, 2, 3], [3, 2, 1, 0]]
    study = study_of(path, "2x1", ends=2)
    x = study.places[:, 0]
    for k, (first, middle, last) in enumerate([(0.0, 50.0, 100.0), (100.0, 150.0, 200.0)]):
        start, end = study.halves[2 * k : 2 * k + 2]
        inside = study.masks[k]
        np.testing.assert_array_equal(start, inside & (x >= first) & (x <= middle))
        np.testing.assert_array_equal(end, inside & (x >= middle) & (x <= last))


def test_a_fastener_that_pushes_has_a_force_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(two_parts() + GAP + FASTENERS)
    forces = [{"force_N": -50.0}, {"force_N": 20.0}]
    monkeypatch.setattr("harness.shimming.study.fastener_forces", lambda *_: forces)
    (outcome,) = PlanSession(study_of(path, "2x1", (100.0, inf))).answer(Question(((),), (0,)))
    assert outcome.further[0][-2] == pytest.approx(50.0)


def test_a_limit_of_force_needs_a_fastener_in_the_last_stage(tmp_path: Path) -> None:
    """Refused before the work: of tacks that are let go none has a force."""
    text = STAGED[: STAGED.index('[[effect]]\nkind = "shims"')]
    stages = '[[stage]]\nname = "tack"\non = ["tacks"]\n[[stage]]\nname = "release"\noff = ["tacks"]\n'
    (tmp_path / "scene.toml").write_text(text + stages, "utf-8")
    asked = ("--allow-gap", 0.05, "--stock", "0.02", "--allow-force", 500)
    done = harness("shim", tmp_path / "scene.toml", *asked, "--out", tmp_path / "out")
    assert done.exit_code == 2
    said = "--allow-force: force, N = 500.0: leave it out: no fastener acts in the last stage, release"
    assert said in " ".join(done.output.split())
    assert not (tmp_path / "out").exists()


def test_the_least_of_all_tapered_plans_is_found(tmp_path: Path) -> None:
    path, stock = tmp_path / "scene.toml", (0.02, 0.05)
    path.write_text(two_parts(length=200.0, nodes=(21, 4)) + GAP + FASTENERS)
    session = PlanSession(study_of(path, "3x1", ends=2))
    kinds = [(), *product(stock, repeat=2)]
    plans = [tuple((float(k), *t) for k, t in enumerate(p) if t) for p in product(kinds, repeat=3)]
    largest = session.answers(plans, (0,), 1e-9)[-1].vectors[1].max(axis=0)
    gaps = dict(zip(plans, largest.tolist(), strict=True))
    limit = 0.6 * gaps[()]
    search = search_of(session, limit, stock)
    _, best = search.once(())
    assert best.gap_mm <= limit
    assert search.cost(best.plan) == min(search.cost(plan) for plan, gap in gaps.items() if gap <= limit)
