"""`reproduce`: a row of a run measured again, with the same or another outcome."""

from pathlib import Path

import pytest
import tiny
from commands import harness
from typer.testing import Result

from harness.measurement.reproduce import find_row, of_one_process
from harness.results import records

pytestmark = pytest.mark.slow


def reproduce(directory: Path, *words: str) -> Result:
    return harness("reproduce", directory, *words)


def test_the_same_code_gives_the_same_answer(finished: Path) -> None:
    before = sorted(path.name for path in finished.rglob("*"))
    done = reproduce(finished, "tiny", "tol=1e-06")
    assert done.exit_code == 0, done.output
    assert "tiny exact dual tol=1e-06 threads=1 repeat=0" in done.stdout
    assert "differ by 0.00e+00 mm" in done.stdout
    assert "Reproduced." in done.stdout
    assert sorted(path.name for path in finished.rglob("*")) == before


def test_another_answer_is_not_reproduced(copy: Path, tmp_path: Path) -> None:
    """The plug-in now multiplies the forces, so that digits are lost within the limit."""
    plugin = tmp_path / "exact.py"
    plugin.write_text(tiny.EXACT.replace("lam, iterations=1", "lam * (1 + 1e-9), iterations=1"))
    done = reproduce(copy, "tol=1e-06", "--plugin", str(plugin))
    assert done.exit_code == 1, done.output
    assert "Not reproduced: within then, within now, +" in done.stdout


def test_words_name_one_measurement_and_the_first_of_its_repeats(copy: Path) -> None:
    rows = records.read(copy / records.MEASUREMENTS)
    again = [row | {"repeat": 1, "key": row["key"].replace("repeat=0", "repeat=1")} for row in rows]
    records.append(copy / records.MEASUREMENTS, *again)
    assert find_row(copy, ["tol=1e-08"]) == rows[1]
    assert find_row(copy, ["tol=1e-08", "repeat=1"]) == again[1]
    assert find_row(copy, [rows[0]["key"]]) == rows[0]


@pytest.mark.parametrize(
    ("words", "message"), [(["exact"], "more words: tiny exact"), (["gi"], "words of one key")]
)
def test_words_of_none_or_several_are_bad_input(finished: Path, words: list[str], message: str) -> None:
    done = reproduce(finished, *words)
    assert done.exit_code == 2
    assert message in done.stderr


def test_another_problem_is_refused(copy: Path) -> None:
    path = copy / records.MEASUREMENTS
    records.rewrite(path, [row | {"scene_key": "an older one"} for row in records.read(path)])
    done = reproduce(copy, "tol=1e-06")
    assert done.exit_code == 5
    assert "another problem now" in done.stderr
    assert reproduce(copy / "answers", "exact").exit_code == 2


def test_a_case_of_a_series_comes_after_those_before_it(tmp_path: Path) -> None:
    """Whole batches, in order, whatever the order of the rows; other measurements are left out."""
    rows = [
        {"key": f"k{case} {threads}", "scene": "s", "solver": "a", "threads_asked": threads, "case": case}
        | {"together": 2}
        for threads in (1, 2)
        for case in (3, 1, 0, 2, 4)
    ]
    records.append(tmp_path / records.MEASUREMENTS, *rows)
    found = of_one_process(tmp_path, rows[3])
    assert [row["key"] for row in found] == ["k0 1", "k1 1", "k2 1", "k3 1"]
    alone = {"key": "k", "case": None}
    assert of_one_process(tmp_path, alone) == [alone]
