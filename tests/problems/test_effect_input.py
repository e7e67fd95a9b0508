"""What is said of bad effects: file, key, value, unit and what is allowed; contradictions by both names."""

from pathlib import Path

import pytest
from refusals import refusal_of
from small_joints import two_parts

from problems.errors import Fault
from problems.scene_files import read_scene

JOINT = two_parts(nodes=(5, 3))


def faults(folder: Path, *tables: str, joint: str = JOINT) -> list[Fault]:
    path = folder / "scene.toml"
    path.write_text("".join(f"[[effect]]\n{table}\n" for table in tables) + joint)
    return refusal_of(read_scene, str(path)).faults


@pytest.mark.parametrize(
    ("kind", "why"),
    [
        ("Friction", "assumption 4"),
        ("large_displacement", "assumption 5"),
        ("tangential", "assumption 2"),
        ("dynamics", "static"),
    ],
)
def test_what_the_model_excludes_is_refused_with_its_assumption(tmp_path: Path, kind: str, why: str) -> None:
    (fault,) = faults(tmp_path, f'kind = "{kind}"\ncoefficient = 0.2')
    assert (fault.key, fault.value) == ("effect[0].kind", kind)
    assert "the model excludes" in fault.allowed
    assert why in fault.allowed


SUPPORTS = 'kind = "supports"\npart = "a"\npoints = [[0.0, 0.0]]'
ON_NODES = "pattern = { columns = 9, rows = 1, on_nodes = true }"
ALONE = [
    ("fasteners", f"preload = 1\n{ON_NODES}", "pattern", "fewer columns"),
    ("clamps", f"clamping_force = 1\n{ON_NODES}", "pattern", "fewer columns"),
    ("shims", "thickness = -0.1\nx = [0, 9]\ny = [0, 9]", "thickness", "greater than 0; in mm"),
    ("shims", "thickness = 0.1\nx = [3, 9]\ny = [0, 9]", "x, y", "at 0, 0 mm"),
    ("shims", "thickness = 0.1\nx = [9, 3]\ny = [0, 9]", "x", "start < stop; in mm"),
    ("self_weight", 'part = "a"\ndensity = 0', "density", "greater than 0; in kg/m³"),
    ("self_weight", 'part = "c"', "part", "['a', 'b']"),
    ("thermal_bending", 'part = "a"\ndifference = nan', "difference", "finite number; in K"),
    ("thermal_bending", 'part = "a"', "difference", "required; in K"),
    ("clamps", "clamping_force = 1\npoints = [[1, 51]]", "points[0]", "0 … 50 mm"),
    ("installed_fasteners", "stiffness = 0\npoints = [[1, 1]]", "stiffness", "in N/mm"),
    ("supports", 'part = "a"\npoints = [[9, 9], [8, 8], [9, 9]]', "points[2]", "points[0] is there"),
    ("supports", 'part = "a"\npoints = [[0, 0], [9, 90]]', "points[1]", "off the clamped edges"),
    ("ribs", 'part = "a"\nlines = [20, 30, 20]\nI = 1', "lines[2]", "lines[0] is there"),
    ("installed_fasteners", 'points = [[1, 1]]\nbetween = ["a", "c"]', "between", "['a', 'b']"),
    ("initial_gap", 'mean = 1\nbetween = ["b", "a"]', "between", "['a', 'b']"),
    ("measured_gap", "points = [[0, 0, 1], [9, 9, 1], [18, 18, 1]]", "points", "off a line"),
    ("measured_gap", "points = [[0, 0, 1], [9, 9, 1]]", "points", "at least 3 items"),
    ("measured_gap", "points = [[0, 0, 1], [9, 0, 1], [9, 9, 2], [9, 0, 3]]", "points[1]", "twice"),
    ("local_thickness", 'part = "a"\nthickness = 1\nx = [0, 101]\ny = [0, 9]', "x, y", "× 0 … 90 mm"),
    ("rigid_tool", 'part = "a"\ncurvature = [0.1]', "curvature.1", "required; in 1/mm"),
    ("support_shift", 'part = "a"\npoints = [[0, 0]]\nshift = 1', "points[0]", "supports effect of part a"),
    ("fasteners", 'preload = "much"\npoints = [[1, 1]]', "preload", "number; in N"),
    ("pressure", 'part = "a"\nvalue = "1e-4"', "value", "a valid number; in N/mm²"),
    ("initial_gap", "mean = true", "mean", "a valid number; in mm"),
    ("fasteners", "preload = [5, true]\npoints = [[1, 1], [9, 9]]", "preload.1", "a valid number"),
    ("fasteners", "preload = 5\npattern = { columns = true, rows = 1 }", "pattern.columns", "a valid n"),
    (
        "fasteners",
        'preload = 5\npattern = { columns = 9, rows = 1, on_nodes = "no" }',
        "pattern.on_nodes",
        "a valid boolean",
    ),
    ("stringers", 'part = "a"\npitch = 9\nstart = 40\nstop = 20\nI = 1', "start, stop", "0 … 90 mm"),
]


