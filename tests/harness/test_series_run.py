"""A series from the command line to rows and gaps, against independent answers; ended, resumed, refused."""

import resource
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny_joint
from commands import harness, wrong_usage
from forked_processes import forked_command
from rich.console import Console
from small_problems import solve_by_nnls
from strip_scene import write_strip
from suite_runs import series_rows, wait_for

from harness.results import records, series_file
from harness.results.schema import SERIES
from harness.series import session as session_module
from harness.series.load_case_source import GapCases
from harness.series.run import summary
from harness.series.session import Job, Result, SeriesOptions, SeriesSession
from harness.solving.solver_session import SolverSession
from problems.build import load_case, prepared
from problems.forms.problem import Dual
from problems.load_cases.random_gaps import random_gaps
from problems.scene_files import read_scene
from rivetbench import run_series

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_report")]

COMMAND = ("series", "strip.toml", "--threads", "1")
SLOW = tiny_joint.EXACT.replace("L = sla", "__import__('time').sleep(0.05); L = sla")


@pytest.fixture(autouse=True, scope="module")
def _here(tmp_path_factory: pytest.TempPathFactory) -> Any:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("here")
        write_strip(folder)
        (folder / "exact.py").write_text(tiny_joint.EXACT)
        (folder / "slow.py").write_text(SLOW)
        patch.chdir(folder)
        yield


def series(*arguments: str, code: int = 0) -> Any:
    ended = harness(*COMMAND, *arguments)
    assert ended.exit_code == code, ended.output
    return ended


def rows_of(directory: str) -> list[dict[str, Any]]:
    return list(series_file.rows(Path(directory)))


def gaps_of(directory: str) -> np.ndarray:
    return series_file.StoredGaps(Path(directory), 45)[[row["case"] for row in rows_of(directory)]]


def test_rows_and_gaps_against_nnls(tmp_path: Path) -> None:
    """Each case solved again as the scene that its row names, by another method."""
    series("--cases", "70", "--seed", "5", "--check", "10", "--out", "plain")
    rows, gaps = rows_of("plain"), gaps_of("plain")
    assert [row["case"] for row in rows] == list(range(70))
    assert {row["verdict"] for row in rows} == {"within"}
    assert all(row["bound_mm"] < 1e-9 for row in rows)
    checked = [row for row in rows if "displacement_error_mm" in row]
    assert [row["case"] for row in checked] == list(range(0, 70, 10))
    assert all(row["displacement_error_mm"] <= row["bound_mm"] for row in checked)
    for row in rows[::9]:
        scene = read_scene(str(write_strip(tmp_path, ("seed = 7", f"seed = {row['gap_seed']}"))))
        data = prepared(scene)
        case = load_case(scene)
        x, lam = solve_by_nnls(data, case)
        gap = case.g - data.assembly.A.T @ x
        np.testing.assert_allclose(gaps[row["case"]], gap, rtol=1e-7, atol=1e-9)
        assert row["active"] == (lam > 0).sum() > 0
        assert row["max_gap_mm"] == pytest.approx(gap.max(), abs=1e-9)
        assert row["mean_gap_mm"] == pytest.approx(gap.mean(), abs=1e-9)


def test_again_solves_nothing_and_more_cases_extend() -> None:
    series("--cases", "20", "--out", "grown")
    first = rows_of("grown")
    assert "20 cases, 20 already" in series("--cases", "20", "--out", "grown").output
    assert rows_of("grown") == first
    assert "45 cases, 20 already" in series("--cases", "45", "--out", "grown").output
    assert rows_of("grown")[:20] == first
    series("--cases", "45", "--out", "at-once")
    np.testing.assert_allclose(gaps_of("grown"), gaps_of("at-once"), atol=1e-9)


def test_fewer_cases_are_the_first_of_them() -> None:
    counts = (GapCases(count=count) for count in (5, 2))
    longer, fewer = (run_series("strip.toml", "fewer", cases, report=False).rows for cases in counts)
    assert fewer == longer[:2]


