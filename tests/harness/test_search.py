"""tolerances = "auto" and repeats = "auto": what is measured, and what the report makes of it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tiny
from runs import rows_of, said_by

from harness.measurement.run import run
from harness.planning.overrides import Overrides, overridden, tolerances_of
from harness.planning.plan import DECADES, Measurement, expand
from harness.planning.search import superfluous
from harness.planning.suite import read_suite, suite_from
from problems.errors import InputError
from report.results.reader import read

#: Right to a tenth of the tolerance; below `least` it gives up.
ROUGH = (
    tiny.EXACT.partition("        return")[0]
    + """
        if tolerance < self.least:
            return Answer("inaccurate", lam * (1 + self.least))
        return Answer("solved", lam * (1 + tolerance))

    def __init__(self, *, least=0.0):
        self.least = least
"""
)


def suite_of(folder: Path, **changes: Any) -> Any:
    (folder / "rough.py").write_text(ROUGH)
    suite = read_suite(str(tiny.write_suite(folder)))
    change = Overrides(solvers=("rough",), tolerances="auto", plugin=folder / "rough.py", **changes)
    return overridden(suite, change)


def measured(suite: Any, directory: Path) -> list[dict[str, Any]]:
    assert said_by(run, suite, directory)[0] in (0, 3)
    return rows_of(directory)


def test_the_search_ends_at_the_first_tolerance_that_suffices(tmp_path: Path) -> None:
    suite = suite_of(tmp_path, repeats=2)
    rows = measured(suite, tmp_path / "out")
    first = [row for row in rows if row["repeat"] == 0]
    *before, last = first
    assert [row["tolerance"] for row in first] == DECADES[: len(first)]
    assert before
    assert {row["verdict"] for row in before} == {"outside"}
    assert last["verdict"] == "within"
    # Only what was found is repeated; and nothing is left for the same command.
    assert [row["tolerance"] for row in rows if row["repeat"] == 1] == [last["tolerance"]]
    assert measured(suite, tmp_path / "out") == rows

    results = read(tmp_path / "out")
    (cell,) = results.cells.to_dict("records")
    assert (cell["label"], cell["tolerance"], cell["repeats"]) == ("rough (dual)", last["tolerance"], 2)


def test_it_ends_where_the_solver_gives_up(tmp_path: Path) -> None:
    rows = measured(suite_of(tmp_path, options=("rough.least=1e-4",)), tmp_path / "out")
    assert [row["tolerance"] for row in rows] == [1e-3, 1e-4, 1e-5]
    assert rows[-1]["status"] == "inaccurate"
    (cell,) = read(tmp_path / "out").cells.to_dict("records")
    assert cell["tolerance"] == 1e-5


def row_of(m: Measurement, seconds: float, verdict: str = "within") -> dict[str, Any]:
    names = ("scene", "solver", "form", "variant", "options", "tolerance", "repeat")
    steps = dict.fromkeys(("convert_s", "prepare_s", "setup_s", "form_s")) | {"solve_s": seconds}
    asked = {name: getattr(m, name) for name in names} | {"threads_asked": m.threads}
    return asked | steps | {"verdict": verdict, "status": "solved"}


@pytest.mark.parametrize(("seconds", "repeats"), [(0.1, 5), (3.0, 3), (30.0, 1)])
def test_what_is_quick_is_repeated(tmp_path: Path, seconds: float, repeats: int) -> None:
    suite = read_suite(str(tiny.write_suite(tmp_path))).model_copy(update={"repeats": "auto"})
    plan = [m for m in expand(suite) if m.solver == suite.solver[0].name]
    rows = [row_of(plan[0], seconds)]
    others = [m for m in plan if m.tolerance == plan[0].tolerance and m.form == plan[0].form]
    assert [m.repeat for m in others if not superfluous(m, rows)] == [*range(repeats)]
    assert not superfluous(replace(plan[0], repeat=4), [])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"options": ("rough.least",)}, ["--option", "rough.least", "SOLVER.KEY=VALUE"]),
        ({"options": ("rough.least=[1",)}, ["--option", "SOLVER.KEY=VALUE"]),
        ({"options": ("rugh.least=1",)}, ["--option", "rugh", "did you mean rough?"]),
    ],
)
def test_bad_options(tmp_path: Path, change: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        suite_of(tmp_path, **change)
    for word in words:
        assert word in str(caught.value)


def test_tolerances_of_the_command_line() -> None:
    assert tolerances_of(["auto"]) == "auto"
    assert tolerances_of(["1e-6", "1e-9"]) == (1e-6, 1e-9)
    with pytest.raises(InputError, match="a number, or auto alone"):
        tolerances_of(["1e-6", "auto"])


def test_a_series_searches_for_nothing(tmp_path: Path) -> None:
    data = read_suite(str(tiny.write_suite(tmp_path))).model_dump(exclude_none=True)
    data |= {"series": {"cases": 2}, "tolerances": "auto", "repeats": "auto"}
    with pytest.raises(InputError) as caught:
        suite_from(data, tmp_path / "suite.toml")
    assert len(caught.value.faults) == 2
