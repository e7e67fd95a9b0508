"""The sections on what accuracy costs, from rows whose facts were planted."""

from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread
from synthetic_results import HIGH, LOW, answer, no_answer, results, row, shown, sweep, table

from report.analysis.standings import best_tolerances, cells_of_curves, fastest_first, with_errors
from report.document.blocks import Figure
from report.figures import style
from report.page.run_page_data import run_data
from report.results.reader import Results
from report.sections import accuracy, summary
from report.writers.sections_writer import written


def changed(rows: list[dict[str, Any]], solver: str, **figures: Any) -> list[dict[str, Any]]:
    return [r | figures if r["solver"] == solver else r for r in rows]


def prices(found: Results) -> Any:
    return table(accuracy.costs(found), "price-list").data.set_index("method")


def advised(found: Results) -> Any:
    lines = table(summary.advice(found), "advice").data
    return lines[lines["seconds of"] == summary.EACH].set_index("accuracy_mm")


def test_the_sections_are_written_with_their_picture(tmp_path: Path) -> None:
    found = results(tmp_path, [answer(LOW, "honest", 7, 1.3, 5e-8, repeat=1), *sweep()])
    with style.applied():
        sections = [summary.advice(found), accuracy.costs(found), accuracy.tolerances(found)]
    text = written(tmp_path / "report.md", "", sections).read_text("utf-8")
    for title in ("Which solver to use", "The cost of accuracy", "Requested tolerance and achieved error"):
        assert f"## {title}\n" in text
    (picture,) = tmp_path.glob("*.png")
    assert imread(picture)[..., :3].std() > 0.04, f"{picture} is blank"
    assert "nan" not in text.replace("-", " ").lower().split()


def panels(found: Results) -> Any:
    section = accuracy.costs(found)
    (figure,) = (block for block in section.blocks if isinstance(block, Figure))
    return figure.drawing.axes


def drawn_lines(axes: Any, seconds: float) -> list[tuple[str, int]]:
    """Line style and number of points of every line through that time."""
    return [
        (str(line.get_linestyle()), len(line.get_xdata()))
        for line in axes.lines
        if any(y == pytest.approx(seconds) for y in line.get_ydata()) and line.get_zorder() > 1
    ]


def test_three_tolerances_make_a_curve_and_two_are_points(tmp_path: Path) -> None:
    rows = [answer(LOW, "curve", k, 0.7 + k, 10.0**-k) for k in (3, 5, 7)]
    rows += [answer(LOW, "points", k, 0.5 + k, 10.0**-k) for k in (3, 5)]
    (axes,) = panels(results(tmp_path, rows))
    assert drawn_lines(axes, 5.7) == [("-", 3)]
    assert drawn_lines(axes, 5.5) == [("None", 2)]


def test_the_diagram_shows_the_fewest_and_the_most_contacts(tmp_path: Path) -> None:
    rows = [answer(f"4386/{k}", "a", d, 1.0, 10.0**-d) for k in (900, 100, 500) for d in (3, 5, 7)]
    titles = [axes.get_title() for axes in panels(results(tmp_path, rows))]
    assert titles == ["n = 4386, 100 active", "n = 4386, 900 active"]


def test_the_front_is_drawn_through_what_nothing_beats(tmp_path: Path) -> None:
    rows = [answer(LOW, "a", 3, 1.0, 1e-3), answer(LOW, "b", 5, 2.0, 1e-5), answer(LOW, "c", 4, 3.0, 1e-4)]
    rows += [answer(LOW, "d", k, 4.0, 1e-4) for k in (5, 6, 7)]
    (axes,) = panels(results(tmp_path, rows))
    (front,) = (line for line in axes.lines if line.get_drawstyle() == "steps-post")
    assert front.get_xdata()[:3].tolist() == [1e-5, 1e-5, 1e-3]
    assert front.get_ydata()[1:].tolist() == [2.0, 1.0, 1.0]


def test_an_error_counts_at_least_as_the_bound_on_the_references(tmp_path: Path) -> None:
    rows = [answer(LOW, "a", 9, 1.0, e, reference_bound_mm=1e-11, repeat=k) for k, e in enumerate((0, 1e-12))]
    rows += [answer(LOW, "b", 9, 1.0, 3e-11, reference_bound_mm=1e-11)]
    cells = with_errors(results(tmp_path, rows).cells).set_index("solver")
    assert cells["error"].to_dict() == {"a": 1e-11, "b": 3e-11}


def test_prices_are_the_fastest_measured_run_that_is_accurate_enough(tmp_path: Path) -> None:
    line = prices(results(tmp_path, sweep())).loc["honest (dual)"]
    # errors are half the tolerance: 10^-k is first met at k digits, which take 0.01 · 2^k s
    assert [line[f"seconds_1e-{k}"] for k in (3, 5, 7, 9)] == pytest.approx([0.08, 0.32, 1.28, 5.12])


def test_a_price_is_the_geometric_mean_over_the_scenes(tmp_path: Path) -> None:
    rows = [answer(LOW, "a", k, 1.0, 10.0**-k / 2) for k in (3, 5, 7)]
    rows += [answer(HIGH, "a", k, 4.0, 10.0**-k / 2) for k in (3, 5, 7)]
    assert prices(results(tmp_path, rows)).loc["a (dual)", "seconds_1e-7"] == pytest.approx(2.0)