def test_another_series_is_refused() -> None:
    series("--cases", "3", "--out", "mine")
    ended = series("--cases", "3", "--out", "mine", "--sd", "0.3", "--limit", "1e-6", code=2)
    assert ended.output.count("name another directory") == 2
    assert len(rows_of("mine")) == 3


LIMITS = SeriesOptions()
KILLED = "killed by SIGKILL, perhaps by the system because memory ran out"
#: How a case ended, and whether it is tried again.
ENDS: list[tuple[dict[str, Any], bool]] = [
    ({"status": "time_limit", "time_limit_s": LIMITS.time_limit_s}, False),
    ({"status": "time_limit", "time_limit_s": LIMITS.time_limit_s / 2}, True),
    ({"status": "memory_limit", "memory_limit_mib": LIMITS.memory_limit_mib}, False),
    ({"status": "memory_limit", "memory_limit_mib": LIMITS.memory_limit_mib // 2}, True),
    ({"status": "memory_limit"}, True),
    ({"status": "crashed", "message": "killed by SIGSEGV"}, False),
    ({"status": "crashed", "message": KILLED}, True),
    ({"status": "failed", "message": "ValueError: no step"}, False),
    ({"status": "failed", "message": "opening the assembly took more than 300 s"}, True),
]


def test_a_case_is_tried_again_if_its_cause_may_have_passed(tmp_path: Path) -> None:
    command = "--cases", str(len(ENDS)), "--out", str(tmp_path)
    series(*command)
    lost = {"verdict": "no_answer", "message": ""}
    rows = [
        lost | end | {name: row[name] for name in ("case", "gap_seed")}
        for row, (end, _) in zip(rows_of(str(tmp_path)), ENDS, strict=True)
    ]
    series_file.append(tmp_path, [(row, None) for row in rows])
    again = [again for _, again in ENDS]
    assert f"{len(ENDS)} cases, {again.count(False)} already" in series(*command, code=1).output
    assert [row["verdict"] == "within" for row in rows_of(str(tmp_path))] == again


def test_memory_that_ran_out_is_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    solve, command = SolverSession.next, ("--cases", "3", "--solver", "gi", "--out", "memory")

    def short(self: SolverSession, load: Any, near: Any, case: int | None = None) -> Any:
        if case == 1:
            raise MemoryError("as numpy does")
        return solve(self, load, near, case)

    with monkeypatch.context() as patch:
        patch.setattr(SolverSession, "next", short)
        assert "case 1: memory_limit, no_answer: MemoryError" in series(*command, code=1).output
    assert "3 cases, 2 already" in series(*command).output


def test_a_full_disk_leaves_whole_cases() -> None:
    def small() -> None:
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_FSIZE, (2**17, 2**17))

    many = ("--cases", "500", "--solver", "gi", "--check", "0", "--out", "full")
    code, said = forked_command(*COMMAND, *many, before=small).ended()
    assert code == 2
    assert SERIES in said
    assert "Traceback" not in said
    kept = rows_of("full")
    assert 0 < len(kept) == len(gaps_of("full")) < 500


def test_a_directory_holds_one_kind_of_result(tmp_path: Path) -> None:
    suite = tiny_joint.write_suite(tmp_path)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / records.MEASUREMENTS).touch()
    assert "another command" in series("--cases", "3", "--out", str(tmp_path / "run"), code=2).output
    series("--cases", "3", "--out", str(tmp_path / "series"))
    assert "another command" in wrong_usage("run", suite, "--out", tmp_path / "series")
    assert len(rows_of(str(tmp_path / "series"))) == 3