@pytest.mark.parametrize(
    ("kind", "table", "key", "allowed"), ALONE, ids=[f"{kind} {key}" for kind, _, key, _ in ALONE]
)
def test_a_wrong_value_is_named_with_unit_and_range(
    tmp_path: Path, kind: str, table: str, key: str, allowed: str
) -> None:
    all_faults = faults(tmp_path, f'kind = "{kind}"\n{table}')
    found = [fault for fault in all_faults if fault.key.endswith(f").{key}")]
    assert len(found) == 1
    assert found[0].where == str(tmp_path / "scene.toml")
    assert allowed in found[0].allowed


MEASURED = "points = [[0, 0, 1], [9, 0, 1], [9, 9, 2]]"
PAD = 'kind = "local_thickness"\npart = "a"\nthickness = {}\nx = [{}, {}]\ny = [0, 50]'
SHIMS = 'kind = "shims"\nthickness = 0.2\nx = [{}, {}]\ny = [{}, {}]'
CONTRADICTIONS = {
    "one gap measured twice": [
        f'kind = "measured_gap"\n{MEASURED}',
        f'kind = "measured_gap"\n{MEASURED}\nbetween = ["a", "b"]',
    ],
    "two tools at one part": [
        'kind = "rigid_tool"\npart = "b"',
        'kind = "rigid_tool"\npart = "b"\ndistance = 1',
    ],
    "shims that touch": [SHIMS.format(0, 50, 0, 50), SHIMS.format(50, 100, 0, 50)],
    "pads that overlap": [PAD.format(3, 0, 50), PAD.format(4, 49, 80)],
    "a hole twice": [
        'kind = "installed_fasteners"\npoints = [[0, 0]]',
        'kind = "installed_fasteners"\npoints = [[50, 25], [0, 0]]',
    ],
    "a support in two tables": [SUPPORTS, SUPPORTS.replace("[[", "[[9, 9], [")],
    "ribs in two tables": [
        'kind = "ribs"\npart = "a"\nlines = [20]\nI = 1',
        'kind = "ribs"\npart = "a"\nlines = [30, 20]\nI = 2',
    ],
    "a support shifted twice": [
        'kind = "support_shift"\npart = "a"\npoints = [[0, 0]]\nshift = 1',
        'kind = "support_shift"\npart = "a"\npoints = [[0, 0]]\nshift = 2',
        SUPPORTS,
    ],
}


@pytest.mark.parametrize("case", CONTRADICTIONS)
def test_effects_that_contradict_each_other_are_both_named(tmp_path: Path, case: str) -> None:
    found = faults(tmp_path, *CONTRADICTIONS[case])
    assert [fault.key[:9] for fault in found] == ["effect[0]", "effect[1]"]


def test_everything_wrong_in_a_file_is_said_in_one_go(tmp_path: Path) -> None:
    """A table that cannot be read hides neither its part's name nor what the others contradict."""
    all_faults = faults(
        tmp_path,
        'kind = "rigid_tool"\npart = "b"',
        'kind = "rigid_tool"\npart = "b"\ndistance = 1',
        'kind = "local_thickness"\npart = "c"\nthickness = 0\nx = [0, 9]\ny = [0, 9]',
        'kind = "shims"\nthickness = 1\nx = [0, 9]\ny = [0, 9]\nbetween = ["b", "a"]',
        'kind = "friction"',
        'kind = "clamps"\nclamping_force = 1\nradius = -1',
    )
    assert [fault.key for fault in all_faults] == [
        "effect[2] (local_thickness).thickness",
        "effect[4].kind",
        "effect[5] (clamps).radius",
        "effect[0] (rigid_tool).part",
        "effect[1] (rigid_tool).part",
        "effect[2] (local_thickness).part",
        "effect[3] (shims).between",
    ]


def test_a_wrong_assembly_does_not_hide_the_effects(tmp_path: Path) -> None:
    found = faults(tmp_path, 'kind = "pressure"\npart = "a"\nvalue = nan', joint="[title]\n")
    assert [fault.key for fault in found] == ["joint", "effect[0] (pressure).value"]
    path = tmp_path / "scene.toml"
    path.write_text('assembly = "wing"\n[[effect]]\nkind = "pressure"\npart = "a"\nvalue = nan\n')
    found = refusal_of(read_scene, str(path)).faults
    assert [fault.key for fault in found] == ["assembly", "effect[0] (pressure).value"]


def test_a_preload_at_an_installed_fastener(tmp_path: Path) -> None:
    tables = [
        'kind = "fasteners"\npreload = 1\npoints = [[0, 0]]',
        'kind = "installed_fasteners"\npoints = [[0, 0]]',
    ]
    for order in (tables, tables[::-1]):
        (fault,) = faults(tmp_path, *order)
        assert "installed_fasteners" in fault.key
        assert "fasteners acts at the same ones" in fault.allowed


GAPS = 'kind = "measured_gap"\nfile = "gaps.csv"'


