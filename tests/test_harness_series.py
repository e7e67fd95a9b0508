"""A suite of series: the cases of a scene in one process, a row each."""

from __future__ import annotations

import json
import re
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny
from rich.console import Console
from small import solve_by_nnls
from strip import write_strip

from harness import records
from harness.gate import gate
from harness.plan import expand
from harness.run import batches, run
from harness.suite import read_suite, to_toml, validated
from problems.prepare import prepared
from problems.random_gaps import random_gaps
from problems.scene import read_scene

SUITE = """
scenes = ["strip.toml"]
threads = [1]
time_limit_s = 20
plugin = "faulty.py"
[series]
cases = 4
seed = 9
[[solver]]
name = "newton"
forms = ["dual"]
tolerances = [1e-11]
[[solver]]
name = "piqp"
forms = ["primal"]
tolerances = [1e-11]
"""
LEAVES = SUITE.replace(
    'name = "piqp"\nforms = ["primal"]', 'name = "faulty"\noptions = { fault = "third_leaves" }'
)
THIRD = """
    seen = 0

    def third_leaves(self, lam):
        self.seen += 1
        if self.seen == 3:
            os._exit(7)
        return Answer("solved", lam)
"""


@pytest.fixture(scope="module", autouse=True)
def _here(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("series")
    write_strip(folder)
    (folder / "faulty.py").write_text(tiny.FAULTY + THIRD)
    (folder / "two.toml").write_text(SUITE)
    (folder / "leaves.toml").write_text(LEAVES)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield


def made(suite: str, out: str) -> tuple[str, list[dict[str, Any]]]:
    console = Console(file=StringIO(), width=200)
    run(read_suite(suite), Path(out), console)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    return text, records.read(Path(out) / records.MEASUREMENTS)


def test_each_case_has_a_row_and_an_answer_of_its_own() -> None:
    _, rows = made("two.toml", "two")
    assert [(row["solver"], row["case"]) for row in rows] == [
        (solver, k) for solver in ("newton", "piqp") for k in range(4)
    ]
    assert {(row["status"], row["verdict"]) for row in rows} == {("solved", "within")}
    scene = read_scene("strip.toml")
    data = prepared(scene)
    cases = random_gaps(scene, data, 4, 9)
    for row in rows:
        case = cases.load(row["case"], data)
        x, lam = solve_by_nnls(data, case)
        with np.load(Path("two") / row["answer"]) as saved:
            np.testing.assert_allclose(saved["x"], x, atol=1e-8)
        assert row["active"] == (lam > 0).sum()
        assert row["setup_s"] is not None
    assert len({row["answer"] for row in rows}) == 8
    # once an assembly, so the same in each row of a process
    assert len({row["prepare_s"] for row in rows if row["solver"] == "newton"}) == 1
    code = gate(Path("two"), Console(file=StringIO()))
    assert code == 0


def test_a_case_that_is_missing_is_measured_alone() -> None:
    made("two.toml", "gap")
    path = Path("gap") / records.MEASUREMENTS
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:2] + lines[3:]))
    text, rows = made("two.toml", "gap")
    assert "8 measurements, 7 of them already" in text
    assert sorted(row["key"] for row in rows) == sorted(json.loads(line)["key"] for line in lines)
    assert rows[-1]["case"] == 2
    assert rows[-1]["verdict"] == "within"


def test_a_spoilt_answer_of_a_case_is_seen_by_the_gate() -> None:
    _, rows = made("two.toml", "spoilt")
    for k in (0, 1):  # the answer of another case
        with np.load(Path("spoilt") / rows[k]["answer"]) as saved:
            np.savez(Path("spoilt") / rows[1 - k + 2]["answer"], **dict(saved))
    assert gate(Path("spoilt"), Console(file=StringIO())) == 1


def test_a_case_that_ends_the_process_leaves_those_before_it() -> None:
    _, rows = made("leaves.toml", "leaves")
    mine = [row for row in rows if row["solver"] == "faulty"]
    assert [row["status"] for row in mine] == ["solved", "solved", "crashed", "crashed"]
    assert "exit code 7" in mine[2]["message"]
    assert "not run" in mine[3]["message"]
    assert "case=2" in mine[3]["message"]


def test_repeats_of_a_series_stay_together(tmp_path: Path) -> None:
    (tmp_path / "many.toml").write_text("repeats = 3\n" + SUITE)
    write_strip(tmp_path)
    (tmp_path / "faulty.py").write_text(tiny.FAULTY)
    suite = read_suite(str(tmp_path / "many.toml"))
    found = batches(expand(suite))
    assert len(found) == 6
    assert all([m.case for m in batch] == [0, 1, 2, 3] for batch in found)
    assert all(len({m.process for m in batch}) == 1 for batch in found)
    assert validated(__import__("tomllib").loads(to_toml(suite)), tmp_path) == suite


def test_the_table_of_the_report() -> None:
    made("two.toml", "reported")
    from report.build import write

    text = write(Path("reported")).read_text()
    assert "## Series of load cases" in text
    assert len(re.findall(r"\| +4 of 4 \|", text)) == 2