def test_what_was_not_reached_is_shown_as_such(tmp_path: Path) -> None:
    rows = [*sweep(), answer(LOW, "once", 9, 1.0, 1e-9)]
    rows += [row(s, "lost", tolerance=1e-6, **no_answer("crashed")) for s in (LOW, HIGH)]
    lines = shown(table(accuracy.costs(results(tmp_path, rows)), "price-list"))
    words = {line[1]: line[2:6] for line in lines}
    assert words["late (dual)"] == ["1.00 s", "> 68.0 s", "> 68.0 s", "> 68.0 s"]
    assert words["coarse (dual)"] == ["2.00 s", "2.00 s", "not reached (3.0e-6)", "not reached (3.0e-6)"]
    assert words["once (dual)"] == ["–"] * 4
    assert words["lost (dual)"] == ["no answer"] * 4


def test_a_reference_too_coarse_for_an_accuracy_does_not_judge_it(tmp_path: Path) -> None:
    coarse = results(tmp_path, [r | {"reference_bound_mm": 1e-9} for r in sweep()])
    line = prices(coarse).loc["honest (dual)"]
    assert line["price_1e-7"] == "1.28 s"
    assert line["price_1e-9"] == "cannot be judged"
    assert advised(coarse).loc[1e-9, "use"] == "cannot be judged: the reference is not accurate enough"


def test_where_nothing_is_proven_nothing_is_judged_drawn_or_trusted(tmp_path: Path) -> None:
    """An infinite bound is null in the rows; on the other scene all is as before."""
    unproven = {"reference_bound_mm": None, "verdict": "cannot_be_judged"}
    some = results(tmp_path / "some", [r | (unproven if r["scene"] == HIGH else {}) for r in sweep()])
    uses = advised(some).loc[[1e-3, 1e-5, 1e-9], "use"]
    assert set(uses) == {"cannot be judged: the reference is not accurate enough"}
    trust = accuracy.trust(some).set_index("method")
    assert trust.loc["honest (dual)", "solved"] == 9
    (axes,) = panels(some)
    assert axes.get_title() == "n = 4386, 100 active"
    none = results(tmp_path / "none", [r | unproven for r in sweep()])
    for k in (3, 5, 7, 9):
        assert set(prices(none)[f"price_1e-{k}"]) == {"cannot be judged"}
    assert accuracy.tolerances(none) is None
    assert not [each for each in run_data(none)["cells"]["reached_mm"] if each is not None]


def test_a_tolerance_that_is_not_met_is_found_out(tmp_path: Path) -> None:
    trust = accuracy.trust(results(tmp_path, sweep())).set_index("method")
    assert trust.loc["liar (dual)", "worst_ratio"] == pytest.approx(900, rel=0.02)
    # its error is 900 times the tolerance, on two scenes: outside at 7, 8 and 9 digits, not at 10
    assert trust.loc["liar (dual)", ["solved", "above_tolerance", "tight", "tight_outside"]].tolist() == [
        *(18, 18, 8, 6),
    ]
    assert trust.loc["honest (dual)", ["above_tolerance", "tight", "tight_outside"]].tolist() == [0, 8, 0]
    rows = changed(sweep(), "liar", status="inaccurate")  # without a promise
    assert "liar (dual)" not in set(accuracy.trust(results(tmp_path / "inaccurate", rows))["method"])


def test_what_the_reference_leaves_open_is_in_the_solvers_favour(tmp_path: Path) -> None:
    rows = [answer(LOW, "a", k, 1.0, 10.0**-k + 5e-11, reference_bound_mm=6e-11) for k in (6, 8, 10)]
    trust = accuracy.trust(results(tmp_path, rows)).set_index("method")
    assert trust.loc["a (dual)", "above_tolerance"] == 0


def test_settings_must_reach_the_accuracy_on_every_scene(tmp_path: Path) -> None:
    rows = [r for r in sweep() if r["solver"] == "honest"]
    rows += [answer(LOW, "lucky", 7, 0.001, 1e-9), answer(HIGH, "lucky", 7, 0.001, 1e-6)]
    cells = cells_of_curves(results(tmp_path, rows))
    assert fastest_first(cells, accuracy_mm=1e-7)["label"][0] == "honest (dual) 1e-7"
    assert fastest_first(cells, accuracy_mm=1e-5)["label"][0] == "lucky (dual)"


def test_the_recommendation_follows_the_times(tmp_path: Path) -> None:
    line = advised(results(tmp_path / "a", sweep())).loc[1e-7]
    assert line["use"] == "honest (dual) 1e-7"
    assert line["seconds"] == pytest.approx(1.28)
    slower = changed(sweep(), "honest", solve_s=50.0)
    advice = advised(results(tmp_path / "b", slower))
    assert advice.loc[1e-7, "use"] == "liar (dual) 1e-10"
    assert advice.loc[1e-9, "use"] == "honest (dual) 1e-9"
    coarse = [r for r in sweep() if r["solver"] in ("coarse", "late")]
    advice = advised(results(tmp_path / "c", coarse))
    assert advice.loc[1e-3, "use"] == "late (dual) 1e-4"
    assert advice.loc[1e-9, "use"] == "none on every scene"


def test_the_best_of_several_tolerances_stands_for_a_solver(tmp_path: Path) -> None:
    run = results(tmp_path, sweep())
    # honest is within 1e-7 mm from 7 digits on, and the fastest there; liar at 10 digits alone
    lines = best_tolerances(run.cells).drop_duplicates("label").set_index("method")["tolerance"]
    assert lines[["honest (dual)", "liar (dual)"]].tolist() == [1e-7, 1e-10]
    methods = table(summary.summary(run), "summary").data["method"]
    assert methods.tolist()[:2] == ["honest (dual)", "liar (dual)"]
    assert methods.is_unique
