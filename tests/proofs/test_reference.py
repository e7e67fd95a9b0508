"""The reference against exact arithmetic, chosen answers and non-negative least squares."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from exact_answer import exact_solution
from small_joints import make_joint, make_scene
from small_problems import make_load, make_prepared

from harness.cli.scene import STARTER
from harness.conformance.known_problems import contact_rows
from harness.measurement.task import why_not_judged
from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.solving import solver_session as session
from harness.verification import reference as module
from harness.verification.judge import Judgement
from harness.verification.proof import Proof
from harness.verification.reference import STOPPED, best_of_candidates, reference
from harness.verification.reference_problem import measurable
from problems import storage
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.model.scene import JointScene
from problems.scene_files import read_scene
from problems.stiffness.operator import Stiffness
from solvers.base import Answer


def conditioned(condition: float, seed: int, pairs: int = 5) -> tuple[Prepared, LoadCase]:
    """Two parts of the given condition number with random loads."""
    random = np.random.default_rng(seed)
    blocks = []
    for _ in range(2):
        basis = np.linalg.qr(random.standard_normal((pairs, pairs)))[0]
        K = (basis * np.geomspace(1, condition, pairs)) @ basis.T
        blocks.append((K + K.T) / 2)
    load = LoadCase(random.normal(0, 100, 2 * pairs), random.uniform(0.01, 0.5, pairs))
    return Prepared(Assembly(Stiffness.of(*blocks), contact_rows(pairs, 0))), load


@pytest.mark.parametrize("condition", [1e2, 1e5, 1e7, 1e9, 1e12])
@pytest.mark.parametrize("seed", range(4))
def test_bound_covers_the_true_error(condition: float, seed: int) -> None:
    made, load = conditioned(condition, seed)
    answer = best_of_candidates(made, load)
    x, lam, gaps = exact_solution(made.assembly, load, answer.active)
    assert min([*lam, *gaps]) >= 0  # the exact optimum, so x is the answer
    error = max(abs(Fraction(float(a)) - b) for a, b in zip(answer.x, x, strict=True))
    assert error <= answer.bound_mm
    assert answer.bound_mm < 1e-17 * condition * 2e3 * max(1.0, abs(answer.x).max())


@pytest.mark.parametrize("weak", [0.0, 0.4])
def test_set_is_found_on_a_plate_with_weakly_active_contacts(weak: float) -> None:
    """Here cond(K) ≈ 1e6, so that rounding blurs which of the weakly active contacts are closed."""
    part = {"north": {"length": 261.0, "elements": 10}, "clamped": ["north"]}
    joint = make_joint(part, part | {"name": "b"}, length=1000.0, width=400.0, nodes=(33, 9))
    made = prepared(make_scene(joint))
    load, x, lam = chosen(made, 3, 0.3, weak)
    found = best_of_candidates(made, load)
    assert found.bound_mm < 1e-10
    assert found.active[lam > 0].all()
    assert abs(found.x - x).max() < 1e-8


@pytest.mark.parametrize("seed", range(3))
def test_wrong_forces_are_corrected(seed: int) -> None:
    """One closed contact taken for open and one open contact taken for closed; and forces from anywhere."""
    made = make_prepared(seed, 25, 10)
    load, x, lam = chosen(made, seed, 0.4, 0.0)
    wrong = lam.copy()
    wrong[np.flatnonzero(lam > 0)[0]], wrong[np.flatnonzero(lam == 0)[0]] = 0.0, 50.0
    for given in (wrong, lam[::-1].copy(), -lam, np.full_like(lam, 1e3)):
        answer = best_of_candidates(made, load, first=[("mine", given)])
        np.testing.assert_array_equal(answer.active, lam > 0)
        np.testing.assert_allclose(answer.x, x, atol=1e-10)
        assert answer.bound_mm < 1e-12
        assert answer.route == "mine"


@pytest.mark.parametrize("kind", ["dense", "sparse"])
def test_the_methods_are_tried_in_turn_until_one_is_proven(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that fails and one whose answer cannot be proven do no harm; after the limit there is no other."""
    made = make_prepared(1, 25)
    if kind == "sparse":
        made = Prepared(replace(made.assembly, K=made.assembly.K.as_sparse()))
    load, x, lam = chosen(made, 1, 0.4, 0.0)
    monkeypatch.setattr(Proof, "corrections", lambda self, r, s, lam, enough: (0 * r, 0 * lam))
    methods: tuple[str, ...] = getattr(session, kind.upper())
    tried: list[str] = []
    right = methods[:3][-1]

    def answers(name: str, *_: object) -> Answer:
        tried.append(name)
        if len(tried) == 1:
            raise InputError.one("solver", "status", "failed", "gave no answer")
        return Answer("solved", lam if name == right else 0 * lam)

    monkeypatch.setattr(session, "forces_of", answers)
    found = best_of_candidates(made, load)
    assert tried == list(methods[:3])
    assert found.route == f"{right}, refined"
    assert abs(found.x - x).max() <= found.bound_mm < 1e-8
    right = ""
    stopped = best_of_candidates(made, load, 0.0)
    assert len(tried[3:]) < len(methods)
    assert 1e-8 < abs(stopped.x - x).max() <= stopped.bound_mm
    assert stopped.route.endswith(f"{STOPPED} after 0 s")


