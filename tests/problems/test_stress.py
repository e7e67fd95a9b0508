"""Stresses of plates against closed forms (Timoshenko and Woinowsky-Krieger 1959), and their errors."""

import json
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest
import scipy.sparse as sp
from commands import harness
from scipy.sparse.linalg import splu, spsolve
from small_joints import degrees

from harness.scene.solution import solve
from harness.scene.stress import Stresses, largest_of, none_told, stress_record, stresses, stresses_of
from harness.verification.reference import proof_of
from problems.effects.local_thickness import LocalThickness
from problems.effects.thermal_bending import ThermalBending
from problems.errors import InputError
from problems.forms.assembly import Mask, Vector
from problems.input.text_files import read_text
from problems.model.part import PartModel
from problems.model.plate import Plate, line_loads
from problems.model.scene import JointScene
from problems.model.stress import PartStress, part_stress
from problems.scene_files import SCENES, read_scene
from report.figures.answer_maps import answer_figures
from report.results.answer_record import von_mises as answer_von_mises

NOWHERE = np.zeros((0, 2))
E, NU, T, SIDE, Q = 70e3, 0.3, 2.0, 100.0, 0.01


def square(elements: int) -> Plate:
    lines = np.linspace(0.0, SIDE, elements + 1)
    return Plate(lines, lines, T, E, NU)


def bent(plate: Plate, f: Vector, held: Mask, effects: tuple[LocalThickness, ...] = ()) -> Vector:
    """The unknowns under a load, some of them held at zero."""
    u, free = np.zeros(plate.size), np.flatnonzero(~held)
    K = sp.csc_array(PartModel(plate, effects, range(len(plate.y))).stiffness())
    u[free] = spsolve(K[free][:, free], f[free])
    return u


def of_border(plate: Plate, clamped: bool) -> Mask:
    """The unknowns that a simple support, or a clamp, of all four edges holds."""
    held = np.zeros((len(plate.y), 2, len(plate.x), 2), dtype=bool)
    for edge in (0, -1):
        held[edge, 0] = True
        held[:, :, edge, 0] = True
        if clamped:
            held[edge] = True
            held[:, :, edge] = True
    return held.ravel()


def pressed(plate: Plate, clamped: bool) -> PartStress:
    f = Q * np.kron(line_loads(plate.y, -np.inf, np.inf)[0], line_loads(plate.x, -np.inf, np.inf)[0])
    u = bent(plate, f, of_border(plate, clamped))
    return part_stress("plate", PartModel(plate, (), range(len(plate.y))), (), u, NOWHERE)


@pytest.mark.parametrize(("clamped", "moment"), [(False, 0.0479), (True, 0.02291)])
def test_a_square_plate_under_pressure_at_its_middle(clamped: bool, moment: float) -> None:
    """Positive displacements stretch the top face where the plate bulges. Of the clamped plate, 0.0231 in the
    book, by R. Taylor and S. Govindjee, Commun. Numer. Meth. Engng 20:757–765 (2004).
    """
    exact = 6 * moment * Q * SIDE**2 / T**2
    stress = pressed(square(16), clamped)
    order = np.argsort(((stress.places - SIDE / 2) ** 2).sum(axis=1), kind="stable")
    x, y, shear = stress.components[order[:4]].mean(axis=0)
    assert x == pytest.approx(exact, rel=6e-3)
    assert y == pytest.approx(x, rel=1e-9)
    assert abs(shear) < 1e-9 * exact


def test_a_cantilever_is_exact() -> None:
    """σ_xx = 6 P (L − x)/(b t²) without Poisson's ratio: the element has this curvature."""
    plate = Plate(np.linspace(0, 200.0, 6), np.linspace(0, 20.0, 3), T, E, 0.0)
    held = np.zeros((len(plate.y), 2, len(plate.x), 2), dtype=bool)
    held[:, :, 0] = True
    force = 3.0
    f = np.kron(line_loads(plate.y, -np.inf, np.inf)[0] / 20.0, np.eye(2 * len(plate.x))[-2]) * force
    stress = part_stress("strip", PartModel(plate, (), range(3)), (), bent(plate, f, held.ravel()), NOWHERE)
    exact = -6 * force * (200.0 - stress.places[:, 0]) / (20.0 * T**2)
    np.testing.assert_allclose(stress.components[:, 0], exact, rtol=1e-9)
    np.testing.assert_allclose(stress.components[:, 1:], 0.0, atol=1e-9 * abs(exact).max())
    np.testing.assert_allclose(stress.von_mises, abs(exact), rtol=1e-9)


