"""A run from a suite to rows, answers and gate, through real workers on a tiny scene; and a row of it
measured again, `run DIR --key KEY`.
"""

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import tiny_joint
from commands import harness, wrong_usage
from forked_processes import forked_command
from refusals import refusal_of
from suite_runs import changed, gated, is_alive, moved, rows_of, said_by, wait_for

from harness.measurement import task
from harness.measurement.solver_descriptions import Description, valid_and_old
from harness.measurement.suite_run import run
from harness.planning.plan import expand, of_key
from harness.planning.suite import read_suite, read_written
from harness.results import records
from harness.results.records import Row
from harness.verification.reference_problem import ReferenceProblem, measurable
from problems.scene_files import read_scene
from studies.smaller_results import pack

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_report")]

CONTRACT = {
    "suite", "scene", "n", "m", "active", "solver", "form", "variant", "tolerance", "threads", "repeat",
    "status", "iterations", "inner_iterations", "convert_s", "prepare_s", "setup_s", "solve_s",
    "solver_reported_s", "displacement_error_mm", "limit_mm", "verdict", "reference_bound_mm",
    "contact_mismatch", "min_gap_mm", "primal_residual", "dual_residual", "duality_gap", "peak_rss_mib",
    "machine", "commit", "clean",
}  # fmt: skip
TWO = """
[[solver]]
name = "exact"
forms = ["dual", "primal"]
gated = false
[[solver]]
name = "exact"
forms = ["dual"]
tolerances = [1e-6, 1e-8]
"""

KEY = "tiny exact dual tol=1e-06 threads=1 repeat=0"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="module")
def finished(folder: Path) -> Path:
    """A directory with the rows of a run; tests take a `copy`."""
    code, text = said_by(run, tiny_joint.suite(folder, TWO, yardstick=True), folder / "finished")
    assert code == 0
    assert "4 measurements" in text
    return folder / "finished"


def test_a_run_writes_what_the_contract_names(finished: Path) -> None:
    rows = rows_of(finished)
    assert all(set(row) >= CONTRACT for row in rows)
    judged = [row for row in rows if row["form"] == "dual"]
    assert {(row["verdict"], row["status"], row["n"], row["m"]) for row in judged} == {
        ("within", "solved", 20, 10)
    }
    assert all(row["displacement_error_mm"] < 1e-12 and row["contact_mismatch"] == 0 for row in judged)
    (unsupported,) = [row for row in rows if row["form"] == "primal"]
    assert (unsupported["status"], unsupported["verdict"]) == ("unsupported", "no_answer")
    assert unsupported["message"] == "takes dual only"
    for row in judged:
        assert all(0 < row[name] < 10 for name in ("cholesky_s", "product_s"))  # the yardstick
        with np.load(finished / row["answer"]) as saved:
            assert (saved["x"].shape, saved["lam"].shape) == ((20,), (10,))
    (problem,) = records.read(finished / "problems.jsonl")
    with (
        np.load(finished / "scenes" / "tiny.npz") as arrays,
        np.load(finished.parent / "tiny.npz") as source,
    ):
        eigenvalues = np.linalg.eigvalsh(source["K"])
        assert problem["cond_K"] == pytest.approx(eigenvalues[-1] / eigenvalues[0])
        assert problem["active"] == np.count_nonzero(arrays["gap_after"] < 1e-12) == rows[0]["active"]
        assert np.array_equal(arrays["gap_before"], source["g"])
    machine = json.loads((finished / "machine.json").read_text())["machine"]
    assert machine == rows[0]["machine"] == problem["machine"]


def test_running_again_measures_nothing_twice(copy: Path, folder: Path) -> None:
    """Torn lines are left out, also of the files of which `report` says that `run` does it."""
    lines = (copy / records.MEASUREMENTS).read_bytes().splitlines(keepends=True)
    (copy / records.MEASUREMENTS).write_bytes(lines[0] + lines[1] + lines[2] + lines[3][:50])
    others = ("problems.jsonl", records.OUTDATED)
    for name in others:
        with (copy / name).open("ab") as file:
            file.write(b'{"torn')
    code, text = said_by(run, read_suite(str(folder / "small.toml")), copy)
    assert code == 0
    for name in (records.MEASUREMENTS, *others):
        assert f"{name}: the last line was cut off" in text.replace("\n", "")
    assert [len(records.read(copy / name)) for name in others] == [1, 0]
    assert "4 measurements, 3 of them already" in text
    again = (copy / records.MEASUREMENTS).read_bytes().splitlines(keepends=True)
    assert again[:3] == lines[:3]
    assert len(again) == 4
    assert json.loads(again[3])["key"] == json.loads(lines[3])["key"]


