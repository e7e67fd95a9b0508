"""`compare`: rows are changed one by one, and what is said of each is known."""

import csv
from pathlib import Path
from typing import Any

import pytest
from commands import harness
from synthetic_results import no_answer, row, write_rows
from typer.testing import Result

from harness.results.counted_rows import counting
from harness.verification.findings import read_baseline
from problems.errors import InputError
from report.results.reader import read


def compare(*words: object) -> Result:
    return harness("compare", *words)


def repeats(times: list[float], **figures: Any) -> list[dict[str, Any]]:
    """Rows with these seconds per load case in all."""
    setup = {"setup_s": 0.0, "form_s": None}
    return [row(repeat=k, solve_s=time, **setup | figures) for k, time in enumerate(times)]


def lines(out: Path) -> list[dict[str, str]]:
    with (out / "comparison.csv").open() as file:
        return list(csv.DictReader(file))


def test_equal_runs_have_no_change(tmp_path: Path) -> None:
    old, new = (write_rows(tmp_path / name, repeats([1.0, 1.1, 1.2])) for name in ("old", "new"))
    done = compare(old, new, "--out", tmp_path / "out")
    assert done.exit_code == 0
    assert "1 measurement: 1 alike" in done.stdout
    (line,) = lines(tmp_path / "out")
    assert float(line["digits_lost"]) == 0
    assert float(line["ratio"]) == 1
    assert float(line["ratio_least"]) == pytest.approx(1.0 / 1.2)
    assert float(line["ratio_most"]) == pytest.approx(1.2)


def test_seconds_that_are_none_are_not_compared(tmp_path: Path) -> None:
    for times in ((1.0, 0.0), (float("inf"), 1.0)):
        sides = [write_rows(tmp_path / str(time), repeats([time] * 3)) for time in times]
        assert compare(*sides, "--out", tmp_path / "out").exit_code == 0
        assert lines(tmp_path / "out")[0]["ratio"] == ""


CHANGES: dict[str, tuple[dict[str, Any], int, str]] = {
    "digits": ({"displacement_error_mm": 9e-8}, 1, "2.0 digits lost"),
    "few digits": ({"displacement_error_mm": 9e-9}, 0, ""),
    "gained": ({"displacement_error_mm": 9e-12}, 0, "2.0 digits gained"),
    "below the bound": ({"displacement_error_mm": 1e-9, "reference_bound_mm": 1e-7}, 0, ""),
    "outside": ({"displacement_error_mm": 2e-7, "verdict": "outside"}, 1, "within → outside"),
    "no answer": (no_answer("crashed"), 1, "within → no answer"),
    "status": ({"status": "inaccurate"}, 0, "solved → inaccurate"),
}


@pytest.mark.parametrize("kind", CHANGES)
def test_a_change_of_an_answer_is_named(kind: str, tmp_path: Path) -> None:
    figures, code, change = CHANGES[kind]
    old = write_rows(tmp_path / "old", [row(displacement_error_mm=9e-10)])
    new = write_rows(tmp_path / "new", [row(**{"displacement_error_mm": 9e-10} | figures)])
    done = compare(old, new, "--out", tmp_path / "out")
    assert done.exit_code == code, done.output
    (line,) = lines(tmp_path / "out")
    assert line["change"] == change
    assert change in (tmp_path / "out" / "comparison.md").read_text()
    assert change in done.stdout


@pytest.mark.parametrize(
    ("before", "after", "code"),
    [
        ([1.0, 1.0, 1.0], [1.4, 1.4, 1.4], 1),
        ([1.0, 1.0, 1.0], [1.2, 1.2, 1.2], 0),  # less than allowed
        ([1.0, 1.0, 1.5], [1.4, 1.4, 1.4], 0),  # within the noise of the old ones
        ([1.0, 1.0, 1.0], [0.9, 1.4, 1.4], 0),  # of the new ones
        ([1.0], [1.31], 0),  # single runs vary by 15 % each
        ([1.0], [1.4], 1),
    ],
)
def test_slower_beyond_noise(before: list[float], after: list[float], code: int, tmp_path: Path) -> None:
    old, new = write_rows(tmp_path / "old", repeats(before)), write_rows(tmp_path / "new", repeats(after))
    assert compare(old, new).exit_code == code
    assert compare(old, new, "--max-slowdown", 5).exit_code == 0


