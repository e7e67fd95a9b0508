"""Scene files: what a key depends on, and what is said of bad input."""

import re
from pathlib import Path

import pytest
from refusals import refusal_of
from strip_scene import STRIP, strip_with

from problems.errors import Fault, InputError
from problems.scene_files import ASSEMBLIES, read_scene

SCENE = f'title = "a strip"\n{STRIP}'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scene.toml"


def faults(path: Path, text: str | bytes) -> list[Fault]:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    error = refusal_of(read_scene, str(path))
    assert len(str(error).splitlines()) == len(error.faults)
    return error.faults


def swapped(*pairs: tuple[str, str]) -> str:
    return strip_with(*pairs, text=SCENE)


# --- keys ---------------------------------------------------------------------------------------------


def key_of(path: Path, text: str) -> tuple[str, str]:
    path.write_text(text)
    scene = read_scene(str(path))
    return scene.key, scene.assembly_key


def test_key_does_not_depend_on_how_the_file_is_written(path: Path) -> None:
    other = swapped(
        ('title = "a strip"', "# a comment\n"),
        ("thickness = 3.0", "thickness=3  # mm"),
        ("I = 2e3", "\n\nJ = 0\nI = 2000.0"),
        (
            'north = { length = 90.0, elements = 2 }\nclamped = ["north"]',
            'clamped = ["north"]\nnorth = { elements = 2, length = 90 }',
        ),
    )
    assert key_of(path, SCENE) == key_of(path.with_name("b.toml"), other)


LOADS = [
    ("mean = 0.4", "mean = 0.40001"),
    ("seed = 7", "seed = 8"),
    ("[50.0, 30.0]", "[50.0, 31.0]"),
]
STRUCTURE = [
    ("nodes = [9, 5]", "nodes = [9, 6]"),
    ("elements = 2", "elements = 3"),
    ("lines = [60.0]", "lines = [61.0]"),
    ("thickness = 3.0", "thickness = 3.0\npoisson = 0.3"),
]


@pytest.mark.parametrize("change", [*LOADS, *STRUCTURE], ids=str)
def test_a_load_changes_the_key_of_the_scene_alone_the_structure_both(
    path: Path, change: tuple[str, str]
) -> None:
    (key, assembly_key), (other, other_assembly) = key_of(path, SCENE), key_of(path, swapped(change))
    assert key != other
    assert (assembly_key == other_assembly) is (change in LOADS)


def test_the_files_that_an_assembly_names_are_those_of_the_scene(path: Path) -> None:
    """No output may replace them."""
    folder = path.parent / "parts"
    folder.mkdir()
    (folder / "holes.csv").write_text("x,y\n10,20\n90,30\n")
    joint = SCENE.partition("[joint]\n")[2].partition("[[effect]]")[0].replace("joint.part", "part")
    fasteners = '[[effect]]\nkind = "fasteners"\npreload = 1000.0\nfile = "holes.csv"\n'
    (folder / "joint.toml").write_text(joint + fasteners)
    path.write_text('assembly = "parts/joint.toml"\n')
    assert read_scene(str(path)).sources == (path, folder / "joint.toml", folder / "holes.csv")


# --- bad input ----------------------------------------------------------------------------------------

BAD = [
    (("thickness = 3.0", "thickness = -3.0"), "part.0.thickness", -3.0, "greater than 0"),
    (("thickness = 3.0", "thikness = 3.0\nthickness = 3.0"), "part.0.thikness", 3.0, "mean thickness?"),
    (("thickness = 3.0", ""), "part.0.thickness", None, "required"),
    (("thickness = 3.0", "thickness = 3.0\npoisson = 0.5"), "part.0.poisson", 0.5, "less than 0.5"),
    (("mean = 0.4", 'mean = "wide"'), "effect[0] (initial_gap).mean", "wide", "number"),
    (("mean = 0.4", "mean = 0.4\nmedian = 3"), "effect[0] (initial_gap).median", 3, "did you mean mean?"),
    (("sd = 0.2", "sd = -0.1"), "effect[0] (initial_gap).random.sd", -0.1, "greater than 0"),
    (('kind = "ribs"', 'kind = "rbis"'), "effect[3].kind", "rbis", "ribs"),
    (("[200.0, 0.0]", "[400.1, 30.0]"), "effect[1] (fasteners).points[1]", [400.1, 30.0], "0 … 400"),
    (("lines = [60.0]", "lines = [210.5]"), "effect[3] (ribs).lines[0]", 210.5, "0 … 210"),
    (('part = "a"\nlines', 'part = "c"\nlines'), "effect[3] (ribs).part", "c", "['a']"),
    (("I = 2e3", "I = 2e3\nJ = inf"), "effect[3] (ribs).J", float("inf"), "finite"),
    (('[["a", "tool"]]', "[]"), "contacts", [], "at least 1 item"),
    (('[["a", "tool"]]', '[["a", "b"]]'), "contacts", ["a", "b"], "two different parts"),
    (('contacts = [["a", "tool"]]\n', ""), "effect[0] (initial_gap).between", None, "needs a contact"),
    (('[["a", "tool"]]', '[["a", "tool"], ["a", "tool"]]'), "contacts", None, "no pair twice"),
    (
        ('clamped = ["north"]', 'clamped = ["south", "north"]'),
        "part.a.clamped",
        "south",
        "extension to the south",
    ),
    (('clamped = ["north"]', ""), "part.a", "no support", "clamped edge"),
    (('title = "a strip"', 'titel = "a strip"'), "titel", "a strip", "no such key"),
    (('title = "a strip"', "output = { stres = true }"), "output.stres", True, "did you mean stress?"),
    (
        ('title = "a strip"', 'assembly = "wing-fragment-4387"'),
        "assembly",
        "wing-fragment-4387",
        "wing-fragment-4386",
    ),
    (('title = "a strip"', 'assembly = "wing-fragment-4386"'), "joint", None, "either joint or assembly"),
]


