"""`run DIR --key KEY`: a row of a run measured again."""

from pathlib import Path

import pytest
from commands import harness

from harness.planning.plan import expand, of_key
from harness.planning.suite import read_suite
from harness.results import records

pytestmark = pytest.mark.slow

KEY = "tiny exact dual tol=1e-06 threads=1 repeat=0"


def test_the_row_is_measured_again_and_compared(copy: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    done = harness("run", copy, "--key", KEY, "--out", again)
    assert done.exit_code == 0, done.output
    (then,) = (row for row in records.read(copy / records.MEASUREMENTS) if row["key"] == KEY)
    (now,) = records.read(again / records.MEASUREMENTS)
    same = ("key", "suite", "scene_key", "verdict", "displacement_error_mm", "iterations", "solver_code")
    assert {name: now[name] for name in same} == {name: then[name] for name in same}
    assert harness("compare", copy, again, "--max-slowdown", 1000).exit_code == 1  # the other row is missing
    assert harness("compare", copy, again, "--key", KEY, "--max-slowdown", 1000).exit_code == 0


@pytest.mark.parametrize(
    "key", ["tiny exact", "tiny gi dual tol=1e-06 threads=1 repeat=0", "", KEY + " case=1"]
)
def test_a_key_that_is_not_planned_is_bad_input(copy: Path, tmp_path: Path, key: str) -> None:
    done = harness("run", copy, "--key", key, "--out", tmp_path / "again")
    assert done.exit_code == 2
    assert "--key" in done.stderr
    assert not (tmp_path / "again").exists()


def test_a_case_of_a_series_comes_after_those_before_it() -> None:
    """In whole batches; other processes are left out."""
    plan = expand(read_suite("series"))
    batched = next(m for m in plan if m.batched and m.case == m.batched + 1)
    found = of_key(plan, batched.key)
    assert [m.case for m in found] == list(range(2 * (batched.batched or 0)))
    assert {m.process for m in found} == {batched.process}
    single = next(m for m in plan if not m.batched and m.case == 3)
    assert [m.case for m in of_key(plan, single.key)] == [0, 1, 2, 3]