@pytest.mark.parametrize("option", ["--max-digits-lost", "--max-slowdown"])
def test_a_limit_that_is_no_number_passes_nothing(option: str, tmp_path: Path) -> None:
    done = compare(tmp_path, tmp_path, option, "nan")
    assert done.exit_code == 2
    assert option in done.stderr


def test_what_cannot_be_judged_loses_no_digits(tmp_path: Path) -> None:
    """A bound of null is infinite, not zero."""
    unproven: dict[str, Any] = {"reference_bound_mm": None, "verdict": "cannot_be_judged"}
    sides = [write_rows(tmp_path / str(e), [row(displacement_error_mm=e) | unproven]) for e in (1e-9, 1e-6)]
    assert compare(*sides, "--out", tmp_path / "out").exit_code == 0
    (line,) = lines(tmp_path / "out")
    assert (line["change"], line["digits_lost"]) == ("", "")


def test_seconds_of_wrong_answers_enter_no_mean(tmp_path: Path) -> None:
    """Twice as fast within the limit, ten times as slow where both are outside it."""
    bad = {"verdict": "outside", "displacement_error_mm": 2e-7}
    for side, seconds in (("old", (2.0, 1.0)), ("new", (1.0, 10.0))):
        good, wrong = ({"solve_s": s, "setup_s": 0.0, "form_s": 0.0} for s in seconds)
        write_rows(tmp_path / side, [row("4386/0001", **good), row("4386/0002", **wrong | bad)])
    assert compare(tmp_path / "old", tmp_path / "new", "--out", tmp_path / "out").exit_code == 0
    assert [line["ratio"] for line in lines(tmp_path / "out")] == ["0.5", ""]
    with (tmp_path / "out" / "solvers.csv").open() as file:
        assert [line["ratio"] for line in csv.DictReader(file)] == ["0.5"]


def test_what_became_worse_comes_first_and_the_worst_at_the_top(tmp_path: Path) -> None:
    scenes = [f"4386/{k:04d}" for k in range(6)]
    changed: list[dict[str, Any]] = [
        {},
        {"displacement_error_mm": 1e-11},
        {"solve_s": 9.0},
        {"displacement_error_mm": 5e-8},
        {"displacement_error_mm": 9e-8},
        {"verdict": "outside", "displacement_error_mm": 2e-7},
    ]
    old = write_rows(tmp_path / "old", [row(scene) for scene in (*scenes, "4386/0007")])
    new = [row(scene, **figures) for scene, figures in zip(scenes, changed, strict=True)]
    out = tmp_path / "out"
    assert compare(old, write_rows(tmp_path / "new", [*new, row("4386/0008")]), "--out", out).exit_code == 1
    found = [line["measurement"].split()[0] for line in lines(out)]
    assert found == [f"4386/000{k}" for k in (7, 5, 4, 3, 2, 1, 8, 0)]
    assert "8 measurements: 5 worse, 1 better, 1 new, 1 alike" in (out / "comparison.md").read_text()


def test_the_worst_of_the_repeats_counts(tmp_path: Path) -> None:
    old = write_rows(tmp_path / "old", repeats([1.0, 1.0]))
    bad = {"verdict": "outside", "displacement_error_mm": 1e-3}
    new = write_rows(tmp_path / "new", [row(repeat=0, **bad), row(repeat=1)])
    assert compare(old, new).exit_code == 1


def test_the_cases_of_a_series_are_measurements_of_their_own(tmp_path: Path) -> None:
    cases = [row(case=k, displacement_error_mm=1e-9) for k in range(3)]
    old = write_rows(tmp_path / "old", cases)
    new = write_rows(tmp_path / "new", [*cases[:2], cases[2] | {"displacement_error_mm": 8e-8}])
    done = compare(old, new)
    assert "case=2" in done.stdout
    assert "1 worse, 2 alike" in done.stdout


def test_a_failure_is_that_of_the_same_load_cases_at_once(tmp_path: Path) -> None:
    """One that ended before it was known how many were solved; rows of older versions know only that."""
    before, older = row(case=0, batched_asked=4, batched=4), row(case=0, batched=4)
    failed = before | no_answer("crashed") | {"batched": None}
    for k, old in enumerate((before, older)):
        sides = [write_rows(tmp_path / f"{name}{k}", [one]) for name, one in (("old", old), ("new", failed))]
        done = compare(*sides)
        assert "1 measurement: 1 worse" in done.stdout, done.output
        assert "batched=4" in done.stdout


