"""Where no bound can be proven, nothing says that one was: no console, no file, no report."""

import json
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from suite_runs import said_by

from harness.measurement.suite_run import summary as summary_of_run
from harness.scene.answer_record import summary as said_of
from harness.scene.solve import solve_into
from harness.series.run import summary

pytestmark = pytest.mark.usefixtures("blank_pictures")
K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])


def said(folder: Path, f: float, stiffness: np.ndarray = K) -> tuple[int, str]:
    np.savez(folder / "mine.npz", K=stiffness, A=np.eye(3), f=np.full(3, f), g=np.zeros(3))
    return said_by(solve_into, str(folder / "mine.npz"), None, 1e-9, folder / "out")


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_solve_says_that_a_bound_could_not_be_proven(tmp_path: Path) -> None:
    code, text = said(tmp_path, 1e307)
    assert code == 1
    assert "a bound could not be proven" in text
    assert "nan" not in text
    assert ", proven" not in text
    record = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert (record["error_bound_mm"], record["verdict"]) == (None, "cannot_be_judged")
    assert record["route"].startswith("could not be proven")
    assert "No bound on the error could be proven." in (tmp_path / "out" / "answer.md").read_text("utf-8")


@pytest.mark.parametrize("off", [0.0, np.spacing(0.5)])
def test_solve_says_what_was_proven_and_that_K_was_symmetrised(off: float, tmp_path: Path) -> None:
    given = K.copy()
    given[0, 1] += off
    code, text = said(tmp_path, 1.0, given)
    assert code == 0
    assert "mm, proven." in text
    assert ("was replaced by (K + Kᵀ)/2." in text) == bool(off)


def test_solve_says_no_less_than_what_was_proven() -> None:
    record = {"digits": None, "skipped": [], "judged_error_mm": None, "error_bound_mm": 3.21e-16}
    about = {"method": "newton, refined", "status": "solved", "verdict": "within"}
    ((said, _),) = said_of(record | about)
    assert said == "newton, refined: every displacement within 3.3e-16 mm, proven."
    ((said, _),) = said_of(record | about | {"judged_error_mm": 1e-9})
    assert "1.0e-09 mm from the answer with a proven bound (3.3e-16 mm)" in said


def test_a_series_says_how_many_bounds_are_missing() -> None:
    """An infinite bound is null in the rows of a series."""
    console = Console(file=StringIO(), width=200)
    rows: list[Any] = [{"verdict": "within", "bound_mm": 1.21e-9}, {"verdict": "no_answer"}]
    summary(rows, 2, console)
    summary([*rows, {"verdict": "cannot_be_judged", "bound_mm": None}], 3, console)
    first, *_, last = (line for line in console.file.getvalue().splitlines() if "bound" in line)
    assert "largest proven error bound 1.3e-09 mm" in first
    assert "some bounds could not be proven" in last


@pytest.mark.parametrize(
    ("bound", "said"), [(3.2e-7, "the references are proven to 4e-07 mm"), (None, "no reference is proven")]
)
def test_a_run_whose_answers_cannot_be_judged_says_so(bound: float | None, said: str) -> None:
    console = Console(file=StringIO(), width=200)
    rows: list[Any] = [{"verdict": "cannot_be_judged", "reference_bound_mm": bound}]
    assert summary_of_run([*rows, {"verdict": "no_answer"}], console) == 3
    assert f"Nothing could be judged: {said}, and a tenth of the limit" in console.file.getvalue()