def test_ctrl_c_keeps_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = SeriesSession._try

    def interrupted(self: SeriesSession, case: int, load: Any) -> Any:
        if case == 50:
            raise KeyboardInterrupt
        return solve(self, case, load)

    with monkeypatch.context() as patch:
        patch.setattr(SeriesSession, "_try", interrupted)
        patch.setattr(session_module, "BLOCK", 32)
        some = ("--cases", "60", "--solver", "gi", "--out", "stopped")
        assert "run the same command again to continue" in series(*some, code=130).output
    assert [row["case"] for row in rows_of("stopped")] == list(range(32))  # whole blocks
    series(*some)
    assert [row["case"] for row in rows_of("stopped")] == list(range(60))


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_kill_loses_and_doubles_no_row() -> None:
    slow = ("--cases", "25", "--solver", "slow", "--plugin", "slow.py", "--out", "killed")
    going = forked_command(*COMMAND, *slow)
    wait_for(lambda: series_rows(Path("killed")))
    assert going.poll() is None
    going.send(signal.SIGKILL)
    going.ended()
    kept = rows_of("killed")
    assert 0 < len(kept) < 25
    series(*slow)
    rows = rows_of("killed")
    assert rows[: len(kept)] == kept
    assert sorted(row["case"] for row in rows) == list(range(25))


def test_a_table_may_grow_and_not_change() -> None:
    """A bad case, and one that has changed since, are named, and what is solved is kept."""
    gaps = np.random.default_rng(0).uniform(0, 0.5, (12, 45))

    def solved(rows: np.ndarray, code: int = 0) -> str:
        np.save("gaps.npy", rows)
        return str(series("--gaps", "gaps.npy", "--out", "table", code=code).output)

    solved(gaps[:8])
    bad, other = gaps.copy(), gaps.copy()
    bad[10, 3] = np.nan
    assert "case 10, contact 3 = nan" in solved(bad, 2)
    other[4, 44] += 1e-12
    said = solved(other, 2)
    assert "case 4, gaps = " in said
    assert said.count("name another directory") == 1
    assert len(rows_of("table")) == 8
    assert "12 cases, 8 already" in solved(gaps)


def test_a_sweep_starts_from_its_neighbour() -> None:
    series("--sweep", "initial_gap.mean=0.1:1.0:40", "--solver", "gi", "--out", "swept")
    rows = rows_of("swept")
    assert [row["warm_from"] for row in rows[1:]] == list(range(39))
    assert rows[7]["initial_gap.mean"] == pytest.approx(0.1 + 7 * 0.9 / 39)


def test_what_cannot_be_together_is_said_at_once() -> None:
    ended = series("--gaps", "gaps.csv", "--sweep", "a=1", "--form", "primal", "--out", "none", code=2)
    assert "random gaps, --gaps or --sweep" in ended.output
    assert "newton takes dual" in ended.output
    assert not Path("none").exists()
    series("--sweep", "initial_gap.mean=1:2:3", "--cases", "5", "--out", "none", code=2)
    ended = series("--scans", "s*.csv", "--sd", "1", "--variance", "2", "--out", "none", code=2)
    assert "--scans, random gaps or --gaps" in ended.output
    assert "--variance: share = 2" in ended.output
    ended = series("--gaps", "gaps.csv", "--columns", "X,Y,Gap", "--out", "none", code=2)
    assert "--columns: headings = 'X, Y, Gap'" in ended.output
    ended = series("--missing", "9999", "--memory-limit", "500", "--time-limit", "1", "--out", "none", code=2)
    assert "--missing: marks = '9999'" in ended.output
    assert "--time-limit: limit = 1.0: with --plugin" in ended.output
    assert "--memory-limit: limit = 500: with --plugin" in ended.output


def results_of(count: int, check: int, **solver: Any) -> list[Result]:
    scene = read_scene("strip.toml")
    how: Any = {"tolerance": 1e-9, "check": check, "threads": 1, "form": "dual"} | solver
    job = Job("faulty", scene=scene, cases=random_gaps(scene, count, 0), **how)
    return [result for results in SeriesSession(job).solve(range(count)) for result in results]


@pytest.mark.parametrize(
    ("fault", "verdicts"),
    [
        ("nan", ["no_answer"] * 4),
        ("raises", ["no_answer"] * 4),
        ("big_details", ["outside", "cannot_be_judged"] * 2),  # its λ is zero; every second case is checked
    ],
)
def test_a_solver_that_fails_is_a_row(fault: str, verdicts: list[str]) -> None:
    Path("faulty.py").write_text(tiny_joint.FAULTY)
    results = results_of(4, 2, solver_options={"fault": fault}, plugin=Path("faulty.py"))
    assert [result.row["verdict"] for result in results] == verdicts
    assert all((result.gap is None) == (result.row["verdict"] == "no_answer") for result in results)
    assert fault != "raises" or "ValueError: no step" in results[0].row["message"]


