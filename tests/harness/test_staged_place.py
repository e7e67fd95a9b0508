"""Plans of fasteners that stages set and take out: the gap after the last stage, against `solve`."""

import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import harness
from small_joints import STAGED, scene_at

from harness import solve
from harness.placement.candidates import MovableFasteners, Plan, grid, plan_of, without_fasteners
from harness.placement.session import TOLERANCE_MM, FastenerStudy, PlanSession, Question
from harness.results import series_file
from harness.scene.scene_file import MOVED, edited, with_fasteners
from problems.errors import InputError
from problems.forms import Form
from problems.load_cases.random_gaps import random_gaps
from problems.model.scene import JointScene
from problems.model.stage_answers import stage_scenes

CASES = 2


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "scene.toml").write_text(STAGED, "utf-8")
    return tmp_path / "scene.toml"


def gap_after_release(scene: JointScene, plan: Plan, seed: float | str) -> tuple[float, int]:
    """The largest gap of the scene with these tacks and this draw of the gap, mm, and its contact."""
    effects = []
    for effect in scene.effects:
        change: dict[str, Any] = {}
        if effect.kind == "fasteners":
            change = {"points": plan} if plan else {"preload": 1e-12}
        elif effect.kind == "initial_gap":
            change = {"random": effect.random.model_copy(update={"seed": seed})}  # type: ignore[attr-defined]
        effects.append(effect.model_copy(update=change))
    gap = solve(replace(scene, effects=tuple(effects))).gap
    return float(gap.max()), int(gap.argmax())


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_a_plan_leaves_what_the_last_stage_leaves(path: Path, form: Form) -> None:
    """Proven upper bounds, and estimates from another plan."""
    movable = MovableFasteners.of(scene_at(path))
    cases = random_gaps(movable.bare, CASES, 0, form=form)
    session = PlanSession(FastenerStudy.of(movable, cases, form))
    for plan in ((), ((15.0, 30.0), (65.0, 20.0))):
        (outcome,) = session.answer(Question((plan,), (0, 1)))
        (estimated,) = session.answer(Question((plan,), (0, 1), base=movable.current))
        for k, largest in enumerate(outcome.largest):
            gap, contact = gap_after_release(movable.scene, plan, cases.parameters(k)["gap_seed"])
            assert gap <= largest <= gap + 2e-7
            assert contact == outcome.contact[k]
        assert estimated.largest == pytest.approx(outcome.largest, abs=1e-6)
    stages = session.stages.stages.values()
    assert len({id(stage.session) for stage in stages}) == 3  # of K: none, two and three rivets


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_fasteners_lock_the_answer_that_is_proven(path: Path, form: Form) -> None:
    """To the last bit: another sum for the approach may be off by more than the bound of that answer."""
    movable = MovableFasteners.of(scene_at(path))
    cases = random_gaps(movable.bare, CASES, 0, form=form)
    session = PlanSession(FastenerStudy.of(movable, cases, form))
    stages = session.answers([movable.current], range(CASES), TOLERANCE_MM)
    (rivets,) = (effect for effect in movable.scene.effects if effect.name == "rivets")
    T, _ = rivets.springs(movable.scene.joint)  # type: ignore[attr-defined]
    locking = [k for k, one in enumerate(stages) if one.locks]
    for k, own in zip(locking, ([0, 1], [2]), strict=True):
        x = np.column_stack([answer.x for answer in stages[k].proven])
        reached = T.T @ stages[k].session.data.assembly.at_junction(x)
        np.testing.assert_array_equal(stages[k + 1].approaches[own], reached[own])


