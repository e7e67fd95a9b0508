"""Sparse problems drawn at random: answers from elsewhere, exact ones, and what the draws are made of."""

from dataclasses import replace
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np
import pytest
from exact_answer import is_exact
from synthetic_results import no_answer, results, row, shown, table

from harness.solving.solver_session import answer_of
from problems.forms.assembly import Vector
from problems.forms.prepared import Prepared
from problems.ladders import ladders, make_rung, rung_names, sparse
from problems.ladders.rough import brick_stiffness
from problems.model.scene import ManufacturedProblem, ManufacturedScene, Scene
from report.sections.sparse_problems import section
from solvers.registry import make_solver

SMALL = [name for name in rung_names("sparse/") if "/500-" in name]
DRAWS = range(sparse.DRAWS)


def made_of(scene: Scene) -> ManufacturedProblem:
    assert isinstance(scene, ManufacturedScene)
    return scene.made


def by(solver: str, made: ManufacturedProblem, tolerance: float) -> Vector:
    """x of a solver in the sparse form."""
    prepared = Prepared(made.assembly)
    return np.asarray(answer_of(solver, make_solver(solver, {}), prepared, "sparse", made.load, tolerance).x)


def pooled(y: Vector, w: Vector) -> list[Fraction]:
    """Isotonic regression by pooling adjacent violators (Barlow et al. 1972), in rational numbers."""
    blocks: list[tuple[Fraction, Fraction, int]] = []  # sum, weight, number
    for value, weight in zip(map(Fraction, y), map(Fraction, w), strict=True):
        total, number = value * weight, 1
        while blocks and blocks[-1][0] * weight >= total * blocks[-1][1]:
            total, weight, number = (
                a + b for a, b in zip(blocks.pop(), (total, weight, number), strict=True)
            )
        blocks.append((total, weight, number))
    return [total / weight for total, weight, number in blocks for _ in range(number)]


@pytest.mark.parametrize("k", DRAWS)
def test_isotonic_regression_is_that_of_pooling(k: int) -> None:
    made = made_of(make_rung(f"sparse/isotonic/500-{k}"))
    w, f = made.assembly.K.diagonal, made.load.f
    x = pooled(f / w, w)
    weights = zip(map(Fraction, f), map(Fraction, w), x, strict=True)
    *forces, rest = accumulate(force - weight * value for force, weight, value in weights)
    gaps = [b - a for a, b in pairwise(x)]
    assert rest == 0 == min(*forces, *gaps)
    assert not any(force * gap for force, gap in zip(forces, gaps, strict=True))
    A = made.assembly.A @ np.array(forces, dtype=float)
    np.testing.assert_allclose(w * np.array(x, dtype=float) + A, f, atol=1e-12)
    for solver, tolerance in (("newton", 1e-10), ("clarabel", 1e-11)):
        np.testing.assert_allclose(by(solver, made, tolerance), np.array(x, dtype=float), atol=1e-7)


def test_monotone_regression_is_that_of_pooling_lines_in_turn() -> None:
    """Dykstra and Robertson (1982): rows and columns in turn, each without its last change."""
    made = made_of(sparse.monotone(60, 0.4, seed=1))
    x = made.load.f.reshape(sparse.sides(60, seed=1))
    changes = [np.zeros_like(x), np.zeros_like(x.T)]
    for turn in range(300):
        wanted = x.T if turn % 2 else x
        wanted = wanted - changes[turn % 2]
        lines = np.array([pooled(line, np.ones(line.size)) for line in wanted], dtype=float)
        changes[turn % 2] = lines - wanted
        x = lines.T if turn % 2 else lines
    for solver, tolerance in (("newton", 1e-10), ("clarabel", 1e-12)):
        np.testing.assert_allclose(by(solver, made, tolerance), x.ravel(), atol=1e-7)


@pytest.mark.parametrize("k", DRAWS)
def test_the_answer_to_random_rows_is_exact(k: int) -> None:
    made = made_of(make_rung(f"sparse/rows/500-{k}"))
    assert is_exact(replace(made, assembly=replace(made.assembly, K=made.assembly.K.as_dense())))


def test_bricks_have_the_energy_of_a_uniform_strain() -> None:
    """2uᵀKu = V(λ (tr ε)² + 2μ ε:ε) for u = (ε + ω)x: none from a rotation ω."""
    shape = (4, 3, 5)
    G = np.random.default_rng(1).standard_normal((3, 3))
    strain, places = (G + G.T) / 2, np.indices(shape).reshape(3, -1)
    u = (G @ places).ravel()
    energy = 3 * 2 * 4 * (1.5 * np.trace(strain) ** 2 + 2 * (strain**2).sum())
    assert u @ (brick_stiffness(*shape) @ u) == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("name", SMALL)
def test_a_draw_is_what_its_name_and_version_say(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, (_, family, rung) = make_rung(name), name.split("/")
    made = made_of(scene)
    assert scene.expected_size == (made.assembly.n, made.assembly.m)
    assert abs(made.assembly.n - 500) <= 60
    again = ladders("sparse/")[family][rung]
    assert again().key == scene.key
    monkeypatch.setattr(sparse, "__version__", "another")
    assert again().key != scene.key


def test_the_report_says_how_far_ours_is_from_the_fastest_library(tmp_path: Path) -> None:
    def of(scene: str, solver: str, seconds: float, **figures: object) -> dict[str, object]:
        steps = dict.fromkeys(("convert_s", "setup_s", "form_s"), 0.0)
        steps |= dict.fromkeys(("prepare_s", "solve_s"), seconds / 2)
        return row("1/1", solver, "sparse") | steps | {"scene": f"sparse/{scene}"} | figures

    rows = [of(f"isotonic/500-{k}", "newton", seconds) for k, seconds in enumerate((1.0, 2.0, 8.0))]
    rows += [of(f"isotonic/500-{k}", "osqp", 2.0) for k in (0, 1)]
    rows += [of("isotonic/500-2", "osqp", 2.0, verdict="outside")]
    rows += [of("isotonic/500-1", "scs", 1.0), of("isotonic/500-0", "scs", 0.1, verdict="outside")]
    first = shown(table(section(results(tmp_path / "a", rows)), "sparse"))[1:]
    figures = ["3", "3", "2.00", "4.00", "0.500", "2.00"]
    assert first == [["newton (sparse)", name, *figures] for name in ("isotonic/500", "all")]
    rows += [of("plate/500-0", "newton", 1.0) | no_answer("time_limit"), of("plate/500-0", "scs", 1.0)]
    last = shown(table(section(results(tmp_path / "b", rows)), "sparse"))[-1]
    assert last == ["newton (sparse)", "all", "4", "3", "5.00", "∞", "1.25", "∞"]
    assert section(results(tmp_path / "c", [row()])) is None


def test_a_problem_that_no_library_was_run_on_is_none_that_they_missed(tmp_path: Path) -> None:
    ours, library = (
        row("1/1", name, "sparse") | {"scene": "sparse/isotonic/500-0"} for name in ("newton", "osqp")
    )
    rows = [ours, library | no_answer("not_run")]
    (_, line, _) = shown(table(section(results(tmp_path, rows)), "sparse"))
    assert line[-2:] == ["–", "–"]