def searched(kept: float, **figures: Any) -> list[dict[str, Any]]:
    """A search that keeps a tolerance, as the next looser one does not suffice."""
    missed = {"verdict": "outside", "displacement_error_mm": 1e-3}
    return [row(tolerance=10 * kept, searched=True, **missed), row(tolerance=kept, searched=True, **figures)]


@pytest.mark.parametrize(
    ("kept", "figures", "said"),
    [
        (1e-5, {}, "1 measurement: 1 alike"),
        (1e-6, {}, "1 measurement: 1 alike"),
        (1e-7, {"displacement_error_mm": 9e-8}, "2.0 digits lost"),
        (1e-7, {"verdict": "outside", "displacement_error_mm": 2e-7}, "within → outside"),
    ],
)
def test_the_answer_that_a_search_keeps_is_compared(
    kept: float, figures: dict[str, Any], said: str, tmp_path: Path
) -> None:
    """Whatever its tolerance; those that it tried are no measurements."""
    old = write_rows(tmp_path / "old", searched(1e-6))
    done = compare(old, write_rows(tmp_path / "new", searched(kept, **figures)))
    assert said in done.stdout
    assert done.exit_code == (0 if "alike" in said else 1)


@pytest.mark.parametrize(
    ("tried", "kept"),
    [
        ({"a": {1e-5: "outside"}, "b": {1e-6: "within"}}, [1e-6]),
        ({"a": {1e-5: "outside", 1e-6: "within"}, "b": {1e-6: "outside", 1e-7: "within"}}, [1e-6, 1e-7]),
    ],
)
def test_workers_on_two_machines_share_a_search_and_merged_runs_do_not(
    tried: dict[str, dict[float, str]], kept: list[float], tmp_path: Path
) -> None:
    """The gate, which counts rows, and the report keep the same answers."""
    told = [(name, *pair) for name, verdicts in tried.items() for pair in verdicts.items()]
    figures = ({"machine": name, "tolerance": tol, "verdict": verdict} for name, tol, verdict in told)
    rows = [row(searched=True, **each) for each in figures]
    assert [each["tolerance"] for each in counting(rows)] == kept
    assert read(write_rows(tmp_path, rows)).rows["tolerance"].tolist() == kept


def test_rows_of_rounds_do_not_divide_a_search_on_two_machines() -> None:
    """They repeat a measurement, as the rows of merged runs do."""
    search = {"a": (1e-5, "outside"), "b": (1e-6, "within")}
    rows = [row(searched=True, machine=at, tolerance=tol, verdict=how) for at, (tol, how) in search.items()]
    rows += [row(solver="gi", round=begun) for begun in (None, "2026-01-01T00:00:00+00:00")]
    assert [each["tolerance"] for each in counting(rows)] == [1e-6, 1e-9, 1e-9]


def test_runs_that_a_trace_stopped_are_not_compared(tmp_path: Path) -> None:
    """A method that takes fewer iterations than before has fewer of them."""
    stopped = [row(variant=f"stopped at {k}", iteration_limit=k) for k in (1, 2, 4)]
    old, new = (write_rows(tmp_path / name, [row(), *stopped[:k]]) for name, k in (("old", 3), ("new", 2)))
    done = compare(old, new)
    assert (done.exit_code, "1 measurement: 1 alike" in done.stdout) == (0, True)


def test_a_row_of_a_round_is_compared_with_that_of_another(tmp_path: Path) -> None:
    """And with one outside rounds, as `run --key` makes it; the round of the key itself comes first."""
    key, at = "4386/0052 ipm dual repeat=0", " round=2026-01-0{}T00:00:00+00:00"
    rows = [row(key=key + at.format(k), round=f"2026-01-0{k}") for k in (1, 2)]
    bad = rows[1] | {"displacement_error_mm": 9e-8}
    old = write_rows(tmp_path / "old", [rows[0], bad])
    for k, other in enumerate((row(key=key), rows[1], row(key=key + at.format(3), round="2026-01-03"))):
        done = compare(old, write_rows(tmp_path / f"new{k}", [other]), "--key", rows[0]["key"])
        assert done.exit_code == 0, done.output
        assert "1 measurement: 1 alike" in done.stdout
    refused = compare(old, tmp_path / "new0", "--key", key.replace("ipm", "gi"))
    assert (refused.exit_code, "the key of a row in" in refused.stderr) == (2, True)