def test_a_pure_twist_is_a_pure_shear() -> None:
    """w = cxy, a field of the element: τ_xy = −E t c / 2(1 + ν)."""
    plate, c = square(3), 1e-4
    u = degrees(plate.x, plate.y, lambda x, y: (c * x * y, c * y, c * x, c))
    stress = part_stress("plate", PartModel(plate, (), range(4)), (), u, NOWHERE)
    shear = -E * T * c / (2 * (1 + NU))
    np.testing.assert_allclose(stress.components, np.tile([0.0, 0.0, shear], (36, 1)), atol=1e-9 * abs(shear))


@pytest.mark.parametrize("padded", [False, True])
def test_a_warm_panel_that_is_free_has_no_stress(padded: bool) -> None:
    """Three deflections hold it; on a pad that covers it, too."""
    plate = square(6)
    pad = LocalThickness(kind="local_thickness", part="p", thickness=3.0, x=(0, SIDE), y=(0, SIDE))
    model = PartModel(plate, (pad,) * padded, range(7))
    warm = ThermalBending(kind="thermal_bending", part="p", difference=40.0)
    held = np.zeros((7, 2, 7, 2), dtype=bool)
    held[0, 0, 0, 0] = held[0, 0, -1, 0] = held[-1, 0, 0, 0] = True
    u = bent(plate, warm.load(model), held.ravel(), model.effects)
    cold = part_stress("p", model, (), u, NOWHERE)
    assert part_stress("p", model, (warm,), u, NOWHERE).von_mises.max() < 1e-7 * cold.von_mises.max()


@pytest.mark.parametrize("pad", [None, 1.0, 4.0])
def test_no_error_changes_a_stress_by_more_than_its_energy_allows(pad: float | None) -> None:
    """Neither a random one, nor that which changes the stress at a place the most; and that comes near."""
    plate, random = square(4), np.random.default_rng(0)
    pads = (
        ()
        if pad is None
        else (LocalThickness(kind="local_thickness", part="p", thickness=pad, x=(0, 30), y=(0, 100)),)
    )
    model, held = PartModel(plate, pads, range(5)), of_border(plate, clamped=False)
    K, free = sp.csc_array(model.stiffness()), np.flatnonzero(~held)

    def changed(e: Vector) -> Vector:
        stress = part_stress("p", model, (), e, NOWHERE)
        largest = np.maximum(abs(stress.components).max(axis=1), stress.von_mises)
        return np.asarray(largest / (stress.sensitivity * np.sqrt(e @ K @ e)))

    units, inverse = np.eye(plate.size)[free], splu(sp.csc_array(K[free][:, free]))
    operators = np.array([part_stress("p", model, (), unit, NOWHERE).components for unit in units])
    shares = []
    for k in range(40):
        e = np.zeros(plate.size)
        for values in (random.standard_normal(len(free)), inverse.solve(operators[:, k, k % 2])):
            e[free] = values
            shares.append(changed(e).max())
    assert 0.05 < max(shares) <= 1.0


def test_a_thin_place_between_the_gauss_points_counts() -> None:
    """K has it: σ = s u changes by up to √(s K⁺ sᵀ) per unit of energy. Thick at the points alone."""
    lines, cuts = np.array([0.0, 2.0]), (0.0, 0.40, 0.44, 1.56, 1.60, 2.0)
    thick = [(0.40, 0.44), (1.56, 1.60)]
    thin = [cell for cell in product(pairwise(cuts), repeat=2) if not {*cell} <= {*thick}]
    pads = tuple(
        LocalThickness(kind="local_thickness", part="p", thickness=T / 10, x=x, y=y) for x, y in thin
    )
    model, units = PartModel(Plate(lines, lines, T, E, NU), pads, range(2)), np.eye(16)
    s = np.array([part_stress("p", model, (), unit, NOWHERE).components for unit in units])
    compliance = np.linalg.pinv(model.stiffness().toarray(), rcond=1e-12, hermitian=True)
    most = np.sqrt(np.einsum("ikc,ij,jkc->kc", s, compliance, s))
    assert (most.max(axis=1) <= part_stress("p", model, (), units[0], NOWHERE).sensitivity).all()


def made(*components: tuple[float, float, float], error: float = 0.0) -> Stresses:
    """Stresses of one part."""
    k = len(components)
    about = np.ones(k), np.zeros(k, dtype=bool), np.zeros(k, dtype=np.intp)
    part = PartStress("plate", np.zeros((k, 2)), np.array(components), *about)
    return Stresses((part,), (np.full(k, error),))