def chosen(made: Prepared, seed: int, closed: float, weak: float) -> tuple[LoadCase, Vector, Vector]:
    """A load case made from its answer x*, λ*; of the contacts the part `weak` has λ* = y* = 0."""
    random = np.random.default_rng(seed)
    m = made.assembly.m
    kind = random.random(m)
    lam = np.where(kind < closed, random.uniform(1, 100, m), 0.0)
    opening = np.where(kind > closed + weak, random.uniform(0.01, 1, m), 0.0)
    x = random.normal(0, 0.3, made.assembly.n)
    A = made.assembly.A
    return LoadCase(made.assembly.K.multiply(x) + A @ lam, A.T @ x + opening), x, lam


def test_reference_is_computed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless the problem is another one, or what is in the cache is not what was written."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr(storage, "CHECKED", 0)  # as of long files, of which the size alone is checked
    made = make_prepared(1, 12)
    made.key = "these matrices"
    case, _ = make_load(2, made)
    first = reference(made, case)
    monkeypatch.setattr(module, "best_of_candidates", lambda *_: pytest.fail("computed a second time"))
    second = reference(made, case)
    for name in ("x", "lam", "active"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert second.active.dtype == bool
    assert (first.bound_mm, first.route) == (second.bound_mm, second.route)
    for other in (replace(case, f=2 * case.f), replace(case, g=case.g + 0.1)):
        with pytest.raises(pytest.fail.Exception, match="second time"):
            reference(made, other)
    (path,) = tmp_path.glob("*/x.npy")
    path.chmod(0o644)
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    with pytest.raises(pytest.fail.Exception, match="second time"):
        reference(made, case)


def test_the_key_of_a_sparse_matrix_is_of_its_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that nothing proven outlives a change of the code of an effect."""
    scene = read_scene("gallery/padded-panel")
    assert isinstance(scene, JointScene)
    keys = [prepared(replace(scene), form="sparse").key for _ in range(2)]  # each with a model of its own
    effect, own = type(scene.stiffness_effects[0]), type(scene.stiffness_effects[0]).stiffness
    monkeypatch.setattr(effect, "stiffness", lambda self, plate: (1 + 2**-52) * own(self, plate))
    keys.append(prepared(replace(scene), form="sparse").key)
    assert keys[0] == keys[1] != keys[2]


def test_a_row_says_why_it_cannot_be_judged(tmp_path: Path) -> None:
    suite = tmp_path / "mine.toml"
    suite.write_text(
        'scenes = ["hard/pivoting/fathi-008"]\nreference_limit_s = 0.001\n[[solver]]\nname = "newton"\n'
    )
    assert read_suite(str(suite)).reference_limit_s == 0.001
    assert {m.suite.reference_limit_s for m in expand(read_suite(str(suite)))} == {0.001}
    judgement = Judgement("cannot_be_judged", 1e-3)
    problem = measurable("hard/pivoting/fathi-008")
    wide = replace(problem)
    vars(wide)["reference"] = replace(problem.reference, bound_mm=1.2e-3, route=f"proven, {STOPPED}")
    assert why_not_judged(judgement, wide) == f"reference error bound 2e-03 mm: proven, {STOPPED}"
    assert why_not_judged(Judgement("within"), problem) is None


def test_a_joint_of_lines_a_hair_apart_is_proven(tmp_path: Path) -> None:
    """cond(K) is 1e12: the set changes over several passes before a bound shrinks."""
    lines = (
        ("nodes = [41, 9]", "nodes = [100, 4]"),
        ("length = 600.0", "length = 60.0"),
        ("edge = 40.0", "edge = 10.0"),
    )
    text, path = STARTER.read_text(), tmp_path / "lines.toml"
    for old, new in lines:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    scene = read_scene(str(path))
    answer = reference(prepared(scene, form="sparse"), load_case(scene, "sparse"))
    assert answer.bound_mm <= 1e-11
