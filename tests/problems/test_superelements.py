"""Joints of superelements against the built-in joint, closed forms, and themselves elsewhere."""

import os
import pickle
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from argyris_plates import bending
from refusals import refusal_of
from scipy.sparse.linalg import splu
from superelements import (
    Array,
    Tables,
    flat,
    scene_from,
    solved,
    stiffnesses,
    two_plates,
    write_part,
    write_plates,
)

from harness.scene.solution import Solution
from problems.build import load_case, model_of, prepared
from problems.effects.part_position import PartPosition
from problems.errors import InputError
from problems.model.contact_pairing import Face, paired
from problems.model.scene import JointScene
from problems.model.surface import surface_of
from problems.scene_files import scene_of

JOINT = two_plates()
FASTENERS = {"kind": "fasteners", "preload": 900.0, "points": [[50.0, 30.0], [231.0, 47.0]]}
INSTALLED = {"kind": "installed_fasteners", "approach": 0.1, "points": [[341.0, 21.0], [150.0, 90.0]]}
PRESSURE = {"kind": "pressure", "part": "b", "value": -2e-4}
CLAMPS = {"kind": "clamps", "clamping_force": 300.0, "points": [[300.0, 100.0]]}
SHIMS = {"kind": "shims", "thickness": 0.1, "x": [100.0, 200.0], "y": [0.0, 60.0]}
RANDOM = {"sd": 0.1, "correlation_length": 90.0, "seed": 3}


def measured(joint: Any) -> Tables:
    """A random gap, given at the nodes."""
    gap = {"kind": "initial_gap", "mean": 0.4, "random": RANDOM}
    g = load_case(scene_of({"joint": joint, "effect": [gap]})).g
    return {"kind": "measured_gap", "points": np.column_stack([joint.nodes, g]).tolist()}


EFFECTS = (measured(JOINT), FASTENERS, INSTALLED, PRESSURE, CLAMPS, SHIMS)


def built_in(*effects: Tables) -> JointScene:
    return scene_of({"joint": JOINT, "effect": list(effects)})


@cache
def built_in_answer() -> Solution:
    return solved(built_in(*EFFECTS))


def test_the_built_in_joint_as_superelements_has_its_answer(tmp_path: Path) -> None:
    ours, theirs = built_in_answer(), solved(scene_from(write_plates(tmp_path, JOINT), *EFFECTS))
    assert 0 < (ours.lam > 0).sum() < len(ours.lam)
    for name in ("x", "gap"):
        np.testing.assert_allclose(getattr(theirs, name), getattr(ours, name), rtol=0, atol=1e-12)
    np.testing.assert_allclose(theirs.lam, ours.lam, rtol=1e-8, atol=1e-8)
    one, other = ours.problem, theirs.problem
    assert (one.prepared.assembly.A != other.prepared.assembly.A).nnz == 0
    np.testing.assert_array_equal(one.load.f, other.load.f)


@pytest.mark.parametrize(("format", "kept"), [("abaqus", 0.0), ("dmig", 1e-9)])
def test_labels_say_which_row_is_which(format: str, kept: float, tmp_path: Path) -> None:
    """kept : the relative rounding of the format, ten digits of DMIG."""
    parts = write_plates(tmp_path, JOINT, format=format, id=np.arange(1, 46))
    K = stiffnesses(JOINT)
    order = np.random.default_rng(2).permutation(45)
    for part in parts:  # the rows of the table in another order
        lines = Path(part["nodes"]).read_text().splitlines()
        Path(part["nodes"]).write_text("\n".join([lines[0], *(lines[1 + k] for k in order)]) + "\n")
    scene = scene_from(parts, *EFFECTS)
    own = scene.joint.parts[0]
    np.testing.assert_array_equal(own.nodes.xyz[own.node, :2], JOINT.nodes)
    np.testing.assert_allclose(own.stiffness, K[0], rtol=kept)
    error = abs(np.sort(solved(scene).gap) - np.sort(built_in_answer().gap)).max()
    assert error < (1e-6 if kept else 1e-9)