def test_a_stage_that_locks_what_is_not_proven_proves_no_plan(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though the last stage is proven, for the approaches that it has been given."""
    movable = MovableFasteners.of(scene_at(path))
    session = PlanSession(FastenerStudy.of(movable, random_gaps(movable.bare, CASES, 0), "dual"))
    question = Question((movable.current,), (0, 1))
    assert max(session.answer(question)[0].largest) < 1.0
    first = session.stages.of(without_fasteners(stage_scenes(movable.scene)["tack"])).session
    proof = first.proof
    assert first is not session.last

    class Unproven:
        def __getattr__(self, name: str) -> Any:
            return getattr(proof, name)

        def proven(self, *of: Any) -> Any:
            return [replace(answer, bound_mm=1.0) for answer in proof.proven(*of)]

    monkeypatch.setattr(first, "proof", Unproven())
    assert session.answer(question)[0].largest == (float("inf"),) * CASES


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_the_plan_is_the_best_of_all(path: Path, tmp_path: Path) -> None:
    """Of the command, whose plan.toml has the stages, and whose series goes through them."""
    out = tmp_path / "out"
    command = "place", path, "--candidates", "2x2", "--cases", CASES, "--share", 1, "--count", 2, "--out", out
    assert harness(*command).exit_code == 0
    record = json.loads((out / "place.json").read_text())
    scene = scene_at(path)
    cases = random_gaps(MovableFasteners.of(scene).bare, CASES, 0)
    seeds = [cases.parameters(k)["gap_seed"] for k in range(CASES)]
    gaps = {
        plan: max(gap_after_release(scene, plan, seed)[0] for seed in seeds)
        for plan in combinations(plan_of(grid(scene, 2, 2)), 2)
    }
    best = min(gaps, key=lambda plan: gaps[plan])
    assert tuple(map(tuple, record["best"]["plan"])) == best
    assert record["best"]["gap_mm"] == pytest.approx(gaps[best], abs=2e-7)
    written = scene_at(out / "plan.toml")
    assert written.stages == scene.stages
    assert MovableFasteners.of(written).current == best
    rows = {row["case"]: row for row in series_file.rows(out / "plan")}
    for k in range(CASES):
        assert rows[k]["max_gap_mm"] <= gaps[best] + 2e-7
        assert list(rows[k]["stages_max_gap_mm"]) == record["stages"]
    assert "after stage release" in (out / "report" / "report.md").read_text()


def test_a_plan_without_fasteners_has_stages_without_them(path: Path, tmp_path: Path) -> None:
    written = tmp_path / "plan.toml"
    written.write_text(edited(str(path), tmp_path, with_fasteners(()), MOVED), "utf-8")
    scene = scene_at(written)
    assert [(stage.name, stage.on, stage.off) for stage in scene.stages] == [
        ("tack", (), ()),
        ("shim and rivet", ("shim", "rivets[0:2]"), ()),
        ("rivet", ("rivets[2:3]",), ()),
        ("release", (), ()),
    ]


def test_holes_may_be_those_of_rivets(path: Path, tmp_path: Path) -> None:
    """Which are set where a fastener presses, or in its place."""
    (tmp_path / "holes.csv").write_text("x,y\n20,10\n50,25\n10,40\n")
    movable = MovableFasteners.of(scene_at(path))
    assert len(movable.candidates(str(tmp_path / "holes.csv"))[0]) == 3


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('on = ["tacks"]', 'on = ["tacks[0:2]"]', "all points at once; in stage tack some act"),
        ('on = ["tacks"]', 'on = ["tacks[0:3]"]', "its name alone: a plan may have another number"),
        ('kind = "fasteners"', 'kind = "clamps"', "which alone move"),
    ],
)
def test_fasteners_that_cannot_move(path: Path, old: str, new: str, said: str) -> None:
    text = STAGED.replace(old, new, 1)
    if "clamps" in new:
        text = text.replace("preload = 400", "clamping_force = 400")
    elif "[0:2]" in new:
        text = text.replace('on = ["shim", ', 'on = ["tacks[2:3]", "shim", ')
    path.write_text(text, "utf-8")
    with pytest.raises(InputError, match=said):
        MovableFasteners.of(scene_at(path))