def test_what_p_has_lost_in_rounding_is_in_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """p is off by 1e-6 mm: the bound is the answer's distance from the proven one, not much more."""
    scene, rng = read_scene("strip.toml"), np.random.default_rng(0)
    loads = Dual.loads

    def spoilt(self: Dual, cases: Any) -> Any:
        return [replace(load, p=load.p + 1e-6 * rng.standard_normal(45)) for load in loads(self, cases)]

    monkeypatch.setattr(Dual, "loads", spoilt)
    job = Job(scene=scene, cases=random_gaps(scene, 9, 0), form="dual", limit_mm=1e-5, check=1, threads=1)
    (results,) = SeriesSession(job).solve(range(9))
    for row in (result.row for result in results):
        assert row["verdict"] == "within"
        error = row["displacement_error_mm"]
        assert 1e-8 < error <= row["bound_mm"] <= 1.02 * (error + session_module.ENOUGH * job.limit_mm)


@pytest.mark.parametrize("fault", ["raise RuntimeError", "return answers[:-1]", "return [None] * len(loads)"])
def test_cases_that_cannot_be_solved_at_once_are_solved_one_after_another(fault: str) -> None:
    """A plugin whose `batched` fails on one block."""
    text = (
        tiny_joint.EXACT
        + f"""
    def batched(self, state):
        def answers(loads, tolerance):
            answers = [self.solve(state, load, tolerance) for load in loads]
            if len(loads) < {session_module.BLOCK}:
                {fault}
            return answers
        return answers
"""
    )
    Path("faulty.py").write_text(text)
    count = session_module.BLOCK + 5
    rows = [result.row for result in results_of(count, 0, plugin=Path("faulty.py"))]
    assert [row["case"] for row in rows] == list(range(count))
    assert {row["status"] for row in rows} == {"solved"}
    assert [("setup_s" in row) for row in rows] == [False] * session_module.BLOCK + [True] * 5


def test_the_case_that_ends_a_process_is_told_from_those_solved_at_once() -> None:
    """A plug-in that ends where no contact closes, alone or among others."""
    text = tiny_joint.EXACT.replace("L = sla", "load.p.max() > 0 or __import__('os')._exit(7); L = sla")
    text += """
    def batched(self, state):
        return lambda loads, tolerance: [self.solve(state, load, tolerance) for load in loads]
"""
    Path("ends.py").write_text(text)
    swept = ("--sweep", "initial_gap.mean=0.1,0.2,90.0,0.3,0.4", "--check", "0", "--out", "ends")
    plugin = ("--plugin", "ends.py", "--solver", "ends")
    assert "Not solved: 2" in series(*swept, *plugin, code=1).output
    *within, ended = rows_of("ends")
    assert [row["verdict"] for row in within] == ["within"] * 2
    assert (ended["case"], ended["status"], ended["time_limit_s"]) == (2, "crashed", 60.0)
    assert "5 cases, 3 already" in series(*swept, *plugin, code=1).output
    assert [row["verdict"] for row in rows_of("ends")] == ["within"] * 2 + ["no_answer"] + ["within"] * 2


@pytest.mark.parametrize(
    ("verdicts", "code"),
    [
        (["within", "within"], 0),
        (["within", "cannot_be_judged"], 3),
        (["cannot_be_judged", "no_answer"], 1),
        (["no_answer", "no_answer"], 1),
        (["within", "cannot_be_judged", "outside"], 1),
        (["within", "no_answer"], 1),
    ],
)
def test_a_case_that_cannot_be_judged_is_no_success(verdicts: list[str], code: int) -> None:
    rows = [{"case": k, "verdict": verdict} for k, verdict in enumerate(verdicts)]
    assert summary(rows, len(rows), Console(quiet=True)) == code