def test_a_stress_that_overflows_passes_no_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 3e200 and 1e200 the squares overflow, √7 · 1e200 does not; what is not known is no PASS either."""
    large = made((1.0, 0.0, 0.0), (3e200, 1e200, 0.0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(large.parts[0].von_mises, [1.0, np.sqrt(7) * 1e200, 0.0], rtol=1e-14)
    np.testing.assert_array_equal(answer_von_mises(large.arrays), large.parts[0].von_mises)
    assert (large.exceeded(100.0), made((1.0, 0.0, 0.0)).exceeded(100.0)) == (True, False)
    assert made((1.0, 0.0, 0.0), error=np.nan).exceeded(100.0) is None
    for unknown in (np.inf, np.nan):
        found = made((1.0, 0.0, 0.0), (unknown, -unknown, 0.0))
        assert found.largest["von_mises"] == np.inf
        record = stress_record(found, None, 100.0)
        assert (record["exceeded"], record["kind"]) == (None, "")
        monkeypatch.setattr("harness.scene.stress.stresses_of", lambda *_, of=found: of.parts)
        assert largest_of(read_scene("gallery/padded-panel"), np.zeros(1)) == np.inf  # type: ignore[arg-type]


def test_a_stress_without_a_known_error_is_not_proven() -> None:
    record = stress_record(made((1.0, 0.0, 0.0), error=np.inf), None, 100.0)
    assert record["said"].startswith("CANNOT BE TOLD: limit 100 N/mm²; largest")
    assert "; not proven, mesh error not known" in record["said"]


def test_a_part_of_which_no_stress_is_told_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forces at points act near all of its elements: a PASS is of the other part alone."""
    (told,), (near,) = (made((stress, 0.0, 0.0)).parts for stress in (1.0, 900.0))
    near = replace(near, part="doubler", near_force=np.ones(1, dtype=bool))
    record = stress_record(Stresses((told, near), (np.zeros(1), np.zeros(1))), None, 100.0)
    assert (record["kind"], "none known of doubler" in record["said"]) == ("pass", True)
    monkeypatch.setattr("harness.scene.stress.stresses_of", lambda *_: (near,))  # alone it passes no limit
    assert largest_of(read_scene("gallery/padded-panel"), np.zeros(1)) == np.inf  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["three-part-stack", "padded-panel", "heavy-sheet-on-tool"])
def test_all_forms_have_the_same_stresses(name: str) -> None:
    dense, sparse = (stresses(solve(f"gallery/{name}", form=form)) for form in ("dual", "sparse"))
    largest = max(part.von_mises.max() for part in sparse.parts)
    for one, other in zip(dense.parts, sparse.parts, strict=True):
        np.testing.assert_allclose(one.components, other.components, rtol=0, atol=1e-6 * largest)


def test_the_error_of_a_rough_answer_is_said() -> None:
    """ADMM's answer to 1e-4: its stresses are as near to the exact ones as is said."""
    scene = "gallery/three-part-stack"
    exact, rough = solve(scene), solve(scene, "scs", tolerance=1e-4, form="dual")
    said = stresses(rough)
    for one, other, error in zip(stresses(exact).parts, said.parts, said.errors, strict=True):
        assert (abs(one.components - other.components).max(axis=1) <= error).all()
        assert (abs(one.von_mises - other.von_mises) <= error).all()
        assert error.max() > 1e-9


@pytest.mark.parametrize("name", ["three-part-stack", "installed-fasteners", "padded-panel"])
def test_the_energy_of_an_error_counts_the_rounding_of_the_answer(name: str) -> None:
    """Twice as precise displacements, and perturbed ones, are within the bound; it is no wild guess."""
    answer = solve(f"gallery/{name}", form="sparse")
    problem, random = answer.problem, np.random.default_rng(3)
    K, lam = problem.prepared.assembly.K, problem.reference.lam
    proof = proof_of(problem.prepared)
    for size in (1e-12, 1e-3):
        e = size * random.standard_normal(len(answer.unknowns)) / np.sqrt(K.diagonal)
        energy = float(np.sqrt(e @ K.multiply(e)))
        bound = proof.energy_error(problem.load, answer.unknowns + e, lam)
        assert energy <= bound + proof.energy_error(problem.load, answer.unknowns, lam)
        assert size < 1e-6 or bound < 1e6 * energy
    rounded = answer.unknowns + np.ldexp(answer.unknowns, -52)  # a unit in the last place away
    before, after = (stresses_of(problem.scene, x) for x in (answer.unknowns, rounded))
    for one, other, error in zip(before, after, stresses(answer).errors, strict=True):
        assert (abs(one.components - other.components).max(axis=1) <= error).all()


