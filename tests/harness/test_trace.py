"""Solvers that are stopped after 1, 2, 4, … iterations, and the logs of their processes."""

from pathlib import Path

import pytest
import tiny_joint
from suite_runs import rows_of, said_by

from harness.measurement.suite_run import run
from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.planning.tolerance_search import still_needed
from harness.verification.gate import gate
from report.document.blocks import Figure
from report.results.reader import read
from report.sections import trace

TWO = """
[[solver]]
name = "ipm"
forms = ["dual"]
tolerances = [1e-14]
[[solver]]
name = "exact"
forms = ["dual"]
"""


@pytest.mark.slow
def test_a_trace_stops_a_solver_earlier_and_earlier(tmp_path: Path) -> None:
    suite = read_suite(str(tiny_joint.write_suite(tmp_path, TWO, trace=True)))
    assert said_by(run, suite, tmp_path / "run")[0] == 0
    rows = rows_of(tmp_path / "run")
    whole, *stopped = [row for row in rows if row["solver"] == "ipm"]
    assert (whole["iteration_limit"], whole["verdict"]) == (None, "within")
    limits = [row["iteration_limit"] for row in stopped]
    assert limits == [2**k for k in range(len(limits))]
    assert limits[-1] < whole["iterations"] <= 2 * limits[-1]
    assert [row["iterations"] for row in stopped] == limits
    assert {row["status"] for row in stopped} == {"iteration_limit"}
    errors = [row["displacement_error_mm"] for row in (*stopped, whole)]
    assert errors == sorted(errors, reverse=True)
    log = (tmp_path / "run" / whole["log"]).read_text("utf-8").splitlines()
    assert len(log) == whole["iterations"] + 1
    assert all(line.startswith("mu ") for line in log)
    assert len({row["device"] for row in rows}) == 1
    (exact,) = [row for row in rows if row["solver"] == "exact"]  # one iteration, and it prints nothing
    assert exact["log"] is None
    results = read(tmp_path / "run")
    assert results.about("scenes").rows["variant"].tolist() == ["", ""]
    section = trace.section(results)
    assert section is not None
    (figure,) = section.blocks
    assert isinstance(figure, Figure)
    assert figure.data is not None
    assert figure.data["displacement_error_mm"].tolist() == errors
    assert set(figure.data["label"]) == {"ipm (dual)"}
    said_by(run, suite, tmp_path / "run")  # makes no measurement once more
    assert len(rows_of(tmp_path / "run")) == len(rows)
    judged = gate(tmp_path / "run")
    assert judged.passed
    assert [finding.key for finding in judged.findings] == [whole["key"], exact["key"]]


@pytest.mark.parametrize(("iterations", "last"), [(1, 0), (5, 4), (8, 4), (None, 0)])
def test_limits_are_fewer_than_the_iterations_that_it_takes(
    tmp_path: Path, iterations: int | None, last: int
) -> None:
    suite = read_suite(str(tiny_joint.write_suite(tmp_path, trace=True)))
    whole, *stopped = expand(suite)
    row = {
        "scene": whole.scene, "solver": "exact", "form": "dual", "variant": "", "options": {},
        "threads_asked": 1, "tolerance": 1e-9, "iterations": iterations,
    }  # fmt: skip
    assert still_needed(whole, []) == whole
    assert all(still_needed(m, []) for m in stopped)
    needed = [m.iteration_limit for m in stopped if still_needed(m, [row])]
    assert max(needed, default=0) == last
    assert len({m.key for m in stopped} | {m.stem for m in stopped}) == 2 * len(stopped)