ROWS = {"table": [3], "ids": [3], "directions": [1, 2, 3]}


@pytest.mark.parametrize("order", ROWS)
def test_rows_without_labels_are_as_the_scene_says(order: str, tmp_path: Path) -> None:
    """Ids and places in another order than the rows of K: asked; the gaps of the built-in joint; and an
    order that does not fit K is told."""
    others, dofs = np.random.default_rng(4).permutation(45), ROWS[order]
    K = [np.kron(np.diag([0.0] * (len(dofs) - 1) + [1.0]), one) for one in stiffnesses(JOINT)]
    parts = []
    for name, one in zip("ab", K, strict=True):
        one[range(len(one) - 45), range(len(one) - 45)] = 1e3  # in the plane, on springs
        rows = others if order == "table" else np.arange(45)
        rows = np.concatenate([rows + 45 * k for k in range(len(dofs))])
        table = others if order != "directions" else np.arange(45)
        xyz = flat(JOINT.nodes)[table]
        part = write_part(tmp_path, name, one[np.ix_(rows, rows)], xyz, dofs=dofs, id=table + 1)
        parts.append({key: value for key, value in part.items() if key != "rows"})
    with pytest.raises(InputError, match='"table", "ids" or "directions"'):
        scene_from(parts)
    right = scene_from([part | {"rows": order} for part in parts], *EFFECTS)
    wrong = scene_from([part | {"rows": "ids" if order == "table" else "table"} for part in parts], *EFFECTS)
    np.testing.assert_allclose(solved(right).gap, built_in_answer().gap, rtol=0, atol=1e-12)
    assert [f'the order "{order}"' in said for said in wrong.unusual] == [True, True]
    assert not right.unusual


def test_a_file_replaced_with_its_size_and_time_is_read_anew(tmp_path: Path) -> None:
    (part, other), path = write_plates(tmp_path, JOINT), tmp_path / "a.npz"
    assert scene_from([part, other]).joint.parts[0].stiffness[0, 0] == stiffnesses(JOINT)[0][0, 0]
    before = path.stat()
    np.savez(path, K=2 * stiffnesses(JOINT)[0])
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert scene_from([part, other]).joint.parts[0].stiffness[0, 0] == 2 * stiffnesses(JOINT)[0][0, 0]


def test_one_matrix_of_several(tmp_path: Path) -> None:
    part, K = write_plates(tmp_path, JOINT)[0], stiffnesses(JOINT)[0]
    np.savez(tmp_path / "a.npz", KAA=K, MAA=np.eye(45))
    with pytest.raises(InputError, match=r"KAA.*MAA.*matrix"):
        scene_from([part])
    for name, wanted in (("KAA", K), ("MAA", np.eye(45))):
        np.testing.assert_array_equal(scene_from([part | {"matrix": name}]).joint.parts[0].stiffness, wanted)


@pytest.mark.parametrize("bare", [False, True])
def test_three_parts_that_meet_at_other_places_may_form_a_ring(bare: bool, tmp_path: Path) -> None:
    """A strap on both ends of two parts that overlap in the middle. Where all meet, contacts depend."""
    column, parts = np.unique(JOINT.nodes[:, 0], return_inverse=True)[1], []
    own = {"strap": (column < 3) | (column > 5) | bare, "left": column < 6, "right": column > 2}
    for k, (name, inside) in enumerate(own.items()):
        rows = np.flatnonzero(inside)
        nodes = np.column_stack([JOINT.nodes[rows], np.full(len(rows), k)])
        parts.append(write_part(tmp_path, name, 40 * np.eye(len(rows)), nodes))
    ring = [["strap", "left"], ["strap", "right"], ["left", "right"]]
    scene = scene_from(parts, {"kind": "initial_gap", "mean": 0.1}, contacts=ring)
    if bare:
        with pytest.raises(InputError, match=r"left – right at node .*dependent on strap – left at node"):
            prepared(scene)
    answer = solved(scene)
    assert len(answer.gap) == (75 if bare else 45)
    assert answer.choice.form == ("sparse" if bare else "dual")
    assert answer.judgement.verdict == "within"
    with pytest.raises(InputError, match="no pair twice"):
        scene_from(parts, contacts=[["strap", "left"], ["left", "strap"]])


