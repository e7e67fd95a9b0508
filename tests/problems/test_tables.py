"""Tables as other programs write them: the same numbers, or the line and what to write in its place."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from small_joints import PART, make_joint, make_scene

from problems.effects.fasteners import Fasteners
from problems.effects.measured_gap import MeasuredGap
from problems.errors import InputError
from problems.input.scan_points import crowded, unlike
from problems.input.tables import TableOptions, read_columns
from problems.load_cases.measured_gaps import measured_gaps
from problems.load_cases.random_gaps import random_gaps
from problems.model.effect_tables import EffectTable

COLUMNS = ("x", "y", "gap")
POINTS = [(0.0, 0.0, 0.1), (2000.0, 0.0, 0.9), (1250.0, 300.0, 0.5)]
READ = {
    "points part thousands": "x;y;gap\n0;0;0,100\n2.000;0;0,900\n1.250;300;0,500\n",
    "commas part thousands": 'x,y,gap\n0,0,.1\n"2,000",0,.9\n"1,250.0",300,.5\n',
    "blanks and apostrophes": "x;y;gap\n0;0;.1\n2 000;0;.9\n1\u202f250;300;.5\n",
    "sep": "sep=;\nx;y;gap;\n0;0;0,1;\n2000;0;0,9;\n1250;300;0,5;\n",
    "index": ",x,y,gap\n0,0,0,0.1\n1,2000,0,0.9\n2,1250,300,0.5\n",
    "comments and a preamble": "Scan 7, part: B\n\n#x,y,gap\n#\n0,0,0.1\n# more\n2000,0,0.9\n1250,300,0.5\n",
    "micrometres": "x (m);y in mm;Gap [\u00b5m]\n0;0;100\n2;0;900\n1,25;300;500\n",
    "Greek mu": "x [m],y/mm,gap_\u03bcm\n0,0,100\n2,0,900\n1.25,300,500\n",
    "a row of units": "x,y,gap\nm,mm,um\n0,0,100\n2,0,900\n1.25,300,500\n",
    "missing": "x,y,gap\n0,0,0.1\n5,5,9999\n2000,0,0.9\n6,6,NaN\n1250,300,0.5\n7,7,\n8,8,-1\n",
    "names that begin with #": "name,x,y,gap\n#1,0,0,.1\n#2,2000,0,.9\n# 3,1250,300,.5\n",
    "tabs": "X\tY\tGap\n0\t0\t0,1\n2000\t0\t0,9\n1250\t300\t0,5\n",
    "minus": "x;y;gap\n0;0;.1\n2000;\u22120;.9\n1250;300;.5\n",
}


@pytest.mark.parametrize("name", READ)
def test_the_same_points(name: str, tmp_path: Path) -> None:
    text = READ[name].replace("1\u202f250", "1 250")
    (tmp_path / "t.csv").write_bytes(gzip.compress(text.encode()))
    read = read_columns(tmp_path / "t.csv", COLUMNS, TableOptions(missing=(9999, "nan", "", -1.0)))
    assert (read.faults, read.rows) == ([], POINTS)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("x;y;gap\n0;0;1\n1.250;0;2\n", "line 3", "1.250 may be 1250; write 1250, or 1.2500"),
        ("x;y;gap\n0;0;1\n1,250;0;2\n", "line 3", "1,250 may be 1250"),
        ("x;y;gap\n0;0;0,5\n2000;0;1\n1.250;0;2\n", "line 4", "thousands written alike"),
        ("x;y;gap\n1 250;0;0,5\n1.250;0;1\n", "line 3", "thousands written alike"),
        ("x\ty\tgap\n0\t0\t0,5\n1\t1\t0.5\n", "line 3", "',' as the decimal mark"),
        ("x,y,gap\n0,0,1\n0,1,2,5\n", "line 3", "no more cells"),
        ("x,y,gap\n0,1,2,5\n0,1,2,5\n", "line 2", "no more cells"),
        ("x,y,gap,\n0,0,0,5\n1,0,0,7\n", "line 2", "none under an empty heading"),
        ("x,y,,gap\n0,0,0,5\n1,0,0,7\n", "line 2", "none under an empty heading"),
        ("x,y,gap,\n0,1200,2300,.4,\n1,1220,2300,.3,\n", "line 2", "none under an empty heading"),
        ("x,y,gap\n0,0,1\n#N/A,3,.2\n# a b\n", "line 3", "a finite number"),
        ("x,y,gap\n0,0,1\n#N/A,#N/A,#N/A\n", "line 3", "a finite number"),
        ("x,y,gap\n0,0,1\n1,0,1e36\n", "line 3", "a finite number up to 1e+15"),
        ("x,y,gap [px]\n0,0,1\n", "line 1", "x, y, gap"),
        ('x,y,gap,remark\n0,0,1,ok\n1,0,2,"\n2,0,3,"\n', "line 3", "open until line 4"),
        ('x,y,gap,remark\n0,0,1,"left\n1,0,2,\n2,0,3,', "line 2", "open until line 4"),
        ("x,y,gap\n0,0,1 mm\n", "line 2", "a finite number"),
        ("x,y,gap\n-,-,-\n0,0,1\n", "line 2", "a finite number"),  # no row of units
        *(
            (f"x,y,gap\n0,0,1\n{cell},0,2\n", "line 3", "a finite number")
            for cell in (
                "1_250",
                "1e3_0",
                "nan",
                "inf",
                "\uff11\uff12",
                "0x10",
                "1.2.3",
                "12.5 0",
                "1e999",
                "",
                "--1",
                "1 25",
            )
        ),
    ],
)
def test_refused_by_line(text: str, line: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    read = read_columns(tmp_path / "t.csv", COLUMNS)
    assert [(fault.key, words in fault.allowed) for fault in read.faults] == [(line, True)], read


JOINT = make_joint(PART, PART | {"name": "b"}, nodes=(3, 3))
ROW = ",".join(["0.25"] * 9)
GAPS = {
    "counted from 0": "0,1,2,3,4,5,6,7,8\n",
    "counted from 1": "1,2,3,4,5,6,7,8,9\n",
    "names below a title": "Inspection report 7\na,b,c,d,e,f,g,h,i\n",
    "names": "a,b,c,d,e,f,g,h,9 mm\n",
    "a comment": "# a, b\n# " + ",".join(f"c{k} [\u00b5m]" for k in range(9)) + "\n",
    "micrometres": ",".join(f"c{k} [\u00b5m]" for k in range(9)) + "\n",
}


@pytest.mark.parametrize("name", GAPS)
@pytest.mark.parametrize("index", [False, True])
@pytest.mark.parametrize("german", [False, True])
def test_a_header_is_no_case(name: str, index: bool, german: bool, tmp_path: Path) -> None:
    row = ROW.replace("0.25", "250") if "\u00b5" in GAPS[name] else ROW
    lines = [*GAPS[name].strip().split("\n"), row, row]
    if index:
        lines = [
            f"{label},{line}" for label, line in zip([*[""] * (len(lines) - 2), "0", "1"], lines, strict=True)
        ]
    if german:
        lines = ["sep=;", *(line.replace(",", ";").replace(".", ",") + ";" for line in lines)]
    (tmp_path / "g.csv.gz").write_bytes(gzip.compress("\n".join(lines).encode("utf-8-sig")))
    cases = measured_gaps(make_scene(JOINT), tmp_path / "g.csv.gz")
    np.testing.assert_array_equal(cases.gaps, np.full((2, 9), 0.25))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("101,205,103,104,105,106,107,108,109\n" + ROW, "line 1 .* a header or gaps"),
        ("Report 7\n101,102,103,104,105,106,107,108,109\n" + ROW, "line 2 .* a header or gaps"),
        ("1,2,3,4,5,6,7,8,9\n3,3,2,2,1,1,1,1,1", "line 1 .* a header or gaps"),
        ("0,1,0,2,0,3,0,4,1", "line 1 .* a header or gaps"),
        (",".join(f"{k}.0" for k in range(9)) + "\n" + ROW, "line 1 .* a header or gaps"),
        (",".join(f"c{k}" for k in (2, 1, 0, 3, 4, 5, 6, 7, 8)) + "\n" + ROW, "0 to 8 in this order"),
        (",".join(["n/a"] * 9) + f"\n{ROW}", "line 1 .* a finite number"),
        (f"a,b,c,d,e,f,g,h,i\n{','.join('-' * 9)}\n{ROW}", "line 2 .* a finite number"),
        (f"{ROW}\n#N/A{ROW[4:]}", "line 2 .* a finite number"),
        (f"{ROW}\n{','.join(['#N/A'] * 9)}", "line 2 .* a finite number"),
        (";".join(["1.250"] * 9), "line 1 .* may be 1250"),
        (",".join(["1_0"] * 8 + ["1.5"]), "line 1 .* a finite number"),
        (",".join(f"c{k} [px]" for k in range(9)) + "\n" + ROW, "one unit of length"),
        (",".join(f"p{k}_{'in' if k % 2 else 'out'}" for k in range(9)) + "\n" + ROW, "one unit of length"),
        (ROW + ",0.25", r"shape = \(1, 10\)"),
    ],
)
def test_gaps_that_may_be_something_else(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "g.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        measured_gaps(make_scene(JOINT), tmp_path / "g.csv")


def test_a_letter_among_letters_is_no_unit(tmp_path: Path) -> None:
    for names, size in (("E,F,G,H,I,J,K,L,M", 1.0), (",".join("m" * 9), 1000.0)):
        (tmp_path / "g.csv").write_text(f"{names}\n{ROW}\n")
        cases = measured_gaps(make_scene(JOINT), tmp_path / "g.csv")
        np.testing.assert_array_equal(cases.gaps, np.full((1, 9), 0.25 * size))


def test_a_title_tells_no_separator(tmp_path: Path) -> None:
    """Semicolons and decimal commas below a title of one cell."""
    lines = ["Report 7", ";".join(f"K{k}" for k in range(9)), ";".join(["0,25"] * 9)]
    (tmp_path / "g.csv").write_text("\n".join(lines))
    cases = measured_gaps(make_scene(JOINT), tmp_path / "g.csv")
    np.testing.assert_array_equal(cases.gaps, np.full((1, 9), 0.25))


def test_headings_are_as_many_as_columns_and_differ(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("Nr,X,Y,Gap,X [in]\n1,10,5,.1,9\n2,40,5,.2,9\n")
    for columns in (("Nr", "X", "Y", "Gap"), ("X", "X", "Gap"), ("X", " x ", "Gap"), ("X", "Y")):
        (fault,) = read_columns(tmp_path / "t.csv", COLUMNS, TableOptions(columns)).faults
        assert "a heading for each of x, y, gap" in fault.allowed
    assert read_columns(tmp_path / "t.csv", ("x", "y"), TableOptions(("X [in]", "Y", "Gap"))).rows == [
        (228.6, 5.0),
        (228.6, 5.0),
    ]
    (fault,) = read_columns(tmp_path / "t.csv", ("x", "y")).faults
    assert "once each" in fault.allowed


SCENE = make_scene(JOINT)
EDGES = [(50.0 * x, 30.0 * y) for y in range(5) for x in range(9)]


def measured(*points: tuple[float, float, float]) -> MeasuredGap:
    return MeasuredGap(kind="measured_gap", points=points)


@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_a_scan_changes_no_bit(seed: int) -> None:
    """Of points on circles, on a grid and at random; the first are ones whose diagonal had been arbitrary."""
    random = np.random.default_rng(seed)
    places = [[(-100, -100), (200, -100), (200, 150), (-100, 150)], EDGES, random.uniform(-50, 420, (99, 2))]
    for points in [np.column_stack([each, random.uniform(0.1, 0.9, len(each))]) for each in places]:
        gaps = {
            measured(*points[order].tolist()).gap(JOINT).tobytes()
            for order in [np.arange(len(points)), *(random.permutation(len(points)) for _ in range(5))]
        }
        assert len(gaps) == 1


def scan(values: dict[int, float]) -> list[tuple[float, float, float]]:
    return [(x, y, values.get(k, 0.3 + 0.01 * (7 * k % 5 - 2))) for k, (x, y) in enumerate(EDGES)]


@pytest.mark.parametrize("mark", [9999.0, -9999.0, 32767.0, 1e15, -1.0, -999.0, 9.99])
@pytest.mark.parametrize("where", [(4,), (0, 44), (10, 11, 12, 15)])
def test_marks_of_nothing_are_named_on_all_roads(mark: float, where: tuple[int, ...], tmp_path: Path) -> None:
    points = scan(dict.fromkeys(where, mark))
    text = "x,y,gap\n" + "".join(f"{x},{y},{gap!r}\n" for x, y, gap in points)
    (tmp_path / "scan.csv").write_text(text)
    table = EffectTable(tmp_path / "scene.toml", 0, {"kind": "measured_gap", "file": "scan.csv"})
    assert list(table.read()) == []
    around = random_gaps(
        SCENE, 1, 0, sd=0.1, correlation_length=90.0, around=str(tmp_path / "scan.csv")
    ).notes
    joint = make_joint(PART, PART | {"name": "b"}, nodes=(9, 5))
    np.savetxt(tmp_path / "gaps.csv", [[gap for *_, gap in points]], delimiter=",")
    effect = make_scene(JOINT, table.effect).unusual
    for k in where:
        assert [f"line {k + 2}" in " ".join(said) for said in (effect, around)] == [True, True]
    assert sum(", line " in said for said in effect) == len(where)
    said = measured_gaps(make_scene(joint), tmp_path / "gaps.csv").notes
    assert [f"contact {k} = {mark:g}" in line for k, line in zip(where, said, strict=True)] == [True] * len(
        where
    )


@pytest.mark.parametrize("kind", ["rough", "step", "bump", "plane", "constant"])
def test_a_measured_gap_is_named_as_nothing_rarely(kind: str) -> None:
    random, alarms = np.random.default_rng(3), 0
    for _ in range(3):
        x, y = random.uniform([[0], [0]], [[2000], [600]], (2, 5000))
        gap = {
            "rough": random.normal(0.3, 0.2, 5000),
            "step": np.where(x > 900, 0.9, 0.1) + random.normal(0, 0.01, 5000),
            "bump": 0.1 + 2 * np.exp(-((x - 900) ** 2 + (y - 300) ** 2) / 2e4),
            "plane": 0.001 * x + 0.002 * y,
            "constant": np.full(5000, 0.3),
        }[kind]
        alarms += len(list(unlike(np.column_stack([x, y, gap]))))
    assert alarms <= 2


@pytest.mark.parametrize("near", [0.0, 1e-3])
def test_two_gaps_or_fasteners_at_one_place_are_refused(near: float, tmp_path: Path) -> None:
    points = ((0.0, 0.0, 0.1), (100.0, 50.0, 0.3), (near, 0.0, 0.7), (400.0, 0.0, 0.1))
    (key, *_), *rest = measured(*points).faults(JOINT)
    assert (key, rest) == ("points[0]", [])
    (tmp_path / "scan.csv").write_text("x,y,gap\n" + "".join(f"{x},{y},{gap}\n" for x, y, gap in points))
    with pytest.raises(InputError, match=r"line 4 .* one gap per point, see line 2"):
        random_gaps(SCENE, 1, 0, sd=0.1, correlation_length=90.0, around=str(tmp_path / "scan.csv"))
    holes = {"kind": "fasteners", "preload": 1.0, "points": ((9.0, 9.0), (9.0, 9.0 + near), (50.0, 50.0))}
    assert [key for key, *_ in Fasteners(**holes).faults(JOINT)] == ["points[1]"]
    one, other = (Fasteners(**holes | {"points": ((9.0, y),)}) for y in (9.0, 9.0 + near))
    assert [key for key, *_ in one.faults(JOINT, [other])] == ["points"]


def test_contacts_beyond_a_scan_are_counted() -> None:
    """A scan of the western half; one in metres; one that is elsewhere."""
    half = [(x / 2, y, gap) for x, y, gap in scan({})]
    (said,) = make_scene(JOINT, measured(*half)).unusual
    assert "3 of 9, up to 200 mm away" in said
    (metres,) = make_scene(JOINT, measured(*((x / 1e3, y / 1e3, gap) for x, y, gap in half))).unusual
    assert "8 of 9, " in metres
    assert "in metres?" in metres
    (away,) = make_scene(JOINT, measured(*((x + 12000, y, gap) for x, y, gap in half))).unusual
    assert "9 of 9, up to 1.2e+04 mm away" in away


def test_missing_marks_and_headings_hold_for_a_scan_and_for_gaps(tmp_path: Path) -> None:
    """A scan without two of its points; a missing gap is that of the nearest contact."""
    options = TableOptions(("Pos X", "Pos Y", "Spalt"), ("9999", "n/a"))
    (tmp_path / "scan.csv").write_text("Pos X,Pos Y,Spalt\n0,0,.1\n9,9,9999\n200,60,.5\n9,9,n/a\n")
    law = {"sd": 0.1, "correlation_length": 90.0, "around": tmp_path / "scan.csv"}
    assert random_gaps(SCENE, 1, 0, **law, options=options).points.tolist() == [[0, 0, 0.1], [200, 60, 0.5]]
    with pytest.raises(InputError, match="--columns: headings = 'X, Y': a heading for each of x, y, gap"):
        random_gaps(SCENE, 1, 0, **law, options=TableOptions(("X", "Y")))
    row = [f"0.{k}" for k in range(1, 10)]
    for mark in options.missing:
        (tmp_path / "g.csv").write_text(",".join([*row[:8], mark]) + "\n")
        cases = measured_gaps(SCENE, tmp_path / "g.csv", options=options)
        assert cases.gaps.tolist() == [[*map(float, row[:8]), 0.6]]
        assert "1 missing gaps" in cases.notes[0]


def test_a_mark_is_a_mark_in_the_unit_of_its_file(tmp_path: Path) -> None:
    """-1000 µm are -1 mm, and no -1."""
    header = ",".join(f"c{k} [\u00b5m]" for k in range(9))
    (tmp_path / "g.csv").write_text(f"{header}\n{','.join(['250'] * 8)},-1000\n")
    cases = measured_gaps(SCENE, tmp_path / "g.csv", options=TableOptions(missing=(-1.0,)))
    assert cases.gaps.tolist() == [[0.25] * 8 + [-1.0]]


def test_a_mark_is_a_mark_in_single_precision(tmp_path: Path) -> None:
    np.save(tmp_path / "g.npy", np.array([[0.25] * 8 + [1e20]], dtype=np.float32))
    cases = measured_gaps(SCENE, tmp_path / "g.npy", options=TableOptions(missing=(1e20,)))
    assert cases.gaps.tolist() == [[0.25] * 9]


def test_lines_above_a_table_are_skipped(tmp_path: Path) -> None:
    (tmp_path / "scan.csv").write_text("x,y,gap\nnot these\nx,y,gap\n0,0,1\n9,0,1\n0,9,9999\n0,9,1\n")
    table = {"kind": "measured_gap", "file": "scan.csv", "skip_lines": 2, "missing": [9999]}
    read = EffectTable(tmp_path / "scene.toml", 0, table)
    assert (list(read.read()), len(read.effect.points)) == ([], 3)
    for key, wrong in (("skip_lines", -1), ("missing", 9999)):
        (fault,) = EffectTable(tmp_path / "scene.toml", 0, table | {key: wrong}).read()
        assert fault.key == f"effect[0] (measured_gap).{key}"


def test_thousands_of_equal_points_are_one_fault() -> None:
    """A scanner that saw nothing: all pairs of them would not fit into memory."""
    points = np.vstack([np.zeros((20_000, 2)), [[5.0, 5.0], [5.0, 5.009], [7.0, 7.0], [7.0, 7.02]]])
    assert crowded(points) == [(0, 1), (20_000, 20_001)]