def test_scenes_that_cannot_be_read_end_a_run_before_it_measures(
    copy: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A measured scene is recorded among them before its rows are."""
    measured = list[str]()
    monkeypatch.setattr("harness.measurement.task.measure", lambda batch, _: measured.append(batch[0].key))
    records.rewrite(copy / records.MEASUREMENTS, rows_of(copy)[:2])
    (copy / "problems.jsonl").write_text('{"n": 3}\n')
    assert "problems.jsonl: line 1: scene" in wrong_usage("run", folder / "small.toml", "--out", copy)
    assert measured == []


def test_rows_of_another_scene_or_solver_are_set_aside(copy: Path, folder: Path) -> None:
    rows, names = rows_of(copy), ("scene_key", "solver_version", "solver_code")
    answered = [row for row in rows if row["answer"]]
    for row, name in zip(answered, names, strict=True):
        row[name] = "an older one"
    records.rewrite(copy / records.MEASUREMENTS, rows)
    code, text = said_by(run, read_suite(str(folder / "small.toml")), copy)
    assert code == 0
    assert ": 3 rows, because the scene" in text
    aside = records.read(copy / records.OUTDATED)
    assert [row[name] for row, name in zip(aside, names, strict=True)] == ["an older one"] * 3
    assert {row["answer"] for row in aside} == {None}
    assert len(rows_of(copy)) == 4


def test_a_row_whose_process_was_killed_is_measured_again(copy: Path, folder: Path) -> None:
    rows = rows_of(copy)
    rows[2] |= {"status": "crashed", "message": "killed by SIGKILL", "verdict": "no_answer", "answer": None}
    rows[3] |= {"status": "crashed", "message": "killed by SIGSEGV"}
    records.rewrite(copy / records.MEASUREMENTS, rows)
    _, text = said_by(run, read_suite(str(folder / "small.toml")), copy)
    assert "1 row, because the scene, the solver or the limits have changed since, or a failure" in text
    assert [row["status"] for row in rows_of(copy)[2:]] == ["crashed", "solved"]


def test_no_row_of_a_scene_that_has_changed_stays(copy: Path) -> None:
    """Whatever its solver and round, planned or not; those of the scene as it is, and of others, do."""
    first = rows_of(copy)[0]
    others = [first | {"key": f"tiny other {k}", "solver": "other"} for k in range(3)]
    others[1] |= {"round": "2026-01-01T00:00:00+00:00", "solver": "newton"}
    others[2] |= {"key": "changed other", "scene": "changed", "scene_key": "another"}
    old = [row | {"scene_key": "older"} for row in others[:2]]
    plan = expand(read_written(copy / "suite.toml"))
    solvers = {("exact", ""): Description(["dual"], "1", "code")}
    assert valid_and_old([*others, *old], plan, solvers) == (others, old)


def test_rows_that_are_set_aside_are_missing(copy: Path, folder: Path) -> None:
    """A run without their solver would make the gate forget them."""
    suite, rows = read_suite(str(folder / "small.toml")), rows_of(copy)
    records.rewrite(copy / records.MEASUREMENTS, [*rows[:2], rows[2] | {"scene_key": "older"}, *rows[3:]])
    narrower, before = suite.model_copy(update={"solver": suite.solver[:1]}), rows_of(copy)
    assert rows[2]["key"] in str(refusal_of(said_by, run, narrower, copy))
    assert rows_of(copy) == before


@pytest.mark.parametrize("suite_is_read", [True, False])
def test_a_run_that_leaves_out_missing_rows_is_refused(copy: Path, folder: Path, suite_is_read: bool) -> None:
    """The gate would no longer miss them. Once they are there, it may go on."""
    suite, rows = read_suite(str(folder / "small.toml")), rows_of(copy)
    narrower = suite.model_copy(update={"solver": suite.solver[:1]})
    records.rewrite(copy / records.MEASUREMENTS, rows[:2] + rows[3:])
    if not suite_is_read:
        (copy / "suite.toml").write_text("solver = [3]")
    contents = {path: path.read_bytes() for path in copy.iterdir() if path.is_file()}
    refused = str(refusal_of(said_by, run, narrower, copy))
    assert (rows[2]["key"] if suite_is_read else "cannot be known") in refused
    assert "name another directory" in refused
    assert {path: path.read_bytes() for path in contents} == contents
    if suite_is_read:
        assert said_by(run, suite, copy)[0] == said_by(run, narrower, copy)[0] == 0
        assert len(rows_of(copy)) == len(rows)


def test_a_row_measured_again_leaves_the_directory_as_it_is(copy: Path) -> None:
    """A missing row joins the others, and suite.toml stays."""
    suite, rows = (copy / "suite.toml").read_bytes(), rows_of(copy)
    done = harness("run", copy, "--key", KEY, "--out", copy)
    assert (done.exit_code, rows_of(copy)) == (2, rows)
    assert "name another directory" in done.stderr
    records.rewrite(copy / records.MEASUREMENTS, [row for row in rows if row["key"] != KEY])
    assert harness("run", copy, "--key", KEY, "--out", copy).exit_code == 0
    assert {row["key"] for row in rows_of(copy)} == {row["key"] for row in rows}
    assert (copy / "suite.toml").read_bytes() == suite


def test_no_row_is_measured_beside_a_damaged_suite(copy: Path, folder: Path) -> None:
    """Its report could not be written."""
    rows = [row for row in rows_of(copy) if row["key"] != KEY]
    records.rewrite(copy / records.MEASUREMENTS, rows)
    (copy / "suite.toml").write_text("solver = [3")
    told = wrong_usage("run", folder / "small.toml", "--key", KEY, "--out", copy)
    assert str(copy / "suite.toml") in told
    assert rows_of(copy) == rows


def test_gate_believes_the_answers_and_not_the_rows(copy: Path) -> None:
    changed(copy, verdict="outside", displacement_error_mm=1.0, reference_bound_mm=1.0)
    assert gated(copy)[0] == 0
    changed(copy, verdict="within", displacement_error_mm=0.0, limit_mm=1.0)
    moved(copy / rows_of(copy)[2]["answer"], 2e-7)
    code, text = gated(copy)
    assert code == 1
    assert "2.000e-07 mm from the reference" in text


def test_gate_reads_the_answers_of_an_archive(copy: Path) -> None:
    judged = gated(copy)
    moved(copy / rows_of(copy)[2]["answer"], 2e-7)
    spoilt = gated(copy)
    pack(copy)
    assert not (copy / "answers").exists()
    assert judged[0] == 0
    assert gated(copy) == spoilt
    assert spoilt[0] == 1
    archive = copy / "answers.zip"
    whole = archive.read_bytes()
    archive.write_bytes(whole[:60] + bytes(40) + whole[100:])  # in the first member
    assert "damaged" in gated(copy)[1]
    archive.write_bytes(whole[:-30])
    assert gated(copy)[0] == 3


def test_gate_passes_within_the_limit_and_ignores_what_is_not_gated(copy: Path) -> None:
    rows = rows_of(copy)
    moved(copy / rows[2]["answer"], 0.5e-7)
    (free,) = [row for row in rows if row["answer"] and not row["gated"]]
    moved(copy / free["answer"], 1.0)
    code, text = gated(copy)
    assert code == 0
    assert "all 2 gated rows" in text


def other(**arrays: Any) -> Callable[[Path], Any]:
    return lambda answer: np.savez(answer, **arrays)


@pytest.mark.parametrize(
    "harm",
    [
        Path.unlink,
        lambda answer: answer.write_bytes(answer.read_bytes()[:100]),
        lambda answer: (answer.unlink(), os.mkfifo(answer)),
        other(x=np.full(20, "1.0"), lam=np.zeros(10)),
        other(x=np.full(20, 1.0 + 2j), lam=np.zeros(10)),
        other(x=np.full((20, 2), 1.0), lam=np.zeros(10)),
        other(lam=np.zeros(10)),
    ],
)
def test_gate_takes_a_damaged_answer_for_none(copy: Path, harm: Callable[[Path], Any]) -> None:
    harm(copy / rows_of(copy)[2]["answer"])
    code, text = gated(copy)
    assert code == 1
    assert "missing, damaged or not finite" in text


@pytest.mark.parametrize("harm", ["no_answer", "row_missing", "other_scene", "no_suite"])
def test_gate_takes_a_missing_answer_for_lost_accuracy(copy: Path, harm: str) -> None:
    """And one that was perhaps never planned, where nobody says what was."""
    rows = rows_of(copy)
    match harm:
        case "no_answer":
            rows[2].update(answer=None, status="crashed", message="killed by SIGSEGV")
        case "row_missing":
            del rows[2]
        case "other_scene":
            rows[2]["scene_key"] = "older"
        case "no_suite":
            (copy / "suite.toml").unlink()
    records.rewrite(copy / records.MEASUREMENTS, rows)
    code, text = gated(copy)
    assert code == 1
    assert harm != "no_suite" or "suite.toml" in text


@pytest.mark.parametrize("rows_kept", ["none", "all_failed", "no_field", "none_gated"])
def test_gate_with_nothing_to_judge(copy: Path, rows_kept: str) -> None:
    rows = [] if rows_kept == "none" else rows_of(copy)
    for row in rows:
        row.update({"gated": False} if rows_kept == "none_gated" else {"answer": None})
        if rows_kept == "no_field":
            del row["answer"]
    records.rewrite(copy / records.MEASUREMENTS, rows)
    code, text = gated(copy)
    assert code == 3
    assert "Nothing could be judged" in text


@pytest.mark.usefixtures("finished")
def test_an_answer_that_cannot_be_saved_ends_the_run(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is no failure of its solver, and is measured again by the next run."""

    def measure(batch: list[Any], files: list[Path]) -> list[dict[str, Any]]:
        return [{"status": "failed", "answer": None, "cannot_save": f"{files[0]}: no space left"}]

    monkeypatch.setattr("harness.measurement.task.measure", measure)
    told = wrong_usage("run", folder / "small.toml", "--out", tmp_path / "out")
    assert "no space left; rows already written are safe" in told
    assert not (tmp_path / "out" / records.MEASUREMENTS).exists()


def test_a_scene_whose_file_changes_when_it_has_been_opened_ends_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reference is that of the old one, on which right answers to the new one would be wrong."""
    suite = tiny_joint.write_suite(tmp_path / "own")

    def changing(*of: Any) -> ReferenceProblem:
        problem = measurable(*of)
        tiny_joint.write_problem(tmp_path / "own" / "tiny.npz", shift=1.0)
        return problem

    monkeypatch.setattr("harness.measurement.suite_run.measurable", changing)
    assert "it has changed since" in wrong_usage("run", suite, "--out", tmp_path / "out")


def test_a_row_has_the_key_of_the_scene_that_was_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not that of the file when it is written, for which the next run would keep it."""
    suite = tiny_joint.write_suite(tmp_path / "own")
    key = read_scene(str(tmp_path / "own" / "tiny.npz")).key

    def changing(*of: Any) -> list[Row]:
        tiny_joint.write_problem(tmp_path / "own" / "tiny.npz", shift=1.0)
        return task.rows_of(*of)

    monkeypatch.setattr("harness.measurement.suite_run.rows_of", changing)
    assert said_by(run, read_suite(str(suite)), tmp_path / "out")[0] == 0
    rows = [*rows_of(tmp_path / "out"), *records.read(tmp_path / "out" / "problems.jsonl")]
    assert [row["scene_key"] for row in rows] == [key, key]


def test_bad_input_is_one_line_a_fault_and_exit_code_2(copy: Path, folder: Path) -> None:
    messages = {
        ("gate", folder / "nowhere"): "no such directory",
        ("run", "nosuch"): "no such suite",
        ("run", folder / "small.toml", "--solver", "exat"): "did you mean exact",
        ("run", folder / "small.toml", "--out", folder / "tiny.npz" / "out"): "cannot be written",
    }
    for arguments, message in messages.items():
        done = harness(*arguments)
        assert done.exit_code == 2
        assert message in done.stderr
        assert len(done.stderr.splitlines()) == 1
    with (copy / records.MEASUREMENTS).open("ab") as file:
        file.write(b'{"torn')
    for name in ("gate", "report"):
        assert "measurements.jsonl: line 5" in wrong_usage(name, copy)


def test_an_interrupted_run_keeps_its_rows_and_goes_on(folder: Path) -> None:
    here = folder / "interrupted"
    text = """
    [[solver]]
    name = "faulty"
    options = {fault = "gives_up"}
    [[solver]]
    name = "faulty"
    variant = "sleeps"
    options = {fault = "sleep"}
    """
    suite = tiny_joint.write_suite(here, text, plugin="faulty.py", time_limit_s=100)
    (here / "faulty.py").write_text(tiny_joint.FAULTY)
    rows = here / "out" / records.MEASUREMENTS
    going = forked_command("run", suite, "--out", here / "out")
    workers = wait_for(lambda: rows.exists() and rows.read_bytes() and psutil.Process(going.pid).children())
    assert "another run is writing here" in wrong_usage("run", suite, "--out", here / "out")
    going.send(signal.SIGINT)
    assert going.ended()[0] == 130
    wait_for(lambda: not any(map(is_alive, workers)))
    before = rows.read_bytes()
    _, text = said_by(run, read_suite(str(suite)).model_copy(update={"time_limit_s": 0.2}), here / "out")
    assert "2 measurements, 1 of them already" in text
    assert rows.read_bytes().startswith(before)
    assert [row["status"] for row in rows_of(here / "out")] == ["iteration_limit", "time_limit"]


def test_the_row_is_measured_again_and_compared(copy: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    done = harness("run", copy, "--key", KEY, "--out", again)
    assert done.exit_code == 0, done.output
    (then,) = (row for row in rows_of(copy) if row["key"] == KEY)
    (now,) = rows_of(again)
    same = ("key", "suite", "scene_key", "verdict", "displacement_error_mm", "iterations", "solver_code")
    assert {name: now[name] for name in same} == {name: then[name] for name in same}
    assert harness("compare", copy, again, "--max-slowdown", 1000).exit_code == 1  # the other row is missing
    assert harness("compare", copy, again, "--key", KEY, "--max-slowdown", 1000).exit_code == 0


def test_what_is_measured_again_by_its_key_is_all_that_the_suite_beside_it_plans(tmp_path: Path) -> None:
    """Of a later repeat the earlier ones, too; no scene with whose name that of the row's begins."""
    tiny_joint.write_problem(tmp_path / "tiny b.npz")
    suite = tiny_joint.suite(tmp_path, scenes=["tiny.npz", "tiny b.npz"], repeats=3)
    keys = [f"tiny b exact dual tol=1e-09 threads=1 repeat={k}" for k in range(2)]
    assert said_by(lambda console: run(suite, tmp_path / "out", console, key=keys[1]))[0] == 0
    assert [row["key"] for row in rows_of(tmp_path / "out")] == keys
    assert gated(tmp_path / "out")[0] == 0


@pytest.mark.parametrize(
    "key", ["tiny exact", "tiny gi dual tol=1e-06 threads=1 repeat=0", "", KEY + " case=1"]
)
def test_a_key_that_is_not_planned_is_bad_input(copy: Path, tmp_path: Path, key: str) -> None:
    assert "--key" in wrong_usage("run", copy, "--key", key, "--out", tmp_path / "again")
    assert not (tmp_path / "again").exists()


def test_a_case_of_a_series_comes_after_those_before_it() -> None:
    """In whole batches; other processes are left out."""
    plan = expand(read_suite("series"))
    batched = next(m for m in plan if m.entry.batched and m.case == m.entry.batched + 1)
    found = of_key(plan, batched.key)
    assert [m.case for m in found] == list(range(2 * (batched.entry.batched or 0)))
    assert {m.process for m in found} == {batched.process}
    single = next(m for m in plan if not m.entry.batched and m.case == 3)
    alone = of_key(plan, single.key)
    assert [m.case for m in alone] == [0, 1, 2, 3]
    assert alone[0].entry.cases == 4  # so that the suite beside them plans no others