def error_of_other_meshes(folder: Path, elements: int) -> float:
    """Of the gaps: b has one and a half times the elements of a, against b on the mesh of a."""
    fine = two_plates((2 * elements + 1, elements + 1))
    other = two_plates((3 * elements + 1, 3 * elements // 2 + 1))
    a, b = stiffnesses(fine)
    far = stiffnesses(other)[1]
    first = write_part(folder, "a", a, flat(fine.nodes))
    seconds = write_part(folder, "b", b, flat(fine.nodes)), write_part(folder, "c", far, flat(other.nodes))
    effects = {"kind": "initial_gap", "mean": 0.2}, PRESSURE | {"value": -6e-4}
    same, away = (solved(scene_from([first, second | {"name": "b"}], *effects)) for second in seconds)
    assert 0 < (same.lam > 0).sum() < len(same.lam)
    return float(abs(same.gap - away.gap).max())


def test_meshes_that_do_not_match_converge_to_those_that_do(tmp_path: Path) -> None:
    errors = [error_of_other_meshes(tmp_path, elements) for elements in (2, 4, 8)]
    assert all(fine < coarse / 2.5 for coarse, fine in pairwise(errors)), errors
    assert errors[-1] < 2e-3


MOVED = np.array([3e3, -2e3, 500.0])  # mm


def rotation() -> Array:
    """By no small angles, about no axis."""
    Q, R = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q if np.linalg.det(Q) > 0 else Q[:, ::-1])


def test_parts_anywhere_in_space_have_the_same_gaps(tmp_path: Path) -> None:
    """Three displacements per node, those in the surface held by springs of their own."""
    R, parts = rotation(), []
    turn = np.kron(np.eye(45), R)  # of local displacements to global ones
    for name, K in zip("ab", stiffnesses(JOINT), strict=True):
        local = np.diag(np.tile([1e3, 2e3, 0.0], 45))
        local[2::3, 2::3] = K
        xyz = flat(JOINT.nodes) @ R.T + MOVED
        normals = np.tile(R[:, 2], (45, 1))
        whole = turn @ local @ turn.T
        parts.append(write_part(tmp_path, name, (whole + whole.T) / 2, xyz, normals, dofs=[1, 2, 3]))
    axes = scene_from(parts).joint.axes

    def there(x: float, y: float) -> list[float]:
        return (axes @ (R @ [x, y, 0.0] + MOVED))[:2].tolist()

    def turned(effect: Tables) -> Tables:
        points = [[*there(*point[:2]), *point[2:]] for point in effect["points"]]
        return effect | {"points": points}

    effects = [*map(turned, (measured(JOINT), FASTENERS, INSTALLED)), PRESSURE]
    here = solved(built_in(measured(JOINT), FASTENERS, INSTALLED, PRESSURE))
    scene = scene_from(parts, *effects)
    gaps, places = solved(scene).gap, scene.joint.places(("a", "b"))
    np.testing.assert_allclose(places, [there(*node) for node in JOINT.nodes], atol=1e-9)
    np.testing.assert_allclose(gaps, here.gap, rtol=0, atol=1e-7)
    shown = scene.joint.shown
    np.testing.assert_allclose(shown @ solved(scene).x, here.x, rtol=0, atol=1e-7)


def disc(turned: float) -> tuple[Array, Array]:
    """A clamped disc of radius and rigidity 1 in Morley's triangles: K at its inner vertices, and these."""
    mesh = skfem.MeshTri.init_circle(4)
    turn = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    basis = skfem.Basis(skfem.MeshTri(turn @ mesh.p, mesh.t), skfem.ElementTriMorley())
    K = sp.csr_array(bending.assemble(basis, poisson=0.3))
    inner = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    kept = basis.nodal_dofs[0, inner]
    rest = np.setdiff1d(np.arange(basis.N), np.concatenate([kept, basis.get_dofs().all()]))
    inverse = splu(sp.csc_array(K[rest][:, rest]))
    condensed = K[kept][:, kept] - K[kept][:, rest] @ inverse.solve(K[rest][:, kept].toarray())
    return (condensed + condensed.T) / 2, basis.mesh.p[:, inner].T


def test_two_clamped_discs_of_another_code_share_a_pressure(tmp_path: Path) -> None:
    """Radius R, rigidity D, pressure q on one: both bend by (q/2) R⁴/64D in the middle (Timoshenko)."""
    parts, R, D, q = [], 100.0, 5e5, 0.05
    for name, turned in (("a", 0.0), ("b", 0.3)):
        K, nodes = disc(turned)
        parts.append(write_part(tmp_path, name, D / R**2 * K, flat(R * nodes)))
    gap, load = {"kind": "initial_gap", "mean": 0.0}, {"kind": "pressure", "part": "a", "value": q}
    scene = scene_from(parts, gap, load)
    found, joint = solved(scene), scene.joint
    middle = [np.hypot(*joint.nodes_of(name).T).argmin() for name in "ab"]
    for name, k in zip("ab", middle, strict=True):
        assert found.x[joint.unknowns(name)][k] == pytest.approx(q / 2 * R**4 / (64 * D), rel=0.03)
    inner = (np.pi * R**2 - joint.areas("a").sum()) / (np.pi * R**2)
    assert 0 < inner < 0.2  # the ring between the last nodes and the clamped edge


def cylinder(radius: float, angles: Array, y: Array) -> tuple[Array, Array]:
    A, Y = (each.ravel() for each in np.meshgrid(angles, y))
    normals = np.column_stack([np.sin(A), np.zeros_like(A), np.cos(A)])
    return radius * normals + np.column_stack([np.zeros_like(A), Y, np.zeros_like(A)]), normals


def cylinders(folder: Path, end: float, R: Array, moved: Array) -> list[Tables]:
    """Concentric ones on springs, a up to an angle and b beyond it, both turned and then moved."""
    parts = []
    for name, radius, last, lines in (("a", 200.0, end, 25), ("b", 202.0, end + 0.1, 41)):
        xyz, normals = cylinder(radius, np.linspace(-last, last, lines), np.linspace(0.0, 50.0, 6))
        K, xyz, normals = 40.0 * np.eye(3 * len(xyz)), xyz @ R.T + moved, normals @ R.T
        parts.append(write_part(folder, name, K, xyz, normals, dofs=[1, 2, 3]))
    return parts


def test_contacts_of_curved_surfaces_are_along_their_normals(tmp_path: Path) -> None:
    """A pressure on the inner one of two cylinders, by its area, is shared evenly."""
    gap, load = {"kind": "initial_gap", "mean": 0.1}, {"kind": "pressure", "part": "a", "value": 1.0}
    scene = scene_from(cylinders(tmp_path, 0.6, np.eye(3), np.zeros(3)), gap, load)
    joint, A = scene.joint, prepared(scene).assembly.A
    np.testing.assert_allclose(joint.pairings["a", "b"].apart, 2.0, atol=0.04)  # chords of b
    assert joint.areas("a").reshape(-1, 3).shape == (150, 3)
    total = np.linalg.norm(joint.areas("a").reshape(-1, 3), axis=1).sum()
    assert total == pytest.approx(200 * 1.2 * 50, rel=1e-3)
    for name, sign in (("a", 1.0), ("b", -1.0)):  # a radial motion of a whole part
        part = joint.parts["ab".index(name)]
        radial = np.zeros(A.shape[0])
        radial[joint.unknowns(name)] = part.nodes.normal.ravel()
        np.testing.assert_allclose(A.T @ radial, sign, atol=1e-3)
    assert solved(scene).gap.min() > -1e-9


def test_no_rigid_motion_of_both_parts_stretches_a_fastener_between_tilted_faces(tmp_path: Path) -> None:
    """They are drawn 5 mm apart, and the plane of the junction stays that of x and y."""
    angle = np.radians(9.0)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    first = flat(JOINT.nodes) @ turn.T
    normals, K = np.tile(turn[:, 2], (len(first), 1)), 50 * np.eye(3 * len(first))
    places = first, first + 5 * normals
    parts = [
        write_part(tmp_path, name, K, xyz, normals, dofs=[1, 2, 3])
        for name, xyz in zip("ab", places, strict=True)
    ]
    joint = scene_from(parts, pairing={"distance": 6.0}).joint
    points = np.array([[150.0, 60.0], [200.0, 33.0]])
    for turning in np.eye(3):
        a, b = (np.cross(turning, xyz).ravel() for xyz in places)
        stretch = joint.deflection("a", points) @ a - joint.deflection("b", points, "a") @ b
        assert abs(stretch).max() < 1e-9


def test_a_part_off_its_place_moves_as_a_rigid_body_along_inclined_normals(tmp_path: Path) -> None:
    """By Aᵀx of the motion of all its nodes; a shift by the cosine of each normal, half of it at 60°."""
    joint = scene_from(cylinders(tmp_path, np.pi / 3, rotation(), MOVED)).joint
    A, axes = joint.contact_matrix(), joint.axes
    places = [part.nodes.xyz @ axes.T for part in joint.parts]
    centre = np.array([np.vstack(places).min(axis=0), np.vstack(places).max(axis=0)]).mean(axis=0)
    shift, slope_x, slope_y = 0.3, 2e-3, -1e-3
    for name, at in zip("ab", places, strict=True):
        table = {"kind": "part_position", "part": name, "shift": shift}
        moved = np.array([0.0, 0.0, shift]) + np.cross([slope_y, -slope_x, 0.0], at - centre)
        x = np.zeros(A.shape[0])
        x[joint.unknowns(name)] = (moved @ axes).ravel()
        tilted = PartPosition.model_validate(table | {"slope_x": slope_x, "slope_y": slope_y})
        np.testing.assert_allclose(tilted.gap(joint), -A.T @ x, rtol=0, atol=1e-12)
        lifted, cosine = PartPosition.model_validate(table).gap(joint), joint.parts[0].nodes.normal @ axes[2]
        np.testing.assert_allclose(abs(lifted), shift * cosine, rtol=0, atol=1e-12)
        assert abs(lifted).min() == pytest.approx(0.15, rel=1e-9)


@pytest.mark.parametrize("degrees", [40, 50, 80])
def test_every_node_has_its_foot_on_a_strongly_curved_surface(degrees: float) -> None:
    """Half cylinders up to 80° from the plane, of meshes that do not match: feet lie straight outside."""
    y, end = np.linspace(0.0, 40.0, 5), np.radians(degrees)
    faces = []
    for radius, lines in ((100.0, 31), (101.0, 38)):
        xyz, normals = cylinder(radius, np.linspace(-end, end, lines), y)
        faces.append(Face(xyz, normals, surface_of(xyz[:, :2])))
    pairing = paired(*faces, distance=5.0)
    assert len(pairing.nodes) == 155
    assert (pairing.beyond, pairing.far, pairing.crossed, pairing.lost) == (0, {}, (), ())
    feet = pairing.W @ faces[1].xyz
    wanted = np.arctan2(faces[0].xyz[:, 0], faces[0].xyz[:, 2])
    np.testing.assert_allclose(np.arctan2(feet[:, 0], feet[:, 2]), wanted, atol=1e-10)
    np.testing.assert_allclose(np.linalg.norm(feet[:, [0, 2]], axis=1) - 100.0, pairing.apart, atol=1e-9)


def test_a_line_that_meets_no_surface_is_told() -> None:
    """The normal of one node lies in the plane of the other surface, a millimetre away."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 30, 4), np.linspace(0, 20, 3)))
    above, below = (np.column_stack([x, y, np.full(12, z)]) for z in (0.0, 1.0))
    normals = np.tile([0.0, 0.0, 1.0], (12, 1))
    tilted = normals.copy()
    tilted[5] = [1.0, 0.0, 0.0]
    surface = surface_of(above[:, :2])
    found = paired(Face(above, tilted, surface), Face(below, normals, surface), distance=5.0)
    assert found.lost == (5,)
    assert sorted(found.nodes) == [k for k in range(12) if k != 5]


def test_a_sparse_k_stays_sparse_in_the_sparse_form(tmp_path: Path) -> None:
    """2501 nodes on springs, coupled to their neighbours."""
    x = np.linspace(0.0, 400.0, 61)
    nodes = np.column_stack([each.ravel() for each in np.meshgrid(x, np.linspace(0.0, 120.0, 41))])
    lines = [sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(k, k)) for k in (41, 61)]
    K = sp.csc_array(100 * sp.kronsum(lines[1], lines[0]))
    parts = [write_part(tmp_path, name, K, flat(nodes)) for name in "ab"]
    scene = scene_from(parts, {"kind": "initial_gap", "mean": 0.05}, FASTENERS, INSTALLED)
    model: Any = model_of(scene)
    assert model.stored_sparse is not None
    made = prepared(scene, form="sparse").assembly
    assert not made.K.dense
    v = np.random.default_rng(0).standard_normal(5002)
    T, k = model.springs.T, model.springs.k
    wanted = np.concatenate([K @ v[:2501], K @ v[2501:]]) + T @ (k * (T.T @ v))
    np.testing.assert_allclose(made.K.multiply(v), wanted, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_matrices_of_other_contacts_have_another_key(form: Any, tmp_path: Path) -> None:
    """The key names proven answers in the cache: K, f and g are the same, A is not."""
    nodes = flat(np.array([[x, y] for y in (0.0, 40.0) for x in (0.0, 50.0, 100.0)]))
    parts = [write_part(tmp_path, name, 50.0 * np.eye(6), nodes) for name in "abc"]
    gap = {"kind": "initial_gap", "mean": 0.05}
    pairs = [["a", "b"], ["b", "c"]], [["a", "b"], ["a", "c"]], [["b", "c"], ["a", "b"]]
    scenes = [scene_from(parts, gap, contacts=some) for some in pairs]
    tools = ({"kind": "rigid_tool", "part": part, "distance": 0.1} for part in "ab")
    scenes += [scene_from(parts[:2], gap, tool) for tool in tools]
    assert len({prepared(scene, form=form).key for scene in scenes}) == len(scenes)


def test_a_random_gap_on_scattered_nodes_has_its_covariance(tmp_path: Path) -> None:
    random = np.random.default_rng(6)
    nodes = np.column_stack([random.uniform(0, 300, 40), random.uniform(0, 100, 40)])
    parts = [write_part(tmp_path, name, 50 * np.eye(40), flat(nodes)) for name in "ab"]
    draws = []
    scene = scene_from(parts, {"kind": "initial_gap", "mean": 0.5, "random": RANDOM})
    (effect,) = scene.effects
    for seed in range(1500):
        own = effect.random.model_copy(update={"seed": seed})
        draws.append(effect.model_copy(update={"random": own}).gap(scene.joint))
    places = scene.joint.places(("a", "b"))
    C = 0.01 * np.exp(-0.5 * ((places[:, None] - places) ** 2).sum(axis=2) / 90.0**2)
    assert abs(np.mean(draws, axis=0) - 0.5).max() < 4.5 * 0.1 / np.sqrt(1500)
    assert abs(np.cov(np.transpose(draws)) - C).max() < 6 * 0.01 / np.sqrt(1500)


def test_a_tool_and_a_third_part(tmp_path: Path) -> None:
    K = stiffnesses(JOINT)
    parts = [write_part(tmp_path, name, K[0], flat(JOINT.nodes)) for name in "abc"]
    gap, tool = {"kind": "initial_gap", "mean": 0.1}, {"kind": "rigid_tool", "part": "c", "distance": 0.2}
    theirs = solved(scene_from(parts, gap, tool, FASTENERS | {"between": ["a", "b"]}))
    same = tuple(JOINT.part[0].model_copy(update={"name": name}) for name in "abc")
    joint = JOINT.model_copy(update={"part": same})
    ours = solved(scene_of({"joint": joint, "effect": [gap, tool, FASTENERS | {"between": ["a", "b"]}]}))
    np.testing.assert_allclose(theirs.gap, ours.gap, rtol=0, atol=1e-12)


def test_the_key_is_that_of_what_the_files_hold(tmp_path: Path) -> None:
    parts = write_plates(tmp_path, JOINT)
    first = scene_from(parts, FASTENERS)
    assert scene_from(parts, FASTENERS).key == first.key
    assert scene_from(parts).assembly_key == first.assembly_key
    nodes = Path(parts[0]["nodes"])
    nodes.write_text(nodes.read_text().replace("\n1,0.0,0.0,0.0\n", "\n1,0.5,0.0,0.0\n"))
    moved = scene_from(parts, FASTENERS)
    assert moved.assembly_key != first.assembly_key
    np.savez(parts[1]["superelement"], K=2 * stiffnesses(JOINT)[1])
    assert scene_from(parts, FASTENERS).assembly_key != moved.assembly_key


def test_unknowns_off_the_contact_surface_and_rotations_are_solved_for(tmp_path: Path) -> None:
    """A third of the rows: deflection and rotations at each node, and three nodes that touch nothing."""
    K = stiffnesses(JOINT)
    more = [write_part(tmp_path, "b", K[1], flat(JOINT.nodes))]
    nodes = np.concatenate([flat(JOINT.nodes), [[0.0, 0, 9], [50.0, 0, 9], [90.0, 20, 9]]])
    random = np.random.default_rng(7).standard_normal((144, 144))
    whole = random @ random.T / 10 + np.diag(np.tile([200.0, 5e3, 5e3], 48))
    whole = whole @ np.diag(np.tile([1.0, 8.0, 8.0], 48))
    whole = whole + whole.T + 1e5 * np.eye(144)
    condensed = np.linalg.inv(np.linalg.inv(whole)[:135:3, :135:3])
    rows = {"dofs": [3, 4, 5], "contact": [1] * 45 + [0] * 3}
    large = write_part(tmp_path, "a", whole, nodes, **rows)
    small = write_part(tmp_path, "c", (condensed + condensed.T) / 2, flat(JOINT.nodes)) | {"name": "a"}
    other_side = {"kind": "pressure", "part": "a", "value": 1e-3}
    effects = measured(JOINT), FASTENERS, INSTALLED, PRESSURE, other_side
    one, other = (solved(scene_from([part, *more], *effects)) for part in (large, small))
    assert len(one.x) == 144 + 45
    np.testing.assert_allclose(one.gap, other.gap, rtol=0, atol=1e-9)
    shown = one.problem.scene.joint.shown @ one.x
    np.testing.assert_allclose(shown, other.x, rtol=0, atol=1e-9)


def test_a_free_part_with_rotations_is_told_by_its_six_motions(tmp_path: Path) -> None:
    nodes, dofs = np.random.default_rng(3).uniform(0, 100, (12, 3)), [1, 2, 3, 4, 5, 6]
    part = scene_from([write_part(tmp_path, "a", np.eye(72), nodes, dofs=dofs)]).joint.parts[0]
    Q, _ = np.linalg.qr(part.rigid)
    free = write_part(tmp_path, "b", 1e4 * (np.eye(72) - Q @ Q.T), nodes, dofs=dofs)
    (fault,) = refusal_of(lambda: prepared(scene_from([free]))).faults
    assert str(fault.value).count("translation along") == str(fault.value).count("rotation about") == 3
    assert not part.free.size


def test_a_scene_travels_to_another_process(tmp_path: Path) -> None:
    scene = scene_from(write_plates(tmp_path, JOINT), *EFFECTS)
    _ = load_case(scene).g
    again = pickle.loads(pickle.dumps(scene))
    assert again.key == scene.key
    np.testing.assert_array_equal(load_case(again).f, load_case(scene).f)