@pytest.mark.parametrize(("change", "key", "value", "allowed"), BAD, ids=[case[1] for case in BAD])
def test_one_fault_names_file_key_value_and_what_is_allowed(
    path: Path, change: tuple[str, str], key: str, value: object, allowed: str
) -> None:
    named = [fault for fault in faults(path, swapped(change)) if fault.key == key]
    assert len(named) == 1
    assert named[0].where == str(path)
    assert allowed.lower() in named[0].allowed.lower()
    if value is not None:
        assert named[0].value == value
    assert str(path) in str(named[0])
    assert key in str(named[0])


@pytest.mark.parametrize(
    "points", ["[[10.0, 10.0]]", "[[10.0, 10.0], [80.0, 20.0]]", "[[10.0, 10.0], [30.0, 20.0], [70.0, 40.0]]"]
)
def test_supports_on_a_line_let_a_part_float(path: Path, points: str) -> None:
    supports = f'\n[[effect]]\nkind = "supports"\npart = "a"\npoints = {points}\n'
    (fault,) = faults(path, swapped(('clamped = ["north"]', "")) + supports)
    assert fault.key == "part.a"
    assert "off a line" in fault.allowed


def test_a_closed_chain_of_contacts(path: Path) -> None:
    parts = SCENE[SCENE.index("[[joint.part]]") : SCENE.index("[[effect]]")].replace('"a"', '"b"')
    text = swapped(
        ('[["a", "tool"]]', '[["a", "tool"], ["b", "tool"], ["a", "b"]]'),
        ('[[effect]]\nkind = "ini', parts + '[[effect]]\nkind = "ini'),
    )
    (fault,) = faults(path, text)
    assert fault.key == "contacts"
    assert "closed chain" in fault.allowed


def test_a_fault_in_the_assembly_names_the_assembly_file(path: Path) -> None:
    text = (
        (ASSEMBLIES / "wing-fragment-4386.toml").read_text().replace("thickness = 6.0 ", "thickness = 0 ", 1)
    )
    (path.parent / "mine.toml").write_text(text)
    (fault,) = faults(path, 'assembly = "mine.toml"')
    assert fault.where == str(path.parent / "mine.toml")
    assert fault.key == "part.0.thickness"


@pytest.mark.parametrize(
    ("content", "key", "said"),
    [
        ("a = = 3", "TOML", "valid TOML"),
        ('title = "a"'.encode("utf-16"), "file", "UTF-16 text"),
        ('title = "a"'.encode("utf-16-be"), "file", "UTF-16 text"),
        ('title = "a"'.encode("utf-32"), "file", "UTF-32 text"),
        (b'title = "a"\r\nx = "\xb5m"', "line 2", "xb5, not UTF-8"),
        ('assembly = "wing-fragment-4386"\neffect = { kind = "pressure" }', "effect", "tables [[effect]]"),
        ('assembly = "wing-fragment-4386"\neffect = ["initial_gap"]', "effect", "tables [[effect]]"),
        ("matrices = 3", "matrices", "a table [matrices]"),
        ('[matrices]\nK = "scene.toml"', "matrices", "K, A, f and g, or problem alone"),
        ('[matrices]\nproblem = "scene.toml"\nK = "scene.toml"', "matrices", "or problem alone"),
    ],
)
def test_a_file_that_is_no_scene_has_one_fault(path: Path, content: str | bytes, key: str, said: str) -> None:
    (fault,) = faults(path, content)
    assert (fault.where, fault.key) == (str(path), key)
    assert said in str(fault)


@pytest.mark.parametrize(
    "text",
    [
        '[matrices]\nproblem = "parts\\top.npz"',
        '[[joint.part]]\nname = "a"\nsuperelement = "parts\\top.npz"\nnodes = "n.csv"',
        'assembly = "parts\\new.toml"',
        'assembly = "C:\\dir\\new.toml"',
    ],
)
def test_a_backslash_in_a_path_is_named_as_the_cause(path: Path, text: str) -> None:
    said = "\n".join(map(str, faults(path, text)))
    assert "a backslash in TOML's double quotes begins an escape" in said
    assert "\t" not in said


def test_matrices_with_an_unknown_key_and_a_missing_file(path: Path) -> None:
    found = faults(path, '[matrices]\nproblem = "none.npz"\nQ = "q.mtx"\n[joint]\n')
    assert {fault.key for fault in found} == {"joint", "matrices.problem", "matrices.Q"}


def test_unknown_names_and_missing_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=re.escape("4386/0107")):
        read_scene("4386/0108")
    for name in ("none.toml", "none.npz"):
        with pytest.raises(InputError, match=name):
            read_scene(str(tmp_path / name))
