"""What is said of wrong files of superelements: one message each, with ids, places and distances."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refusal_of
from superelements import Array, Tables, flat, scene_from, solved, with_bay, write_nodes, write_part

from harness.scene.validate import digits_of
from problems.build import prepared
from problems.errors import Fault, InputError
from problems.load_cases.measured_gaps import measured_gaps
from problems.load_cases.random_gaps import random_gaps

X, Y = (each.ravel() for each in np.meshgrid(np.linspace(0, 100, 6), np.linspace(0, 50, 4)))
NODES = flat(np.column_stack([X, Y]))
HELD = np.diag(np.linspace(40.0, 50.0, 24))
UP = np.tile([0.0, 0.0, 1.0], (24, 1))


def floating(nodes: Array = NODES) -> Array:
    """Stiff against everything but a + bx + cy."""
    Q, _ = np.linalg.qr(np.column_stack([np.ones(len(nodes)), nodes[:, :2]]))
    return 100 * (np.eye(len(nodes)) - Q @ Q.T)


def two(
    folder: Path, K: Array = HELD, xyz: Array = NODES, normals: Array | None = None, **more: Any
) -> list[Tables]:
    """Part b with these files above a good a."""
    good = write_part(folder, "a", HELD, NODES)
    return [good, write_part(folder, "b", K, xyz, normals, **more)]


def changed(array: Array, where: Any, value: Any) -> Array:
    """A copy with another entry, or row."""
    other = array.copy()
    other[where] = value
    return other


ASYMMETRIC, INFINITE = changed(HELD, (0, 1), 3.0), changed(HELD, (3, 3), np.inf)
BEYOND, DOUBLED = changed(NODES, (3, 0), 2.0**63), changed(NODES, 1, NODES[0] + 1e-7)
SHORT = changed(UP, 4, [0, 0, 0.9])


def missing(folder: Path) -> list[Tables]:
    parts = two(folder)
    Path(parts[1]["superelement"]).unlink()
    return parts


FILES: dict[str, tuple[Callable[[Path], list[Tables]], str, str, str]] = {
    "lost nodes": (lambda folder: [*two(folder)[:1], _shorter(folder)], "rows of K", "24", "20 nodes of"),
    "an id twice": (lambda f: two(f, id=[1, 2, 3, 3, *range(5, 25)]), "id", "3", "each id once"),
    "an id that is no number": (lambda f: two(f, id=[1.5, *range(2, 25)]), "id", "1.5", "whole numbers"),
    "another planet": (lambda f: two(f, xyz=BEYOND), "line 5", "4,9.22", "up to 1e+15"),
    "two nodes at one place": (lambda f: two(f, xyz=DOUBLED), "x, y, z", "1 and 2", "one node at each"),
    "asymmetric": (lambda f: two(f, ASYMMETRIC), "K[0, 1] and K[1, 0]", "[3.0, 0.0]", "1e-10"),
    "not finite": (lambda f: two(f, INFINITE), "K", "NaN or infinity", "finite"),
    "a number for a matrix": (lambda f: two(f, np.array(5.0)), "K", "shape (1,)", "must be matrices"),
    "a normal too short": (lambda f: two(f, normals=SHORT), "nx, ny, nz", "5", "length 1"),
    "contact of neither": (lambda f: two(f, contact=[2, *[1] * 23]), "contact", "ids 1", "0 or 1"),
    "no surface": (lambda f: two(f, contact=[1, 1, *[0] * 22]), "contact", "2", "at least three"),
    "no file": (missing, "superelement", "No such file", "readable"),
    "normal not kept": (
        lambda f: two(f, normals=changed(UP, 4, [0, 0.6, 0.8])), "nodes", "ids 5", "along the normal",
    ),
    "a dof twice": (lambda f: two(f, dofs=[3, 3]), "part.1.dofs", "[3, 3]", "each once"),
    "dofs against labels": (
        lambda f: two(f, format="abaqus", id=range(1, 25), dofs=[1]), "dofs", "[1]", "are dofs [3]",
    ),
    "unknown dof": (lambda f: two(f, dofs=[7]), "part.1.dofs.0", "7", "less than or equal to 6"),
}  # fmt: skip


def _shorter(folder: Path) -> Tables:
    part = write_part(folder, "b", HELD, NODES)
    write_nodes(folder / "b.csv", NODES[:20])
    return part


@pytest.mark.parametrize("case", FILES)
def test_a_wrong_file_has_one_clear_message(case: str, tmp_path: Path) -> None:
    write, key, value, allowed = FILES[case]
    (fault,) = refused(write(tmp_path))
    assert key in fault.key
    assert value in str(fault.value)
    assert allowed in fault.allowed
    assert "b." in fault.where or "dof" in case


def test_what_is_not_read_of_a_part_is_noted(tmp_path: Path) -> None:
    parts = two(tmp_path)
    names = {"labels": np.arange(24), "titles": np.array(["a"] * 24)}
    np.savez(tmp_path / "b.npz", K=HELD, version=7, **names)
    made = prepared(scene_from(parts))
    assert made.assembly.notes == ("b: Not read of b.npz: labels, titles",)


def refused(parts: list[Tables], *effects: Tables, **joint: Any) -> list[Fault]:
    return refusal_of(lambda: prepared(scene_from(parts, *effects, **joint))).faults


def test_all_files_are_checked_at_once(tmp_path: Path) -> None:
    parts = two(tmp_path, ASYMMETRIC, id=[1, 1, *range(3, 25)])
    first = write_part(tmp_path, "a", INFINITE, NODES)
    assert len(refused([first, parts[1]])) == 3


PAIRS: dict[str, tuple[Callable[[Path], list[Tables]], str, str]] = {
    "reversed normals": (lambda f: two(f, normals=-UP), "24 nodes, ids 1, 2", "point the same way"),
    "one reversed": (lambda f: two(f, normals=changed(UP, 6, [0, 0, -1])), "1 nodes, ids 7", "reversed?"),
    "two faces": (
        lambda f: two(f, xyz=changed(NODES, 1, NODES[0] + [0, 0, 3])),
        "ids 1 and 2",
        "contact = 0",
    ),
    "too far": (lambda f: two(f, xyz=NODES + np.array([0, 0, 7.5])), "24 too far: 1 (7.5 mm), 2", "5 mm"),
    "beside": (lambda f: two(f, xyz=NODES + np.array([900.0, 0, 0])), "24 are beyond its surface", "pairing"),
    "on a line": (
        lambda f: two(f, xyz=NODES * [1, 0, 1] + np.arange(24)[:, None] * [1, 0, 0]),
        "one line",
        "off a",
    ),
}


@pytest.mark.parametrize("case", PAIRS)
def test_parts_that_do_not_meet_are_told_by_ids_and_distances(case: str, tmp_path: Path) -> None:
    write, value, allowed = PAIRS[case]
    (fault,) = refused(write(tmp_path))
    assert value in str(fault.value)
    assert allowed in fault.allowed


def test_nodes_beyond_the_other_part_and_too_far_from_it_are_no_contacts(tmp_path: Path) -> None:
    xyz = NODES * [0.6, 1, 1]  # up to x = 60: a has nodes at 80 and 100
    xyz[:, 2] = np.where(Y > 40, 9.0, 1.0)
    scene = scene_from(two(tmp_path, xyz=xyz))
    found = scene.joint.pairings["a", "b"]
    assert found.beyond == 8
    assert set(found.nodes) == set(np.flatnonzero((X <= 60) & (Y < 40)))
    (said,) = scene.unusual
    assert "farther apart than 5 mm = 4" in said
    assert "19 (9 mm)" in said


def test_nodes_over_a_strip_that_may_be_a_bay_are_told(tmp_path: Path) -> None:
    xyz = changed(NODES, (slice(None), 0), np.tile([0, 5, 10, 90, 95, 100], 4))
    (said,) = scene_from(two(tmp_path, xyz=xyz)).unusual
    assert "nodes over a bay or a hole of b = 16" in said


def test_nodes_on_a_common_border_stay_contacts_where_places_are_rounded(tmp_path: Path) -> None:
    parts = []
    for name, *count in (("a", 6, 4), ("b", 8, 3)):
        x, y = np.meshgrid(*map(np.linspace, (0, 0), (100, 50), count))
        turned = (x + 1j * y).ravel() * np.exp(0.5j)
        xyz = flat(np.column_stack([turned.real, turned.imag]).round(4))
        parts.append(write_part(tmp_path, name, HELD, xyz))
    assert scene_from(parts).joint.size[1] == 24


def test_normals_along_minus_z_turn_y_of_points_around_and_that_is_told(tmp_path: Path) -> None:
    (said,) = scene_from([write_part(tmp_path, name, HELD, NODES, -UP) for name in "ab"]).unusual
    assert said.startswith("joint.y of points = -y of nodes, as normals of a are along -z")


def test_springs_between_parts_do_not_hide_the_few_digits_of_k(tmp_path: Path) -> None:
    scene = scene_from(two(tmp_path, HELD.round(4)), {"kind": "installed_fasteners", "points": [[50, 20]]})
    assert digits_of(scene, prepared(scene).assembly) == 6


def test_a_node_far_from_all_others_is_told(tmp_path: Path) -> None:
    (said,) = scene_from(two(tmp_path, xyz=changed(NODES, 5, 9999.0))).unusual
    assert "part.b, nodes far from all others = 1" in said
    assert said.endswith("Ids 6")


def test_columns_of_gaps_named_by_nodes_are_in_the_order_of_the_contacts(tmp_path: Path) -> None:
    parts = [write_part(tmp_path, name, HELD, NODES, id=np.arange(len(NODES)) + 101) for name in "ab"]
    scene = scene_from(parts)
    ids = scene.joint.ids[1].tolist()
    row = ",".join(f"0.{k}" for k in ids)
    (tmp_path / "g.csv").write_text(",".join(f"n{k}" for k in ids) + f"\n{row}\n")
    assert measured_gaps(scene, tmp_path / "g.csv").gaps.tolist() == [[float(f"0.{k}") for k in ids]]
    (tmp_path / "g.csv").write_text(",".join(f"n{k}" for k in reversed(ids)) + f"\n{row}\n")
    with pytest.raises(InputError, match=f"contacts {ids[0]} to {ids[-1]} in this order"):
        measured_gaps(scene, tmp_path / "g.csv")


def test_feet_that_change_places(tmp_path: Path) -> None:
    """Normals that meet before they reach the other part."""
    normals = UP.copy()
    normals[:, 0] = -(X - 50) / 100
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    a = write_part(tmp_path, "a", np.kron(HELD, np.eye(3)), NODES, normals, dofs=[1, 2, 3])
    wide = write_part(tmp_path, "b", HELD, NODES * [3, 1, 1] + np.array([-100, 0, 200]))
    (fault,) = refused([a, wide], pairing={"distance": 400})
    assert "neighbours" in fault.allowed
    assert "ids 1 and 2 and 8" in str(fault.value)


def test_a_fastener_off_a_part_and_one_in_its_bay(tmp_path: Path) -> None:
    parts = with_bay(tmp_path)
    points = [[10.0, 90.0], [50.0, 10.0], [50.0, 60.0], [101.0, 50.0]]
    faults = refused(parts, {"kind": "fasteners", "preload": 1.0, "points": points})
    assert [(fault.key, fault.value) for fault in faults] == [
        (f"effect[0] (fasteners).points[{k}]", points[k]) for k in (2, 3)
    ]
    assert "not in a bay" in faults[0].allowed
    joint = scene_from(parts).joint
    assert joint.areas("a").sum() == pytest.approx(100 * 20 + 2 * 20 * 80, rel=0.06)  # corners are rounded
    assert joint.deflection("a", np.array(points[:2]), "b").sum() == pytest.approx(2)
    for place in points[2:]:  # a row of zeros, along a normal that is no number
        with pytest.raises(InputError, match=f"point = \\{place}: on the parts"):
            joint.deflection("a", np.array([points[0], place]), "b")


@pytest.mark.parametrize(
    ("points", "motions"),
    [
        ([], "translation along z, rotation about x, rotation about y"),
        ([[0, 0], [100, 0]], "rotation about x"),
        ([[20, 10], [60, 30], [100, 50]], "rotation about"),
    ],
)
def test_a_part_that_nothing_holds_is_refused_with_its_motions(
    points: list[list[float]], motions: str, tmp_path: Path
) -> None:
    installed = {"kind": "installed_fasteners", "points": points}
    (fault,) = refused(two(tmp_path, floating()), *([installed] if points else []))
    assert fault.key == "part.b"
    assert str(fault.value).startswith(motions)
    assert "hold the part" in fault.allowed


def test_a_free_part_is_held_by_three_fasteners(tmp_path: Path) -> None:
    installed = {"kind": "installed_fasteners", "points": [[0, 0], [100, 0], [0, 50]], "stiffness": 100.0}
    load = {"kind": "pressure", "part": "b", "value": 1e-3}
    scene = scene_from(two(tmp_path, floating()), {"kind": "initial_gap", "mean": 0.2}, installed, load)
    x = solved(scene).x
    assert x[:24] @ np.diag(HELD) == pytest.approx(1e-3 * 100 * 50)  # a bears it all


def test_two_floating_parts_are_not_held_by_each_other(tmp_path: Path) -> None:
    parts = [write_part(tmp_path, name, floating(), NODES) for name in "ab"]
    installed = {"kind": "installed_fasteners", "points": [[0, 0], [100, 0], [0, 50]]}
    faults = refused(parts, installed)
    assert [fault.key for fault in faults] == ["part.a", "part.b"]


def test_what_acts_on_elements_is_refused_by_name(tmp_path: Path) -> None:
    (fault,) = refused(two(tmp_path), {"kind": "self_weight", "part": "a"})
    assert fault.key == "effect[0] (self_weight).part"
    assert "no elements for self_weight" in fault.allowed


def test_a_field_too_fine_for_the_grid_and_contacts_of_unknown_parts(tmp_path: Path) -> None:
    random = {"sd": 0.1, "correlation_length": 0.1, "seed": 1}
    (fault,) = refused(two(tmp_path), {"kind": "initial_gap", "mean": 0.1, "random": random})
    assert "at least 0.6 mm" in fault.allowed
    (fault,) = refused(two(tmp_path), contacts=[["a", "c"]])
    assert fault.key == "contacts"


def test_a_series_of_fields_too_fine_for_the_grid_is_refused(tmp_path: Path) -> None:
    """As of a length in metres: the matrices of its grid would take all memory."""
    with pytest.raises(InputError, match=r"initial_gap\.random\.correlation_length = 0\.1: at least 0\.6 mm"):
        random_gaps(scene_from(two(tmp_path)), 1, 0, mean=0.1, sd=0.1, correlation_length=0.1)