def test_forces_at_points_are_named() -> None:
    answer = solve("gallery/installed-fasteners")
    (part, *_) = stresses_of(answer.problem.scene, answer.unknowns)
    assert part.near_force.any()
    assert not part.near_force.all()


def test_the_element_of_a_force_and_its_neighbours_are_marked_whatever_their_sizes() -> None:
    plate = Plate(np.arange(9) * 50.0, np.array([-300.0, -200, -100, 0, 30, 60, 90, 120]), T, E, NU)
    model, u = PartModel(plate, (), range(3, 8)), np.zeros(plate.size)
    for x, low, high in ((120.0, 50, 200), (150.0, 50, 250)):  # on a mesh line, both elements are its
        stress = part_stress("p", model, (), u, np.array([[x, -20.0]]))
        near = ((stress.places > [low, -200]) & (stress.places < [high, 30])).all(axis=1)
        np.testing.assert_array_equal(stress.near_force, near)


def test_whether_any_stress_is_told_needs_no_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("problems.model.joint_model.JointModel.interior", lambda *_: pytest.fail("factored"))
    scene = read_scene("gallery/installed-fasteners")
    assert isinstance(scene, JointScene)
    assert not none_told(scene)


def test_superelements_without_recovery_have_none() -> None:
    with pytest.raises(InputError, match="only plates have stresses"):
        stresses_of(read_scene("drawn/superelements/0"), np.zeros(1))


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(("allowed", "code", "word"), [(50, 0, "PASS"), (0.5, 4, "FAIL"), (0, 2, "positive")])
def test_an_allowed_stress(tmp_path: Path, allowed: float, code: int, word: str) -> None:
    done = harness("solve", "gallery/heavy-sheet-on-tool", "--allow-stress", allowed, "--out", tmp_path / "a")
    assert done.exit_code == code
    assert word in done.output
    if code != 2:
        record = json.loads((tmp_path / "a/solution.json").read_text("utf-8"))
        assert record["stress"]["largest"]["von_mises"] == pytest.approx(2.13, abs=0.005)
        assert record["stress"]["mesh_error"] > 0
        assert f"{word}: limit {allowed} N/mm²" in (tmp_path / "a/answer.md").read_text("utf-8")


def test_every_stress_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its map, too; the other pictures of the answer are not drawn into files."""
    name = "report.writers.answer_report.answer_figures"
    monkeypatch.setattr(name, lambda *answer: {"stress": answer_figures(*answer)["stress"]})
    scene, out = "gallery/installed-fasteners", tmp_path / "a"
    limits = ("--allow-stress", 1e3, "--allow-gap", 1e-4)
    done = harness("solve", scene, *limits, "--out", out)
    assert done.exit_code == 4, done.output  # the gap is too large, the stress is not
    found, table = stresses(solve(scene)), pd.read_csv(out / "stress.csv", keep_default_na=False)
    assert list(table)[:8] == ["part", "x", "y", "side", "sxx", "syy", "sxy", "von_mises"]
    for part in found.parts:
        of_part = table[table["part"] == part.part]
        for side, sign in (("top", 1), ("bottom", -1)):
            of_side = of_part[of_part["side"] == side]
            read = of_side[["sxx", "syy", "sxy"]].to_numpy()
            np.testing.assert_allclose(read, sign * part.components, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(of_side["von_mises"], part.von_mises, rtol=1e-12)
            np.testing.assert_array_equal(of_side["not_to_be_read"] != "", part.near_force)
    mesh = meshio.read(out / "stress.vtu")
    assert mesh.cells[0].type == "quad"
    np.testing.assert_allclose(mesh.point_data["sxx"], table[table["side"] == "top"]["sxx"])
    assert "![The stress of the parts](stress.png)" in (out / "answer.md").read_text("utf-8")
    assert f"stress of {found.parts[0].part}" in (out / "index.html").read_text("utf-8")
    assert (out / "stress.png").stat().st_size > 0


@pytest.mark.usefixtures("without_pictures")
def test_a_scene_asks_for_stresses(tmp_path: Path) -> None:
    text = read_text(SCENES / "gallery/heavy-sheet-on-tool.toml", "file", 1, strict=True)
    (tmp_path / "asked.toml").write_text(f"{text}\n[output]\nstress = true\n", "utf-8")
    assert read_scene(str(tmp_path / "asked.toml")).key == read_scene("gallery/heavy-sheet-on-tool").key
    done = harness("solve", tmp_path / "asked.toml", "--out", tmp_path / "a")
    assert "Largest von Mises stress 2.13 N/mm², sheet" in done.output.replace("\n", " ")