def test_all_that_is_wrong_with_a_file_and_its_table_is_said_at_once(tmp_path: Path) -> None:
    """Bad rows hide neither the places of the good ones, each named by its line, nor other parameters."""
    rows = ["hole,x,y", "1,10,10", "2,ten,10", "", "3,101,10", "4,10,-1", "5,90", "6,50,25"]
    (tmp_path / "holes.csv").write_text("\n".join(rows) + "\n")
    table = 'kind = "{}"\n{} = -1\nfile = "holes.csv"'
    good = 'kind = "fasteners"\npreload = 1\nbetween = ["b", "a"]\nfile = "holes.csv"'
    all_faults = faults(tmp_path, table.format("clamps", "clamping_force"), good)
    file, scene = str(tmp_path / "holes.csv"), str(tmp_path / "scene.toml")
    unreadable = [(file, "line 3", "2,ten,10"), (file, "line 7", "5,90")]
    assert [(fault.where, fault.key, fault.value) for fault in all_faults] == [
        (scene, "effect[0] (clamps).clamping_force", -1),
        *unreadable,
        *unreadable,
        (scene, "effect[1] (fasteners).between", ["b", "a"]),
        (file, "line 5", [101.0, 10.0]),
        (file, "line 6", [10.0, -1.0]),
    ]
    assert all("0 … 100 × 0 … 50 mm" in fault.allowed for fault in all_faults[-2:])


def test_a_list_beside_a_file_is_the_scene_s(tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y\n10,10\n90,10\n50,25\n")
    (fault, *_) = faults(tmp_path, 'kind = "fasteners"\npreload = [1, 1, 1, 1, -1]\nfile = "holes.csv"')
    assert (fault.where, fault.key) == (str(tmp_path / "scene.toml"), "effect[0] (fasteners).preload.4")


@pytest.mark.parametrize(
    ("rows", "keys"),
    [
        ("0,0,1\n9,9,1\n18,18,1\n", ["effect[0] (measured_gap).points"]),
        ("0,0,1\n9,9,1\n18,18,1\n9,0,x\n", ["line 5"]),  # the fourth point may be off the line
        ("0,0,1\n9,9,1\n9,0,x\n", ["line 4"]),  # the third may be there
        ("0,0,1\n9,0,1\n9,9,2\n9,0,3\n9,0,x\n", ["line 6", "line 3"]),  # twice, whatever the fifth is
    ],
)
def test_what_may_follow_from_a_bad_row_is_not_said(tmp_path: Path, rows: str, keys: list[str]) -> None:
    (tmp_path / "gaps.csv").write_text("x,y,gap\n" + rows)
    assert [fault.key for fault in faults(tmp_path, GAPS)] == keys


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (b"x;y;gaps\n0;0;1\n", "line 1"),
        (b"x,X [mm],y,gap\n0,0,0,1\n", "line 1"),
        (b"", "line 1"),
        (b"x,y,gap\n", "rows"),
        (b"x,y,gap\n\xff\xfe,1,1\n", "line 2"),
        (None, "file"),
    ],
)
def test_a_file_that_is_no_table(tmp_path: Path, content: bytes | None, key: str) -> None:
    if content is not None:
        (tmp_path / "gaps.csv").write_bytes(content)
    (fault,) = faults(tmp_path, GAPS)
    assert (fault.where, fault.key) == (str(tmp_path / "gaps.csv"), key)


def test_columns_by_other_names(tmp_path: Path) -> None:
    (tmp_path / "gaps.csv").write_text("Pos. X;Pos. Y;Spalt [mm]\n1;2;3\n4;5;6,5\n7;0;9\n")
    columns = 'columns = { x = "Pos. X", y = "pos. y", gap = "Spalt" }'
    path = tmp_path / "scene.toml"
    path.write_text(f"[[effect]]\n{GAPS}\n{columns}\n" + JOINT)
    assert read_scene(str(path)).effects[0].points == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.5), (7.0, 0.0, 9.0))
    (fault,) = faults(tmp_path, f"{GAPS}\n{columns.replace('gap =', 'z =')}")
    assert (fault.key, "x, y, gap" in fault.allowed) == ("effect[0] (measured_gap).columns", True)
    (fault,) = faults(tmp_path, f"{GAPS}\n{columns.replace('Spalt', 'Loch')}")
    assert (fault.key, "Loch" in fault.allowed) == ("line 1", True)


def test_the_key_depends_on_what_a_file_says_not_on_its_name(tmp_path: Path) -> None:
    def key(name: str, content: str) -> str:
        (tmp_path / name).write_text(content)
        path = tmp_path / "scene.toml"
        path.write_text(f'[[effect]]\nkind = "measured_gap"\nfile = "{name}"\n' + JOINT)
        return read_scene(str(path)).key

    same = "x,y,gap\n0,0,0.1\n100,0,0.2\n0,50,0.3\n"
    assert key("one.csv", same) == key("two.csv", "gap,y,x,who\n0.1,0,0,A\n0.2,0,100,B\n0.3,50.0,0,C\n")
    assert key("one.csv", same.replace("0.3", "0.31")) != key("two.csv", same)


def test_a_clamp_of_a_file_is_listed_once(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("x,y\n9,9\n9,9.005\n")
    (fault,) = faults(tmp_path, 'kind = "clamps"\nclamping_force = 1\nfile = "c.csv"')
    assert (fault.key, "separate places: " in fault.allowed) == ("line 3", True)
