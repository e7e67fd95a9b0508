"""The report, from made-up results whose figures can be worked out by hand."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from commands import harness
from synthetic_results import HIGH, LOW, no_answer, results, row, table, times, write_rows

from report.analysis.standings import shown, standings
from report.document.blocks import Figure
from report.document.numbers import significant
from report.results.reader import Results, read
from report.sections import profile
from report.sections.speed import contacts
from report.sections.summary import EACH, PREPARED, advice, explained, scoreboard, summary
from report.writers.suite_report import write

pytestmark = pytest.mark.usefixtures("without_pictures")


def outside(error: float) -> dict[str, Any]:
    return {"displacement_error_mm": error, "verdict": "outside"}


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """Two scenes; a and b are within on both, c is late on one, d is outside on both and says solved."""
    return write_rows(
        tmp_path,
        [
            row(LOW, "a", **times(setup_s=0.5, solve_s=1.0, form_s=0.5, prepare_s=7.0)),
            row(HIGH, "a", **times(solve_s=8.0)),
            row(LOW, "b", "primal", **times(solve_s=1.0)),
            row(HIGH, "b", "primal", **times(solve_s=36.0)),
            row(LOW, "c", **times(solve_s=0.1)),
            row(HIGH, "c", **no_answer("time_limit")),
            row(LOW, "d", **times(solve_s=0.01), **outside(3e-6)),
            row(HIGH, "d", **times(solve_s=0.01), **outside(2e-6), status="inaccurate"),
        ],
    )


def test_a_size_whose_forms_no_solver_takes_has_no_seconds(tmp_path: Path) -> None:
    rows = [row(), row("6112/0100", "highs", "primal", **no_answer("unsupported"))]
    headings = [column.heading for column in table(summary(results(tmp_path, rows))).columns]
    assert [heading for heading in headings if "n = " in heading] == ["s per load case, n = 4386"]


def test_standings_of_a_tiny_run(tiny: Path) -> None:
    lines = standings(read(tiny).cells).set_index("method")
    assert lines.index.tolist() == ["a (dual)", "b (primal)", "c (dual)", "d (dual)"]
    # a: sqrt(2 · 8) = 4; b: sqrt(1 · 36) = 6; c answers half of the scenes, d none: not compared
    assert lines["load_case_s_4386"].tolist() == pytest.approx([4.0, 6.0, math.nan, math.nan], nan_ok=True)
    assert lines["within"].tolist() == [2, 2, 1, 0]
    assert lines.loc["d (dual)", ["outside", "outside_claimed", "worst_error_mm"]].tolist() == [2, 1, 3e-6]
    assert lines.loc["c (dual)", ["no_answer", "no_answer_because"]].tolist() == [1, "1 time limit"]


def test_the_shifted_mean_counts_what_is_missing_or_outside_with_its_limit(tiny: Path) -> None:
    lines = standings(read(tiny).cells).set_index("method")["shifted_mean_s"]
    # with preparation, plus 1 s: a (2 + 7 + 1)(8 + 1) = 90; b 2 · 37; c 1.1 · 61, late; d 61², outside
    assert lines.tolist() == pytest.approx([90**0.5 - 1, 74**0.5 - 1, 67.1**0.5 - 1, 60.0])


def test_a_failure_counts_with_the_largest_limit_on_its_scene(tmp_path: Path) -> None:
    """Not with its own, by which the method that gives up early would be the better one."""
    limits = {"a": 10.0, "b": 100.0, "c": 40.0}
    rows = [row(LOW, name, **no_answer("time_limit") | {"time_limit_s": s}) for name, s in limits.items()]
    rows[-1] = row(LOW, "c", **times(solve_s=30.0) | {"time_limit_s": 40.0})
    lines = standings(results(tmp_path, rows).cells).set_index("method")["shifted_mean_s"]
    assert lines.to_dict() == pytest.approx({"a (dual)": 100.0, "b (dual)": 100.0, "c (dual)": 30.0})


@pytest.mark.parametrize(("limit_s", "text"), [(0.4, "> 0.4 s"), (36000.0, "> 36000 s")])
def test_a_time_limit_is_shown_with_its_digits(limit_s: float, text: str, tmp_path: Path) -> None:
    late = no_answer("time_limit") | {"time_limit_s": limit_s}
    cells = results(tmp_path, [row(LOW, "a"), row(LOW, "b", **late)]).cells
    drawing = scoreboard(cells, standings(cells))
    assert text in [one.get_text() for axes in drawing.axes for one in axes.texts]


def test_a_profile_is_the_share_of_scenes_within_a_factor_of_the_fastest(tmp_path: Path) -> None:
    seconds = {"a": (1.0, 2.0, 8.0, 1.0), "b": (3.0, 1.0, 4.0, None)}
    rows = [
        row(f"4386/{k}", name, **(times(solve_s=t) if t else no_answer("time_limit")))
        for name, of in seconds.items()
        for k, t in enumerate(of)
    ]
    section = profile.section(results(tmp_path, rows))
    assert section is not None
    (figure,) = section.blocks
    assert isinstance(figure, Figure)
    lines = [[*line] for _, *line in figure.data[["method", "ratio", "share"]].itertuples()]
    a = [["a (dual)", ratio, share] for ratio, share in ((1, 0.25), (1, 0.5), (2, 0.75), (2, 1.0))]
    assert lines == [*a, *(["b (dual)", ratio, share] for ratio, share in ((1, 0.25), (1, 0.5), (3, 0.75)))]
    assert "the fastest among them, are methods run on at least half" in figure.caption
    assert profile.section(results(tmp_path / "two", rows[:2])) is None
    fewer = profile.profile(results(tmp_path / "fewer", rows[:6]).cells)  # b on two scenes alone
    assert fewer.loc[fewer["method"] == "b (dual)", "share"].tolist() == [0.5, 1.0]


def test_a_log_is_linked_where_it_is_one_of_the_run(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs/a.txt").write_text("iter 1\n")
    logs = ("logs/a.txt", "logs/none.txt", "logs/../report.md", "javascript:1")
    write(write_rows(tmp_path, [row(LOW, f"s{k}", log=log) for k, log in enumerate(logs)]))
    report, page = ((tmp_path / "report" / name).read_text("utf-8") for name in ("report.md", "index.html"))
    assert [f"[solved](../{log})" in report for log in logs] == [True, False, False, False]
    assert [f'"{log}"' in page for log in logs] == [True, False, False, False]


def test_repeats_give_the_median_time_and_the_worst_verdict(tmp_path: Path) -> None:
    rows = [row(LOW, "a", repeat=k, **times(solve_s=t)) for k, t in enumerate((3.0, 1.0, 2.0))]
    rows += [row(HIGH, "a", repeat=0, **times(solve_s=1.0)), row(HIGH, "a", repeat=1, **no_answer("crashed"))]
    cells = results(tmp_path, rows).cells.set_index("scene")
    assert cells.loc[LOW, ["load_case_s", "verdict", "repeats"]].tolist() == [2.0, "within", 3]
    assert cells.loc[LOW, ["least_s", "most_s"]].tolist() == [1.0, 3.0]
    assert cells.loc[HIGH, ["verdict", "status"]].tolist() == ["no_answer", "crashed"]
    assert math.isnan(cells.loc[HIGH, "load_case_s"])


def test_runs_of_several_machines_are_told_apart(tmp_path: Path) -> None:
    rows = [row(LOW, "a", machine=name, **times(solve_s=t)) for name, t in (("First", 1.0), ("Second", 9.0))]
    text = write(write_rows(tmp_path, rows)).read_text("utf-8")
    assert "come from 2 machines: First (1 row) and Second (1 row)." in text
    assert text.index("## Summary: First") < text.index("## Summary: Second")
    own = pd.read_csv(tmp_path / "report" / "machine2-summary.csv")
    assert own["load_case_s_4386"].tolist() == pytest.approx([9.0])


@pytest.mark.parametrize("owner", [{}, {"owner": None}, {"owner": "theirs"}])
def test_foreign_rows_are_shown(owner: dict[str, Any], tmp_path: Path) -> None:
    """With no owner or another, which comes last; the names of scenes have fewer parts than ours, or more."""
    rows = []
    for solver in ("a", "gi"):
        for scene in ("4386/0100", "hard/x", "hard/steep/1e5/b", "outside/x", "outside/membrane/8/b"):
            rows.append({**row(LOW, solver, objective=-1.0, key=f"{scene} {solver}"), "scene": scene})
    for each in rows[:5]:
        del each["owner"]
        each |= owner
    folder = write_rows(tmp_path / "run", rows)
    size = {"title": "made up", "n": 4386, "m": 2193, "printed_objective": -1.0}
    problems = [{"scene": one["scene"], **size} for one in rows[:5]]
    (folder / "problems.jsonl").write_text("".join(json.dumps(each) + "\n" for each in problems), "utf-8")
    report, merged = harness("report", folder), harness("merge", folder, "--out", tmp_path / "merged")
    assert (report.exit_code, merged.exit_code) == (0, 0), report.output + merged.output
    for directory in (folder, tmp_path / "merged"):
        lines = pd.read_csv(directory / "report" / "honesty.csv")
        assert lines["label"].tolist() == ["gi (dual)", "a (dual)"]
        assert lines["rungs"].tolist() == [2, 2]


def test_a_report_that_cannot_be_made_leaves_the_older_one(
    tiny: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tiny / "report").mkdir()
    for name, text in (("report.md", "![an older one](a.png)"), ("a.png", "")):
        (tiny / "report" / name).write_text(text)
    monkeypatch.setattr("report.writers.suite_report.run_data", None)
    with pytest.raises(TypeError):
        write(tiny)
    assert sorted(path.name for path in (tiny / "report").iterdir()) == ["a.png", "report.md"]


def test_every_table_stands_in_a_csv_with_all_digits(tiny: Path) -> None:
    text = write(tiny).read_text("utf-8")
    shown = re.findall(r"\[CSV\]\(([^)]+)\)\)\n\n((?:\|.*\n)+)", text)
    linked = re.findall(r"\[CSV\]\(([^)]+)\)", text)  # by tables, and by figures that have data of their own
    assert set(linked) == {path.name for path in (tiny / "report").glob("*.csv")}
    for name, lines in shown:
        assert len(pd.read_csv(tiny / "report" / name)) == lines.count("\n") - 2
    scene = pd.read_csv(tiny / "report" / "scene-4386_0100.csv").set_index("label")
    assert list(scene.index) == ["c (dual)", "b (primal)", "a (dual)", "d (dual)"]
    assert scene.loc["a (dual)", "total_s"] == 9.0
    steps = ["prepare_s", "setup_s", "solve_s", "form_s"]
    assert scene.loc["a (dual)", steps].tolist() == [7.0, 0.5, 1.0, 0.5]
    of_scene = dict(shown)["scene-4386_0100.csv"]
    line = next(line for line in of_scene.splitlines() if line.startswith("| a (dual)"))
    words = [word.strip() for word in line.strip("|").split("|")]
    assert words == ["a (dual)", "✓ within", "solved", "1.00e-9", "20", "2.00", "9.00", "512"]
    assert re.search(r"\| c \(dual\) .* time limit .* > 60 s \(time limit\) \|", text)


def test_a_run_without_an_answer_stands_with_the_others_of_its_method(tmp_path: Path) -> None:
    """A killed run does not say how many threads were in effect, which is not what was asked for."""
    scenes = [f"4386/{k:04d}" for k in range(5)]
    rows = [row(scene, "mine", threads=1) for scene in scenes[:4]]
    rows.append(row(scenes[4], "mine", threads=None, **no_answer("crashed")))
    rows += [row(scene, "newton", threads=1) for scene in scenes]
    lines = standings(results(tmp_path, rows).cells)
    assert lines[["method", "within", "scenes"]].to_numpy().tolist() == [
        ["newton (dual)", 5, 5],
        ["mine (dual)", 4, 5],
    ]


def test_what_is_a_row_of_its_own_is_a_line_of_its_own(tmp_path: Path) -> None:
    """Options, load cases solved at once, threads asked for and tolerances, where two are on one scene."""
    rows = [row(LOW, "a", options={"k": k, "via": "x"}) for k in (1, 2)]
    rows += [row(LOW, "b", batched_asked=k, batched=1) for k in (8, 16, None)]
    rows += [row(LOW, "c", threads=2, threads_asked=k) for k in (1, 4)]
    rows += [row(LOW, "d", batched_asked=8), row(HIGH, "d", batched_asked=4)]
    rows += [row(scene, "e", options={"k": 1}) for scene in (LOW, HIGH)]
    rows += [row(LOW, "f", variant="direct", tolerance=tolerance) for tolerance in (1e-6, 1e-9)]
    read_back = results(tmp_path, rows)
    assert (len(read_back.rows), read_back.left_out) == (len(rows), 0)
    assert set(read_back.cells["label"]) == {
        *(f'a (dual) k = {k}, via = "x"' for k in (1, 2)),
        *("b (dual) 8 at once", "b (dual) 16 at once", "b (dual)"),
        *("c (dual) × 1 thread", "c (dual) × 4 threads", "d (dual)", "e (dual)"),
        *("f (dual) direct 1e-6", "f (dual) direct 1e-9"),
    }


def test_a_line_is_broken_where_a_run_did_not_finish(tmp_path: Path) -> None:
    rows = [row(f"4386/{k}", "a", **times(solve_s=1.0)) for k in (100, 200, 400)]
    rows += [row("4386/300", "a", **no_answer("time_limit"))]
    rows += [row(f"4386/{k}", "b") for k in (100, 300)]
    section = contacts(results(tmp_path, rows))
    (axes,) = section.blocks[0].drawing.axes[:1]  # type: ignore[union-attr]
    seconds = axes.lines[0].get_ydata()
    assert [math.isnan(s) for s in seconds] == [False, False, True, False]


def test_significant_figures() -> None:
    texts = {0.0912: "0.0912", 12.34: "12.3", 999.6: "1000", 1234.0: "1230", 4.1e-9: "4.10e-9", None: "–"}
    assert {value: significant(value) for value in texts} == texts


def test_a_directory_without_measurements_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"measurements\.jsonl"):
        write(tmp_path)


# Which solver to use, and what charts show.


def advised(found: Results, seconds: str = EACH) -> pd.Series:
    return table(advice(found)).data.set_index("seconds of").loc[seconds]


def test_the_fastest_on_every_scene_is_advised(tiny: Path, tmp_path: Path) -> None:
    """c is faster, but on one scene only; the mean of a is sqrt(2 · 8) = 4, of b sqrt(1 · 36) = 6."""
    line = advised(read(tiny))
    assert line[["use", "seconds", "next", "to_next"]].tolist() == ["a (dual)", 4.0, "b (primal)", 1.5]
    assert advised(read(tiny), PREPARED)["use"] == "b (primal)"  # a prepares for 7 s on one of the scenes
    rows = [row(LOW, "a"), row(HIGH, "a", **outside(1e-6)), row(LOW, "b", **outside(1e-6)), row(HIGH, "b")]
    assert advised(results(tmp_path / "none", rows))["use"] == "none on every scene"


def test_charts_show_methods_run_on_half_of_the_scenes_and_name_the_others(tmp_path: Path) -> None:
    scenes = {"a": 4, "b": 2, "c": 1}
    rows = [row(f"4386/{k:04d}", solver) for solver, most in scenes.items() for k in range(most)]
    cells = results(tmp_path / "some", rows).cells
    assert set(shown(cells)["method"]) == {"a (dual)", "b (dual)"}
    caption = explained(shown(cells), standings(cells), "1e-7 mm")
    assert "Run on fewer than half of the scenes: c (dual)." in caption
    alone = results(tmp_path / "alone", [r for r in rows if r["solver"] != "b"]).cells
    assert shown(alone).empty


def test_what_was_not_run_stands_in_the_picture_of_all_scenes(tmp_path: Path) -> None:
    """A method that lost on one of four scenes, and was not run on the others."""
    rows = [row(f"4386/{k:04d}", "a") for k in range(4)]
    late = {"status": "not_run", "verdict": "no_answer", "displacement_error_mm": None}
    rows += [row(f"4386/{k:04d}", "b") | (late if k else {}) for k in range(4)]
    cells = results(tmp_path, rows).cells
    assert shown(cells).empty  # too few runs for a line
    section = summary(results(tmp_path, rows))
    assert section is not None
    (picture,) = [block for block in section.blocks if isinstance(block, Figure)]
    texts = [text.get_text() for text in picture.drawing.axes[0].texts]
    assert texts.count("not run") == 3
