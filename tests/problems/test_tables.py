"""Tables as other programs write them: the same numbers, or the line and what to write in its place."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from joints import make_joint, make_scene

from problems.errors import InputError
from problems.input.tables import read_columns
from problems.load_cases.measured_gaps import measured_gaps

COLUMNS = {name: name for name in ("x", "y", "gap")}
POINTS = [(0.0, 0.0, 0.1), (2000.0, 0.0, 0.9), (1250.0, 300.0, 0.5)]
READ = {
    "points part thousands": "x;y;gap\n0;0;0,100\n2.000;0;0,900\n1.250;300;0,500\n",
    "commas part thousands": 'x,y,gap\n0,0,.1\n"2,000",0,.9\n"1,250.0",300,.5\n',
    "blanks and apostrophes": "x;y;gap\n0;0;.1\n2 000;0;.9\n1\u202f250;300;.5\n",
    "sep": "sep=;\nx;y;gap;\n0;0;0,1;\n2000;0;0,9;\n1250;300;0,5;\n",
    "index": ",x,y,gap\n0,0,0,0.1\n1,2000,0,0.9\n2,1250,300,0.5\n",
    "comments and a preamble": "Scan 7, part: B\n\n#x,y,gap\n#\n0,0,0.1\n# more\n2000,0,0.9\n1250,300,0.5\n",
    "micrometres": "x (m);y in mm;Gap [\u00b5m]\n0;0;100\n2;0;900\n1,25;300;500\n",
    "Greek mu": "x [cm],y/mm,gap_\u03bcm\n0,0,100\n200,0,900\n125,300,500\n",
    "a row of units": "x,y,gap\nm,mm,um\n0,0,100\n2,0,900\n1.25,300,500\n",
    "missing": "x,y,gap\n0,0,0.1\n5,5,9999\n2000,0,0.9\n6,6,NaN\n1250,300,0.5\n7,7,\n8,8,-1\n",
    "minus": "x;y;gap\n0;0;.1\n2000;\u22120;.9\n1250;300;.5\n",
}
BLANKS = READ["blanks and apostrophes"].replace("1\u202f250", "1'250")


@pytest.mark.parametrize("name", READ)
def test_the_same_points(name: str, tmp_path: Path) -> None:
    text = READ[name].replace("1\u202f250", "1 250")
    (tmp_path / "t.csv").write_bytes(gzip.compress(text.encode()))
    read = read_columns(tmp_path / "t.csv", COLUMNS, missing=[9999, "nan", "", -1.0])
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
        ("x,y,gap [px]\n0,0,1\n", "line 1", "x, y, gap"),
        ("x,y,gap\n0,0,1 mm\n", "line 2", "a finite number"),
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


PART = {"north": {"length": 90.0, "elements": 2}, "clamped": ["north"]}
JOINT = make_joint(PART, PART | {"name": "b"}, nodes=(3, 3))
ROW = ",".join(["0.25"] * 9)
GAPS = {
    "counted from 0": "0,1,2,3,4,5,6,7,8\n",
    "counted from 1": "1,2,3,4,5,6,7,8,9\n",
    "nodes": "101,102,103,104,105,106,107,108,109\n",
    "names": "a,b,c,d,e,f,g,h,9 mm\n",
    "micrometres": ",".join(f"c{k} [\u00b5m]" for k in range(9)) + "\n",
}


@pytest.mark.parametrize("name", GAPS)
@pytest.mark.parametrize("index", [False, True])
@pytest.mark.parametrize("german", [False, True])
def test_a_header_is_no_case(name: str, index: bool, german: bool, tmp_path: Path) -> None:
    row = ROW.replace("0.25", "250.0") if name == "micrometres" else ROW
    lines = [GAPS[name].strip(), row, row]
    if index:
        lines = [f"{label},{line}" for label, line in zip(["", "0", "1"], lines, strict=True)]
    if german:
        lines = ["sep=;", *(line.replace(",", ";").replace(".", ",") + ";" for line in lines)]
    (tmp_path / "g.csv.gz").write_bytes(gzip.compress("\n".join(lines).encode("utf-8-sig")))
    cases = measured_gaps(make_scene(JOINT), tmp_path / "g.csv.gz")
    np.testing.assert_array_equal(cases.gaps, np.full((2, 9), 0.25))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("101,205,103,104,105,106,107,108,109\n" + ROW, "line 1 .* a header or gaps"),
        (";".join(["1.250"] * 9), "line 1 .* may be 1250"),
        (",".join(["1_0"] * 8 + ["1.5"]), "contact 0 and 7 more"),
        (",".join(f"c{k} [px]" for k in range(9)) + "\n" + ROW, "one unit of length"),
        (ROW + ",0.25", r"shape = \(1, 10\)"),
    ],
)
def test_gaps_that_may_be_something_else(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "g.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        measured_gaps(make_scene(JOINT), tmp_path / "g.csv")