def test_times_of_other_machines_are_refused_and_accuracy_is_not(tmp_path: Path) -> None:
    old = write_rows(tmp_path / "old", [row()])
    slow = write_rows(tmp_path / "slow", [row(machine="another", solve_s=100.0)])
    done = compare(old, slow)
    assert done.exit_code == 0
    assert "Times are not compared" in done.stdout
    assert compare(old, slow, "--max-slowdown", 2).exit_code == 5
    far = write_rows(tmp_path / "far", [row(machine="another", displacement_error_mm=9e-8)])
    assert compare(old, far).exit_code == 1


def test_more_than_two_runs(tmp_path: Path) -> None:
    old = write_rows(tmp_path / "old", [row()])
    news = [write_rows(tmp_path / f"new{k}", [row(displacement_error_mm=10.0**-k)]) for k in (9, 7)]
    done = compare(old, *news, "--out", tmp_path / "out")
    assert done.exit_code == 1
    page = (tmp_path / "out" / "comparison.md").read_text()
    assert page.count("## ") == 3
    assert [line["change"] for line in lines(tmp_path / "out")] == ["", "2.0 digits lost"]


BAD: dict[str, tuple[dict[str, Any], int, str]] = {
    "problem": ({"scene_key": "another"}, 5, "another problem"),
    "size": ({"n": 12}, 5, "another problem"),
    "limit": ({"limit_mm": 1e-9}, 5, "another limit"),
    "suite": ({"scene": "4386/0107", "suite": "other"}, 5, "suite = ['other']"),
    "kind": ({"solve_s": "fast"}, 2, "line 1: solve_s"),
    "huge": ({"solve_s": 10**400}, 2, "line 1: solve_s"),
    "verdict": ({"verdict": None}, 2, "verdict"),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_cannot_be_compared_is_refused(kind: str, tmp_path: Path) -> None:
    figures, code, message = BAD[kind]
    old = write_rows(tmp_path / "old", [row(scene_key="one")])
    new = write_rows(tmp_path / "new", [row(**{"scene_key": "one"} | figures)])
    done = compare(old, new)
    assert done.exit_code == code
    assert message in done.stderr


def test_rows_of_other_options_are_no_repeats(tmp_path: Path) -> None:
    """Of one solver under one variant, as after a change of the suite; one of them has its key."""
    rows = [row(key=f"a {rho}", options={"rho": rho}, repeat=k) for k, rho in enumerate((0.1, 0.2))]
    both, one = write_rows(tmp_path / "both", rows), write_rows(tmp_path / "one", rows[:1])
    for sides in ((both, one), (one, both)):
        done = compare(*sides)
        assert done.exit_code == 2
        said = " ".join(done.stderr.split())
        assert f"{both}: options of 4386/0052 ipm dual tol=1e-09 threads=2 = '{{\"rho\": 0.2}}'" in said
        assert '{"rho": 0.1}, as in an earlier row' in said
    assert compare(one, both, "--key", "a 0.1").exit_code == 0
    with pytest.raises(InputError, match="options of"):
        read_baseline(one, 10.0, "now", rows)


def test_a_directory_without_rows_is_bad_input(tmp_path: Path) -> None:
    full, empty = write_rows(tmp_path / "full", [row()]), write_rows(tmp_path / "empty", [])
    for words in ((full, empty), (tmp_path / "none", full)):
        assert compare(*words).exit_code == 2


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    name = "4386/[bold]|`\x1b[31m<b>"
    old = write_rows(tmp_path / "old", [row(solver=name)])
    new = write_rows(tmp_path / "new", [row(solver=name, displacement_error_mm=9e-8)])
    done = compare(old, new, "--out", tmp_path / "out")
    assert done.exit_code == 1
    page = (tmp_path / "out" / "comparison.md").read_text()
    assert "<b>" not in page
    assert "\x1b" not in page + done.stdout


def test_the_same_code_measured_twice_is_not_slower() -> None:
    """Single runs, two hours apart: times are 0.93 to 1.7 times as long, 1.12 in the median."""
    published = Path(__file__).parents[2] / "results" / "published"
    said = harness("compare", published / "default", published / "default-again")
    assert said.exit_code == 0
    assert "worse" not in said.output
